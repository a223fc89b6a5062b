//! What must hold of a frame on any driver, and the same bits again.

use std::process::Command;
use std::sync::Arc;

use super::scenes::{self, RASTERIZERS, SIZE, SceneCase};
use super::{Finding, Options, finding};
use crate::bake::{Baked, load_or_bake_scene};
use crate::camera::{Eye, auto_exposure};
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::image::Picture;
use crate::plan::{Plan, Rasterizer, ViewMode};
use crate::scene::{Camera, Scene};
use crate::{Error, Result};

/// A renderer of a scene of the suite, with its camera and exposure.
fn renderer(
    gpu: &Gpu,
    options: &Options,
    case: &SceneCase,
    rasterizer: Rasterizer,
    layers: bool,
) -> Result<(Renderer, Camera, f64)> {
    planned(gpu, options, case, rasterizer, layers, |plan| plan.view_mode = case.mode)
}

/// The same, with a plan that something of is changed in.
fn planned(
    gpu: &Gpu,
    options: &Options,
    case: &SceneCase,
    rasterizer: Rasterizer,
    layers: bool,
    change: impl FnOnce(&mut Plan),
) -> Result<(Renderer, Camera, f64)> {
    let (scene, camera) = case.load()?;
    let eye = Eye::new(&camera, &scene.terrain, SIZE);
    let mut plan = Plan::for_eye(&scene, &eye, layers, rasterizer, Some(gpu.info()))?;
    change(&mut plan);
    plan.list(&scene);
    let exposure = auto_exposure(&scene);
    let baked = bakes(&scene, &plan, options)?;
    Ok((Renderer::new(gpu, Arc::new(scene), plan, &baked)?, camera, exposure))
}

fn bakes(scene: &Scene, plan: &Plan, options: &Options) -> Result<Vec<Baked>> {
    let baked = load_or_bake_scene(scene, plan, options.cache.as_deref(), true)?;
    Ok(baked.into_iter().map(|(b, _)| b).collect())
}

/// Draws a scene of the suite; the second frame, with everything in the caches, must be the same.
pub(super) fn draw(
    gpu: &Gpu,
    options: &Options,
    case: &SceneCase,
    rasterizer: Rasterizer,
    layers: bool,
) -> Result<Picture> {
    let (mut renderer, camera, exposure) =
        renderer(gpu, options, case, rasterizer, layers && case.mode == ViewMode::Radiance)?;
    renderer.render(&camera, exposure)?;
    let first = renderer.picture()?;
    renderer.render(&camera, exposure)?;
    if renderer.picture()? != first {
        let by = rasterizer.name();
        return Err(Error::Check(format!("{}, {by}: a second frame differs from the first", case.name)));
    }
    Ok(first)
}

/// What must hold of a frame, by each rasteriser.
pub(super) fn check(gpu: &Gpu, options: &Options, case: &SceneCase) -> Result<Finding> {
    let (mut problems, mut measured) = (Vec::new(), Vec::new());
    for rasterizer in case.rasterizers().iter().copied() {
        let picture = draw(gpu, options, case, rasterizer, true)?;
        let (wrong, found) = laws(case, &picture)?;
        problems.extend(wrong.into_iter().map(|p| format!("{}: {p}", rasterizer.name())));
        measured.push(format!("{}: {found}", rasterizer.name()));
    }
    Ok(finding(&problems, measured.join("; ")))
}

/// Numbers that are numbers, fractions that sum to what is not background, and no more light than there is: what does not hold,
/// and what was measured.
fn laws(case: &SceneCase, picture: &Picture) -> Result<(Vec<String>, String)> {
    let Some(l) = &picture.linear else {
        return Err(Error::Usage(format!("{}: a view mode has no linear image", case.name)));
    };
    let (scene, _) = case.load()?;
    let mut problems = Vec::new();
    let numbers = l.sun.iter().chain(&l.sky).flatten().chain(&l.depth).chain(&l.coverage);
    let wrong =
        numbers.chain(l.fractions.iter().flatten()).filter(|v| !(v.is_finite() && **v >= 0.0)).count();
    if wrong > 0 {
        problems.push(format!("{wrong} values are not numbers, or negative"));
    }
    // Half floats of a mean of up to eight samples: 2^-11 each, of four fractions.
    let room = 4.0 / 2048.0;
    let sum = |k: usize| l.fractions[k].iter().sum::<f32>();
    let off = (0..l.fractions.len()).map(|k| sum(k) - 1.0).fold(0.0, f32::max);
    if off > room {
        problems.push(format!("fractions sum to 1 + {off}"));
    }
    // A pixel between leaves has background too, so only pictures without any sky say more.
    let closed = l.depth.iter().all(|d| *d > 0.0);
    let short = (0..l.fractions.len()).filter(|_| closed).map(|k| 1.0 - sum(k)).fold(0.0, f32::max);
    if short > room {
        problems.push(format!("fractions sum to 1 - {short}"));
    }
    // No leaf or ground sends back more than the sun's irradiance with albedo 1 would, with the hotspot's 1 + a1 on top; and of the
    // uniform sky no more than the sky itself.
    let sun = (1.0 + scene.settings.hotspot_amplitude)
        * scene.sun.irradiance.iter().fold(0.0f32, |a, b| a.max(*b))
        / std::f32::consts::PI;
    let brightest = |of: &[[f32; 3]]| of.iter().flatten().fold(0.0f32, |a, b| a.max(*b));
    if brightest(&l.sun) > sun {
        problems.push(format!("sunlit radiance {} of at most {sun}", brightest(&l.sun)));
    }
    let sky = case.sky as f32 * 1.002;
    if brightest(&l.sky) > sky {
        problems.push(format!("skylit radiance {} of at most {sky}", brightest(&l.sky)));
    }
    let trees = l.fractions.iter().map(|k| f64::from(k[2] + k[3])).sum::<f64>() / l.fractions.len() as f64;
    if trees < 0.02 {
        problems.push(format!("trees are only {trees:.4} of the picture"));
    }
    let measured = format!("trees {trees:.3} of the picture, fractions within {:.1e} of 1", off.max(short));
    Ok((problems, measured))
}

/// The scene of determinism: every pass is in it.
const DETERMINISM: &str = "hills";

/// Another renderer draws the same bits.
pub(super) fn again(gpu: &Gpu, options: &Options) -> Result<Finding> {
    let [a, b] = [digests(gpu, options, DETERMINISM)?, digests(gpu, options, DETERMINISM)?];
    let problem = (a != b).then(|| format!("two renderers draw other bits: {}, {}", short(&a), short(&b)));
    Ok(finding(problem.as_slice(), short(&a)))
}

/// Scenes in which many trees hide others, near and far, and one seen from above.
const HIDING: [&str; 3] = ["grove", "hills", "above"];

/// Tiles that pass over what is hidden or off its outline draw the bits of tiles that look at every pixel of every box.
pub(super) fn shortcuts(gpu: &Gpu, options: &Options) -> Result<Finding> {
    let (mut problems, mut compared) = (Vec::new(), 0);
    for scene in HIDING {
        let case = scenes::find(scene)?;
        let picture = |taken: bool| -> Result<Picture> {
            let change = |plan: &mut Plan| plan.tile_shortcuts = taken;
            let (mut renderer, camera, exposure) =
                planned(gpu, options, case, Rasterizer::Tiles, true, change)?;
            renderer.render(&camera, exposure)?;
            renderer.picture()
        };
        let (with, without) = (picture(true)?, picture(false)?);
        compared += with.display.len() / 4;
        if with != without {
            let differ =
                with.display.chunks(4).zip(without.display.chunks(4)).filter(|(a, b)| a != b).count();
            problems.push(format!(
                "{scene}: {differ} pixels shown are others where tiles look at all of every tree"
            ));
        }
    }
    Ok(finding(&problems, format!("{compared} pixels the same where tiles look at all of every tree")))
}

/// The bits of a scene's frame by each rasteriser, as hashes.
pub(super) fn digests(gpu: &Gpu, options: &Options, scene: &str) -> Result<[String; 2]> {
    let case = scenes::find(scene)?;
    let [graphics, tiles] = RASTERIZERS.map(|r| draw(gpu, options, case, r, true).map(|p| p.digest()));
    Ok([graphics?, tiles?])
}

/// The beginnings of hashes, for reports.
fn short(digests: &[String; 2]) -> String {
    digests.each_ref().map(|d| &d[..16]).join(" ")
}

/// After a flight elsewhere, with tiles thrown out and made again, the first view is the same bits as before: no tile in the
/// caches is stale.
pub(super) fn return_flight(gpu: &Gpu, options: &Options) -> Result<Finding> {
    let (mut problems, mut made) = (Vec::new(), 0);
    for rasterizer in RASTERIZERS {
        let (same, produced) = returns(gpu, options, rasterizer)?;
        if !same {
            problems.push(format!("{}: after a flight the first view has other bits", rasterizer.name()));
        }
        if produced == 0 {
            problems.push("the flight made no tile: it proves nothing".into());
        }
        made += produced;
    }
    Ok(finding(&problems, format!("{made} coverage tiles made on the way")))
}

/// Whether the first view has the same bits after a flight, and how many coverage tiles that made.
fn returns(gpu: &Gpu, options: &Options, rasterizer: Rasterizer) -> Result<(bool, u32)> {
    let case = scenes::find(DETERMINISM)?;
    let (mut renderer, camera, exposure) = renderer(gpu, options, case, rasterizer, true)?;
    renderer.render(&camera, exposure)?;
    let before = renderer.picture()?;
    let mut made = 0;
    for k in 0..12 {
        let t = 0.5 * f64::from(k);
        let mut there = camera.clone();
        there.position =
            [4000.0 + 2600.0 * t.cos(), 4000.0 + 2600.0 * t.sin(), 40.0 + 60.0 * f64::from(k % 3)];
        there.target = [4000.0 - 900.0 * t.sin(), 4000.0 + 900.0 * t.cos(), 0.0];
        made += renderer.render(&there, exposure)?.produced.coverage;
    }
    renderer.render(&camera, exposure)?;
    Ok((renderer.picture()? == before, made))
}

/// A process with another number of driver threads draws the same bits as this one.
pub(super) fn threads(gpu: &Gpu, options: &Options, threads: &str) -> Result<Finding> {
    let digests = digests(gpu, options, DETERMINISM)?;
    let here = digests.join(" ");
    let mut command = Command::new(&options.program);
    command.args(["conform", "--digest", DETERMINISM]).env("LP_NUM_THREADS", threads);
    if let Some(device) = &options.device {
        command.args(["--device", device]);
    }
    if let Some(cache) = &options.cache {
        command.env("CANOPY_CACHE", cache);
    }
    let output = command.output().map_err(|e| Error::io(&options.program, e))?;
    let there = String::from_utf8_lossy(&output.stdout).trim().to_string();
    let problem = if !output.status.success() {
        Some(format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim()))
    } else {
        (there != here).then(|| format!("LP_NUM_THREADS={threads} draws other bits: {there}, here {here}"))
    };
    Ok(finding(problem.as_slice(), short(&digests)))
}
