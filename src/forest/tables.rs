//! Forest tables on the GPU (BN12, section 6): all species' pair tables in one volume, their view and ground tables in one
//! texture array.

use half::f16;

use crate::gpu::{Gpu, Image, ImageDesc, VolumeDesc};
use crate::physics::tables::ForestTables;
use crate::plan::names::resource;
use crate::{Error, Result};

/// The tables of every species.
pub struct TableData {
    /// (W, T of leaves, T of bark, M): azimuth, light zenith, then view zenith within density within species.
    pub pairs: Image,
    /// (V, E of leaves, E of bark, coverage at visible ground) by view zenith and density, and beside them (D_v, C, s, D); a layer a
    /// species.
    pub views: Image,
    /// Nodes of each angle.
    pub angles: u32,
    /// Nodes of the density.
    pub densities: u32,
}

impl TableData {
    /// Uploads the tables of every species, as described; all must have the same numbers of nodes. Without pair tables, which are
    /// most of the bytes, two texels stand for what nobody reads.
    ///
    /// # Errors
    /// [`Error::Usage`] when they differ from the description or among themselves; [`Error::Device`] when out of memory.
    pub fn new(
        gpu: &Gpu,
        (pairs, views): (Option<VolumeDesc>, &ImageDesc),
        tables: &[&ForestTables],
    ) -> Result<Self> {
        let (n, m) = tables.first().map_or((1, 1), |t| (t.angles, t.densities));
        let fits = views.size == [2 * n, m] && views.layers as usize == tables.len();
        if !fits || tables.iter().any(|t| (t.angles, t.densities) != (n, m)) {
            return Err(Error::Usage("tables of species differ in their numbers of nodes".into()));
        }
        let listed = pairs.is_some();
        // At least two slices, or it would not be a volume.
        let none = VolumeDesc { name: resource::PAIR_TABLES, format: views.format, size: [1, 1, 2] };
        let VolumeDesc { name, format, size } = pairs.unwrap_or(none);
        let pairs = gpu.volume(name, format, size)?;
        let half = |v: f32| f16::from_f32(v).to_bits();
        let mut texels: Vec<u16> = tables
            .iter()
            .filter(|_| listed)
            .flat_map(|t| &t.pair)
            .flat_map(|values| values.map(half))
            .collect();
        texels.resize(4 * size.iter().product::<u32>() as usize, 0);
        gpu.upload_image(&pairs, 0, 0, 1, bytemuck::cast_slice(&texels))?;
        let count = views.layers;
        let views = gpu.image(views)?;
        let mut texels = Vec::new();
        for t in tables {
            let n = n as usize;
            let skies = t.seen_sky.chunks_exact(n).zip(t.near_sky.chunks_exact(n));
            for ((row, (seen, near)), [sky, c]) in t.view.chunks_exact(n).zip(skies).zip(&t.ground) {
                texels.extend(row.iter().flatten().map(|v| half(*v)));
                texels.extend(seen.iter().zip(near).flat_map(|(d, s)| [d, c, s, sky].map(|v| half(*v))));
            }
        }
        gpu.upload_image(&views, 0, 0, count, bytemuck::cast_slice(&texels))?;
        Ok(TableData { pairs, views, angles: n, densities: m })
    }
}
