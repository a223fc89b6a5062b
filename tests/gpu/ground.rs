//! Height and slope of the ground on the device.

use crate::device::{self, Worst, dispatch};
use canopy::gpu::{ImageDesc, Resource, Sampler, shaders, vk};
use canopy::physics::raster::Raster;
use canopy::physics::terrain::height_and_slope;

#[test]
fn heights_and_slopes_are_those_of_the_oracle() {
    let gpu = device::open();
    for (width, height, scale) in [(33u32, 21u32, 500.0f64), (2, 2, 1e4), (1, 1, -300.0), (7, 1, 1.0)] {
        let samples: Vec<f32> = (0..width * height)
            .map(|k| {
                (scale * (1.0 + (f64::from(k % width) * 1.3).sin() * (f64::from(k / width) * 0.7).cos()))
                    as f32
            })
            .collect();
        let raster = Raster { width, height, samples };
        let image = gpu
            .image(&ImageDesc {
                name: "heights",
                format: vk::Format::R32_SFLOAT,
                size: [width, height],
                layers: 1,
                levels: 1,
                samples: 1,
                usage: vk::ImageUsageFlags::empty(),
            })
            .unwrap();
        gpu.upload_image(&image, 0, 0, 1, bytemuck::cast_slice(&raster.samples)).unwrap();
        // Inside, on samples exactly, outside on every side, and with fractions of more than a cell.
        let mut positions: Vec<([i32; 2], [f32; 2])> = Vec::new();
        for y in -3..height as i32 + 3 {
            for x in -3..width as i32 + 3 {
                for f in [[0.0, 0.0], [0.25, 0.8], [0.999_999, 0.5], [0.5, 1.0], [3.7, -2.6], [-0.1, 0.3]] {
                    positions.push(([x, y], f));
                }
            }
        }
        positions.push(([1 << 20, -(1 << 20)], [0.5, 0.5]));
        let words: Vec<[u32; 4]> = positions
            .iter()
            .map(|(c, f)| [c[0] as u32, c[1] as u32, f[0].to_bits(), f[1].to_bits()])
            .collect();
        let buffer = gpu.buffer_with("positions", &words).unwrap();
        let resources = [
            ("positions", Resource::Buffer(&buffer)),
            ("heights", Resource::Texture(&image, Sampler::Nearest)),
        ];
        let found: Vec<[f32; 4]> =
            dispatch(&gpu, &shaders::PROBE_GROUND_COMP, &[], &resources, positions.len(), &[]);
        let mut worst = Worst::default();
        for ((c, f), got) in positions.iter().zip(&found) {
            let at = [0, 1].map(|k| f64::from(c[k]) + f64::from(f[k]));
            let want = height_and_slope(&raster, at[0], at[1]);
            for k in 0..3 {
                worst.note((f64::from(got[k]) - want[k]).abs(), || {
                    format!("{c:?} + {f:?} [{k}]: {got:?} {want:?}")
                });
            }
        }
        // Sixteen products of heights up to 2 scale with weights whose moduli sum to at most 1.25 (derivatives: 2.5) a
        // direction; the cubic's own roundings are a few ulp of weights up to 2. And the fraction loses what its floor
        // takes: 4 ulp of 1 at a fraction of 3.7, times a slope of 2.5 * 1.25 * 2 scale.
        worst.within(64.0 * 6e-8 * 2.0 * scale.abs(), "height and slope");
    }
    gpu.close().unwrap();
}
