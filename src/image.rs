//! Images out: PNG for eyes, linear EXR with named layers for measurements. Written aside, then renamed.

mod layers;

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes, WritableImage,
};

use crate::files::write_whole;
use crate::{Error, Result};
pub use layers::Layers;

/// Channels of the layer `fractions`, in the order of [`Linear::fractions`].
const FRACTIONS: [&str; 4] = ["lit_ground", "shadowed_ground", "lit_tree", "shadowed_tree"];

/// One frame, on the host.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels.
    pub size: [u32; 2],
    /// Display picture: sRGB, RGBA, row 0 at the top.
    pub display: Vec<u8>,
    /// The linear image, if the plan had layers.
    pub linear: Option<Linear>,
}

/// The linear image, row 0 at the top. Radiance is the sum of its two parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Radiance from the sun, RGB, in the scene's units.
    pub sun: Vec<[f32; 3]>,
    /// Radiance from the sky, RGB; the background is all sky.
    pub sky: Vec<[f32; 3]>,
    /// Distance along the view axis, m; 0 where nothing is.
    pub depth: Vec<f32>,
    /// Fraction of the pixel's samples that show trees.
    pub coverage: Vec<f32>,
    /// Species at the pixel's first sample, counted from 1; 0 where no tree is drawn by itself.
    pub species: Vec<u32>,
    /// The four fractions k of BN12: lit ground, shadowed ground, lit trees, shadowed trees; their sum is the share of
    /// the pixel that is not background.
    pub fractions: Vec<[f32; 4]>,
    /// How sure the radiance is, if it was estimated by random samples.
    pub noise: Option<Noise>,
}

/// How sure an image is that was estimated by random samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Variance of the mean radiance, RGB, in squared units of radiance.
    pub variance: Vec<[f32; 3]>,
    /// Samples.
    pub samples: Vec<u32>,
}

impl Linear {
    /// Radiance, RGB: the sum of both parts.
    pub fn radiance(&self) -> Vec<[f32; 3]> {
        self.sun.iter().zip(&self.sky).map(|(a, b)| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]).collect()
    }
}

impl Picture {
    /// The display picture without alpha.
    pub fn rgb(&self) -> Vec<u8> {
        self.display.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// A hash of every bit.
    pub fn digest(&self) -> String {
        let mut h = blake3::Hasher::new();
        h.update(&self.display);
        if let Some(l) = &self.linear {
            h.update(bytemuck::cast_slice(&l.sun)).update(bytemuck::cast_slice(&l.sky));
            h.update(bytemuck::cast_slice(&l.depth)).update(bytemuck::cast_slice(&l.coverage));
            h.update(bytemuck::cast_slice(&l.species)).update(bytemuck::cast_slice(&l.fractions));
            if let Some(noise) = &l.noise {
                h.update(bytemuck::cast_slice(&noise.variance)).update(bytemuck::cast_slice(&noise.samples));
            }
        }
        h.finalize().to_hex().to_string()
    }

    /// Writes the display picture as PNG.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_png(&self, path: &Path) -> Result<()> {
        write_png(path, &self.rgb(), self.size)
    }

    /// Writes the linear image as EXR: layers `radiance`, `sun`, `sky` (R, G, B), `depth` (Z), `trees` (coverage),
    /// `species` (id) and `fractions` (lit_ground, shadowed_ground, lit_tree, shadowed_tree); of an estimate also `variance` (R,
    /// G, B) of the mean radiance, and `samples` (n).
    ///
    /// # Errors
    /// [`Error::Usage`] if the plan had no layers; [`Error::Io`].
    pub fn write_exr(&self, path: &Path) -> Result<()> {
        let Some(l) = &self.linear else {
            return Err(Error::Usage("an EXR needs a plan with layers".into()));
        };
        let size = (self.size[0] as usize, self.size[1] as usize);
        let layer = |name: &str, channels: Vec<(&str, FlatSamples)>| {
            let channels: Vec<_> =
                channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
            Layer::new(
                size,
                LayerAttributes::named(name),
                Encoding::SMALL_LOSSLESS,
                AnyChannels::sort(channels.into()),
            )
        };
        let rgb = |name: &str, data: &[[f32; 3]]| {
            let channel = |k: usize| FlatSamples::F32(data.iter().map(|p| p[k]).collect());
            layer(name, vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))])
        };
        let mut layers = vec![
            rgb("radiance", &l.radiance()),
            rgb("sun", &l.sun),
            rgb("sky", &l.sky),
            layer("depth", vec![("Z", FlatSamples::F32(l.depth.clone()))]),
            layer("trees", vec![("coverage", FlatSamples::F32(l.coverage.clone()))]),
            layer("species", vec![("id", FlatSamples::U32(l.species.clone()))]),
            layer(
                "fractions",
                FRACTIONS
                    .iter()
                    .enumerate()
                    .map(|(k, name)| (*name, FlatSamples::F32(l.fractions.iter().map(|f| f[k]).collect())))
                    .collect(),
            ),
        ];
        if let Some(noise) = &l.noise {
            layers.push(rgb("variance", &noise.variance));
            layers.push(layer("samples", vec![("n", FlatSamples::U32(noise.samples.clone()))]));
        }
        let attributes =
            exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions(size));
        let image = ExrImage::from_layers(attributes, layers);
        let mut bytes = std::io::Cursor::new(Vec::new());
        // One thread: blocks then stand in the same order in every file.
        image
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .map_err(|e| Error::io(path, std::io::Error::other(e)))?;
        write_whole(path, bytes.get_ref())
    }
}

/// Writes an 8-bit RGB image as PNG.
///
/// # Errors
/// [`Error::Io`].
pub fn write_png(path: &Path, rgb: &[u8], size: [u32; 2]) -> Result<()> {
    let bytes = png(rgb, size).map_err(|e| Error::io(path, std::io::Error::other(e)))?;
    write_whole(path, &bytes)
}

/// An RGB image as PNG.
pub(crate) fn png(rgb: &[u8], [width, height]: [u32; 2]) -> image::ImageResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(encoder, rgb, width, height, image::ExtendedColorType::Rgb8)?;
    Ok(bytes)
}
