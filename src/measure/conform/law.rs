//! The law that sample masks are for: n trees of opacity α, one before the other, cover 1 − (1 − α)ⁿ of the samples.

use super::{Finding, finding};
use crate::Result;
use crate::gpu::{
    Attachment, Buffer, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Layers, Program, Resource, Targets,
    shaders, vk,
};
use crate::physics::masks::combination_table;

/// Pixels along a side: their mean has a standard error of at most 0.5 / 128 = 0.004.
const SIDE: u32 = 128;

/// Measures the law for 1 to 8 trees of opacities 0 to 1, at every number of samples that the device has.
pub fn coverage(gpu: &Gpu) -> Result<Finding> {
    let (mut problems, mut measured) = (Vec::new(), Vec::new());
    for samples in [1u32, 4, 8].into_iter().filter(|s| gpu.info().sample_counts & s != 0) {
        let target = Target::new(gpu, samples)?;
        let (mut worst, mut bias, mut cases) = (0.0f64, 0.0, 0.0);
        for n in 1..=8u32 {
            for step in 0..=10u32 {
                let alpha = step as f32 / 10.0;
                let want = 1.0 - (1.0 - f64::from(alpha)).powi(n as i32);
                let error = target.covered(gpu, alpha, n)? - want;
                if error != 0.0 && (step == 0 || step == 10) {
                    problems.push(format!("{samples} samples: {n} trees of {alpha} are not exact"));
                }
                worst = worst.max(error.abs());
                bias += error;
                cases += 1.0;
            }
        }
        // Five standard errors: of a mean of 16384 pixels, and of the mean of 88 such means.
        if worst >= 0.02 {
            problems.push(format!("{samples} samples: off by {worst:.4}"));
        }
        if (bias / cases).abs() >= 0.0022 {
            problems.push(format!("{samples} samples: biased by {:.5}", bias / cases));
        }
        measured.push(format!("{samples} samples: worst {worst:.4}, bias {:.5}", bias / cases));
    }
    if measured.len() < 2 {
        problems.push("1 and 4 samples are required of every device".into());
    }
    Ok(finding(&problems, measured.join("; ")))
}

/// What the trees are drawn to, and with.
struct Target {
    multi: Option<Image>,
    single: Image,
    rows: Buffer,
    program: Program,
}

impl Target {
    fn new(gpu: &Gpu, samples: u32) -> Result<Self> {
        let format = vk::Format::R16G16B16A16_SFLOAT;
        let image = |samples| {
            gpu.image(&ImageDesc {
                name: "covered",
                format,
                size: [SIDE; 2],
                layers: 1,
                levels: 1,
                samples,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
            })
        };
        let table = combination_table(samples);
        Ok(Target {
            multi: if samples > 1 { Some(image(samples)?) } else { None },
            single: image(1)?,
            rows: gpu.buffer_with("masks", &table)?,
            program: gpu.graphics(&GraphicsDesc {
                vert: &shaders::PROBE_MASKS_VERT,
                frag: &shaders::PROBE_MASKS_FRAG,
                colors: &[format],
                samples,
                depth: DepthTest::None,
                constants: &[("MASK_ROWS", table.len() as u32), ("SAMPLES", samples)],
            })?,
        })
    }

    /// Share of the samples of a picture that trees cover: `n` in each pixel, other ones in each.
    fn covered(&self, gpu: &Gpu, alpha: f32, n: u32) -> Result<f64> {
        let attachment = match &self.multi {
            Some(image) => Attachment { image, resolve: Some(&self.single), clear: Some([0.0; 4]) },
            None => Attachment { image: &self.single, resolve: None, clear: Some([0.0; 4]) },
        };
        let mut recorder = gpu.record()?;
        recorder.render(
            "masks",
            &Targets { colors: &[attachment], depth: None, layers: Layers::One(0) },
            |pass| {
                pass.bind(&self.program, &[("masks", Resource::Buffer(&self.rows))]);
                pass.push(&[alpha.to_bits(), 1000 * n + (alpha * 100.0) as u32]);
                pass.draw(3, n);
            },
        );
        recorder.submit()?;
        let texels: Vec<[u16; 4]> = gpu.read_image(&self.single, 0, 0)?;
        let sum: f64 = texels.iter().map(|t| half::f16::from_bits(t[0]).to_f64()).sum();
        Ok(sum / f64::from(SIDE * SIDE))
    }
}
