//! Sample masks on the device: the functions, and the law that they are for.

use crate::device::{self, Arguments, Function, evaluate};
use canopy::gpu::{
    Attachment, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Resource, Targets, shaders, vk,
};
use canopy::physics::masks;

#[test]
fn numbers_of_samples_are_those_of_the_oracle() {
    let gpu = device::open();
    let mut cases = Vec::new();
    for samples in [1u32, 4, 8] {
        for a in [-1.0f32, 0.0, 1e-30, 1e-3, 0.125, 0.25, 0.3, 0.5, 0.75, 0.999_999, 1.0, 1.5, 1e9] {
            for d in [0.0f32, 1e-7, 0.1, 0.25, 0.5, 0.75, 0.9, 0.999_999_94] {
                cases.push((a, d, samples));
            }
        }
    }
    let arguments: Vec<Arguments> =
        cases.iter().map(|(a, d, s)| [a.to_bits(), d.to_bits(), *s, 0, 0, 0, 0, 0, 0, 0, 0, 0]).collect();
    for ((a, d, s), out) in cases.iter().zip(evaluate(&gpu, Function::CoveredSamples, &arguments)) {
        // Powers of two scale exactly, so only the sum rounds, and both round it alike.
        assert_eq!(out[0], masks::covered_samples(*a, *d, *s), "{a} {d} {s}");
    }
    gpu.close().unwrap();
}

#[test]
fn columns_are_those_of_the_oracle() {
    let gpu = device::open();
    for samples in [1u32, 4, 8] {
        let table = masks::combination_table(samples);
        let cases: Vec<(masks::Row, u32)> =
            table.iter().flat_map(|row| (0..=samples).map(|k| (*row, k))).collect();
        let arguments: Vec<Arguments> =
            cases.iter().map(|(row, k)| [row[0], row[1], row[2], 0, *k, samples, 0, 0, 0, 0, 0, 0]).collect();
        for ((row, k), out) in cases.iter().zip(evaluate(&gpu, Function::MaskColumn, &arguments)) {
            assert_eq!(out[0], masks::mask_column(row, *k, samples), "{row:x?} column {k} of {samples}");
            assert_eq!(out[0].count_ones(), *k);
        }
    }
    gpu.close().unwrap();
}

const SIDE: u32 = 128;

/// Share of the samples of a picture that trees cover: `n` in each pixel, other ones in each.
fn covered(
    gpu: &Gpu,
    targets: &(Option<Image>, Image),
    program: &canopy::gpu::Program,
    rows: &canopy::gpu::Buffer,
    alpha: f32,
    n: u32,
) -> f64 {
    let attachment = match &targets.0 {
        Some(image) => Attachment { image, resolve: Some(&targets.1), clear: Some([0.0; 4]) },
        None => Attachment { image: &targets.1, resolve: None, clear: Some([0.0; 4]) },
    };
    let mut recorder = gpu.record().unwrap();
    recorder.render("masks", &Targets { colors: &[attachment], depth: None, layers: 1 }, |pass| {
        pass.bind(program, &[("masks", Resource::Buffer(rows))]);
        pass.push(&[alpha.to_bits(), 1000 * n + (alpha * 100.0) as u32]);
        pass.draw(3, n);
    });
    recorder.submit().unwrap();
    let texels: Vec<[u16; 4]> = gpu.read_image(&targets.1, 0, 0).unwrap();
    let sum: f64 = texels.iter().map(|t| half::f16::from_bits(t[0]).to_f64()).sum();
    sum / f64::from(SIDE * SIDE)
}

#[test]
fn n_trees_of_opacity_alpha_cover_one_minus_one_minus_alpha_to_the_n() {
    let gpu = device::open();
    let mut tested = 0;
    for samples in [1u32, 4, 8] {
        if gpu.info().sample_counts & samples == 0 {
            println!("{samples} samples: not on this device");
            continue;
        }
        let image = |samples| {
            gpu.image(&ImageDesc {
                name: "covered",
                format: vk::Format::R16G16B16A16_SFLOAT,
                size: [SIDE; 2],
                layers: 1,
                levels: 1,
                samples,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
            })
            .unwrap()
        };
        let targets = ((samples > 1).then(|| image(samples)), image(1));
        let table = masks::combination_table(samples);
        let rows = gpu.buffer_with("masks", &table).unwrap();
        let program = gpu
            .graphics(&GraphicsDesc {
                vert: &shaders::PROBE_MASKS_VERT,
                frag: &shaders::PROBE_MASKS_FRAG,
                colors: &[vk::Format::R16G16B16A16_SFLOAT],
                samples,
                depth: DepthTest::None,
                constants: &[(2, table.len() as u32), (3, samples)],
            })
            .unwrap();
        let (mut worst, mut bias, mut cases) = (0.0f64, 0.0, 0.0);
        for n in 1..=8 {
            for step in 0..=10 {
                let alpha = step as f32 / 10.0;
                let want = 1.0 - (1.0 - f64::from(alpha)).powi(n);
                let got = covered(&gpu, &targets, &program, &rows, alpha, n as u32);
                // 0.02 is what is asked for. The mean of 16384 pixels has a standard error of at most 0.5 / 128 = 0.004
                // (one sample a pixel), so that it is five of them as well.
                assert!((got - want).abs() < 0.02, "{samples} samples, {n} trees of {alpha}: {got} {want}");
                if step == 0 || step == 10 {
                    assert_eq!(got, want, "nothing and everything are exact");
                }
                worst = worst.max((got - want).abs());
                bias += got - want;
                cases += 1.0;
            }
        }
        println!("{samples} samples: worst {worst:.4}, bias {:.5}", bias / cases);
        // The mean of 88 such means: five times 0.004 / sqrt(88).
        assert!((bias / cases).abs() < 0.0022, "bias {} at {samples} samples", bias / cases);
        tested += 1;
    }
    assert!(tested >= 2, "1 and 4 samples are required of every device");
    gpu.close().unwrap();
}
