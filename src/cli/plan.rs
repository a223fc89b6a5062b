//! `canopy plan`.

use canopy::camera::Eye;
use canopy::gpu::DeviceInfo;
use canopy::plan::Plan;
use canopy::settings::Settings;
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::{LadderOptions, PrintOptions, RasterizerOptions, SceneOptions, knobs_help};
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy plan                               what the built-in scene takes
  canopy plan my.toml --quality accurate    the same, for yours, at another preset
  canopy plan --ladder shader-map           what it takes without any tree drawn by itself
  canopy plan --layers --size 3840x2160     with what an EXR needs, in 4K
Without a Vulkan device the plan is made for common limits, and says so.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", knobs_help()))]
pub struct Args {
    #[command(flatten)]
    scene: SceneOptions,
    /// Plan for an EXR too: layers apart
    #[arg(long)]
    layers: bool,
    #[command(flatten)]
    ladder: LadderOptions,
    #[command(flatten)]
    rasterizer: RasterizerOptions,
    /// Device by UUID or part of its name; left out: the best that fits
    #[arg(long, value_name = "UUID|NAME")]
    device: Option<String>,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    scene: &'a str,
    camera: &'a str,
    settings: &'a Settings,
    device: Option<&'a DeviceInfo>,
    plan: &'a Plan,
    total_bytes: u64,
}

pub fn run(args: &Args) -> Result<()> {
    let (mut scene, camera) = args.scene.load()?;
    args.ladder.set(&mut scene);
    let device = match canopy::gpu::find(args.device.as_deref()) {
        Ok(info) => Some(info),
        // Nothing is drawn here; only who names a device means that one.
        Err(Error::NoDevice(_)) if args.device.is_none() => None,
        Err(e) => return Err(e),
    };
    let eye = Eye::new(&camera, &scene.terrain, args.scene.size);
    let drawing = args.rasterizer.drawing(None);
    let plan = Plan::for_eye(&scene, &eye, args.layers, drawing, device.as_ref())?;
    if args.print.json {
        return output::json(&Report {
            schema_version: SCHEMA_VERSION,
            command: "plan",
            scene: &scene.name,
            camera: &camera.name,
            settings: &scene.settings,
            device: device.as_ref(),
            plan: &plan,
            total_bytes: plan.bytes(),
        });
    }
    if args.print.quiet {
        return Ok(());
    }
    let whose = match &device {
        Some(d) => format!("on {}", d.name),
        None => "no Vulkan device found: for common limits".into(),
    };
    let mut table = Table::new(3, &["kind", "name", "reason", "bytes"]);
    for i in &plan.items {
        let bytes = if i.bytes() > 0 { output::bytes(i.bytes()) } else { "-".into() };
        table.row([i.kind.into(), i.name.clone(), i.reason.clone(), bytes]);
    }
    table.row(["".into(), "total".into(), "device memory".into(), output::bytes(plan.bytes())]);
    let no_meshes =
        plan.no_meshes.as_ref().map_or(String::new(), |why| format!("no tree is a mesh: {why}\n"));
    output::print(&format!(
        "{}, camera {}, {} x {}, ladder {}, rasterizer {} ({whose})\n{no_meshes}{}",
        scene.name,
        camera.name,
        plan.size[0],
        plan.size[1],
        plan.ladder,
        plan.rasterizer.name(),
        table.text()
    ))
}
