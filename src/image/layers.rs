//! A linear image as metrics take it, from a frame or from an EXR with the layers of [`super::Picture::write_exr`]; a
//! Monte-Carlo reference adds the layer `variance` (R, G, B): the variance of each pixel's mean radiance.

use std::path::Path;

use exr::prelude::{AnyChannels, FlatSamples, Layer, ReadChannels, ReadLayers};

use super::Picture;
use crate::{Error, Result};

/// What a reader of EXR files is told to do about one that does not fit.
const REMEDY: &str = "take an EXR of `canopy render --exr`, or a reference with the same layers";

/// Radiance and what decides to which region a pixel belongs; row 0 at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Pixels.
    pub size: [u32; 2],
    /// Radiance, linear RGB, in the scene's units.
    pub radiance: Vec<[f32; 3]>,
    /// Distance along the view axis, m; 0 where nothing is.
    pub depth: Vec<f32>,
    /// Lit ground, shadowed ground, lit trees, shadowed trees, as shares of the pixel; the rest is background.
    pub fractions: Vec<[f32; 4]>,
    /// Variance of the mean radiance, by channel; `None` for images without noise.
    pub variance: Option<Vec<[f32; 3]>>,
}

impl Layers {
    /// Of a frame; `None` if its plan had no layers.
    pub fn of(picture: &Picture) -> Option<Self> {
        let l = picture.linear.as_ref()?;
        Some(Layers {
            size: picture.size,
            radiance: l.radiance(),
            depth: l.depth.clone(),
            fractions: l.fractions.clone(),
            variance: l.noise.as_ref().map(|n| n.variance.clone()),
        })
    }

    /// The means over squares of `side` pixels; those at the right and lower edges may be cut. Depth is the mean where something
    /// is.
    pub fn averaged(&self, side: u32) -> Self {
        let size = self.size.map(|s| s.div_ceil(side));
        let pixels = |k: u32| {
            let [x, y] = [k % size[0], k / size[0]].map(|v| v * side);
            let end = |from: u32, n: u32| (from + side).min(n);
            let rows = y..end(y, self.size[1]);
            rows.flat_map(move |v| (x..end(x, self.size[0])).map(move |u| (v * self.size[0] + u) as usize))
        };
        fn mean<const N: usize>(all: &[[f32; N]], pixels: impl Iterator<Item = usize>) -> ([f32; N], f64) {
            let (mut sum, mut count) = ([0.0; N], 0.0);
            for k in pixels {
                sum.iter_mut().zip(all[k]).for_each(|(s, v)| *s += f64::from(v));
                count += 1.0;
            }
            (sum.map(|s| (s / f64::max(count, 1.0)) as f32), count)
        }
        let depth: Vec<[f32; 1]> = self.depth.iter().map(|d| [*d]).collect();
        let all = 0..size[0] * size[1];
        Layers {
            size,
            radiance: all.clone().map(|k| mean(&self.radiance, pixels(k)).0).collect(),
            depth: all
                .clone()
                .map(|k| mean(&depth, pixels(k).filter(|p| self.depth[*p] > 0.0)).0[0])
                .collect(),
            fractions: all.clone().map(|k| mean(&self.fractions, pixels(k)).0).collect(),
            // Pixels are independent: the variance of their mean is the mean of their variances over their number.
            variance: self.variance.as_ref().map(|variance| {
                let of = |k| {
                    let (mean, count) = mean(variance, pixels(k));
                    mean.map(|v| v / count as f32)
                };
                all.map(of).collect()
            }),
        }
    }

    /// Reads the layers `radiance`, `depth` and `fractions` of an EXR, and `variance` if it has that.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be opened; [`Error::Input`] for one that is no EXR, lacks a layer, or whose layers
    /// differ in size.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        let wrong = |place: &str, what: String| {
            Error::input(path, place, format!("not a linear image: {what}"), REMEDY)
        };
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(std::io::Cursor::new(bytes))
            .map_err(|e| wrong("", e.to_string()))?;
        let find = |name: &str| image.layer_data.iter().find(|l| is_named(l, name));
        let require = |name: &str| find(name).ok_or_else(|| wrong(name, "there is no such layer".into()));
        let first = require("radiance")?;
        let read = |layer: &Layer<AnyChannels<FlatSamples>>, name: &str, channel: &str| {
            if layer.size != first.size {
                return Err(wrong(name, "another size than `radiance`".into()));
            }
            let found = layer.channel_data.list.iter().find(|c| c.name.eq(channel));
            let found = found.ok_or_else(|| wrong(name, format!("there is no channel {channel}")))?;
            Ok(found.sample_data.values_as_f32().collect::<Vec<f32>>())
        };
        let rgb = |layer, name: &str| -> Result<Vec<[f32; 3]>> {
            let [r, g, b] = ["R", "G", "B"].map(|c| read(layer, name, c));
            Ok(r?.into_iter().zip(g?).zip(b?).map(|((r, g), b)| [r, g, b]).collect())
        };
        let fractions = {
            let layer = require("fractions")?;
            let parts: Result<Vec<Vec<f32>>> =
                super::FRACTIONS.iter().map(|name| read(layer, "fractions", name)).collect();
            let parts = parts?;
            (0..parts[0].len()).map(|k| [0, 1, 2, 3].map(|p| parts[p][k])).collect()
        };
        Ok(Layers {
            size: [first.size.x() as u32, first.size.y() as u32],
            radiance: rgb(first, "radiance")?,
            depth: read(require("depth")?, "depth", "Z")?,
            fractions,
            variance: find("variance").map(|layer| rgb(layer, "variance")).transpose()?,
        })
    }
}

fn is_named(layer: &Layer<AnyChannels<FlatSamples>>, name: &str) -> bool {
    layer.attributes.layer_name.as_ref().is_some_and(|n| n.eq(name))
}

#[cfg(test)]
mod tests {
    use exr::prelude::{
        AnyChannel, Encoding, Image, ImageAttributes, IntegerBounds, LayerAttributes, Vec2, WritableImage,
    };

    use super::*;
    use crate::image::{Linear, Noise};

    #[test]
    fn what_a_picture_writes_is_read_again() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let value = |k: usize| k as f32 * 0.25;
        let linear = Linear {
            sun: (0..6).map(|k| [value(k), 1.0, 2.0]).collect(),
            sky: (0..6).map(|k| [0.5, value(k), 0.125]).collect(),
            depth: (0..6).map(value).collect(),
            coverage: vec![0.0; 6],
            species: vec![0; 6],
            fractions: (0..6).map(|k| [0.0, 0.25, 0.5, value(k)]).collect(),
            noise: Some(Noise { variance: (0..6).map(|k| [value(k); 3]).collect(), samples: vec![4; 6] }),
        };
        let picture = Picture { size: [3, 2], display: vec![0; 24], linear: Some(linear) };
        picture.write_exr(&path).unwrap();
        assert_eq!(Layers::read(&path).unwrap(), Layers::of(&picture).unwrap());
    }

    #[test]
    fn squares_of_pixels_have_their_means() {
        let each = |of: fn(usize) -> f32| (0..6).map(|k| [of(k); 3]).collect::<Vec<_>>();
        let image = Layers {
            size: [3, 2],
            radiance: each(|k| k as f32),
            depth: vec![2.0, 0.0, 3.0, 4.0, 0.0, 0.0],
            fractions: (0..6).map(|k| [k as f32, 0.0, 0.0, 1.0]).collect(),
            variance: Some(each(|k| 1.0 + k as f32)),
        };
        let half = image.averaged(2);
        // Pixels 0, 1, 3, 4, and what is left of the square at the edge: 2 and 5.
        assert_eq!((half.size, half.radiance), ([2, 1], vec![[2.0; 3], [3.5; 3]]));
        assert_eq!(
            (half.depth, half.fractions),
            (vec![3.0, 3.0], vec![[2.0, 0.0, 0.0, 1.0], [3.5, 0.0, 0.0, 1.0]])
        );
        assert_eq!(half.variance.unwrap(), [[3.0 / 4.0; 3], [4.5 / 2.0; 3]]);
        assert_eq!(image.averaged(1), image);
    }

    /// Writes layers of floats as `(name, [(channel, value)])`.
    fn write(path: &Path, size: (usize, usize), layers: &[(&str, &[(&str, f32)])]) {
        let layers: Vec<_> = layers
            .iter()
            .map(|(name, channels)| {
                let samples = |v: f32| FlatSamples::F32(vec![v; size.0 * size.1]);
                let channels = channels.iter().map(|(c, v)| AnyChannel::new(*c, samples(*v))).collect();
                let attributes = LayerAttributes::named(*name);
                Layer::new(
                    Vec2(size.0, size.1),
                    attributes,
                    Encoding::UNCOMPRESSED,
                    AnyChannels::sort(channels),
                )
            })
            .collect();
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
        Image::from_layers(attributes, layers).write().to_file(path).unwrap();
    }

    #[test]
    fn variance_is_read_and_a_missing_layer_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.exr");
        let rgb: &[_] = &[("R", 1.0), ("G", 2.0), ("B", 3.0)];
        let parts: Vec<_> = crate::image::FRACTIONS.iter().map(|n| (*n, 0.25)).collect();
        let all = [("radiance", rgb), ("depth", &[("Z", 9.0)]), ("fractions", &parts), ("variance", rgb)];
        write(&path, (5, 4), &all);
        let layers = Layers::read(&path).unwrap();
        assert_eq!((layers.size, layers.variance), ([5, 4], Some(vec![[1.0, 2.0, 3.0]; 20])));
        for k in 0..3 {
            let mut some = all.to_vec();
            let (name, _) = some.remove(k);
            write(&path, (5, 4), &some);
            let error = Layers::read(&path).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("no such layer"), "{error}");
        }
        std::fs::write(&path, b"no image").unwrap();
        assert!(Layers::read(&path).unwrap_err().to_string().contains("not a linear image"));
    }
}
