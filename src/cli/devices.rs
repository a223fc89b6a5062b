//! `canopy devices`.

use canopy::Result;
use canopy::gpu::{DeviceInfo, tree_components};

use super::SCHEMA_VERSION;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy devices                            what is here, and what is missing
  canopy render --device llvmpipe           use a device by part of its name
  canopy devices --json | jq '.devices[].uuid'";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    devices: Vec<DeviceInfo>,
}

pub fn run(args: &Args) -> Result<()> {
    let devices = canopy::gpu::devices()?;
    if args.json {
        return output::json(&Report { schema_version: SCHEMA_VERSION, command: "devices", devices });
    }
    let has = |fact: bool| if fact { "yes" } else { "no" }.to_string();
    let mut text = String::new();
    for d in &devices {
        let fits =
            if d.missing.is_empty() { "yes".into() } else { format!("no: lacks {}", d.missing.join(", ")) };
        let counts: Vec<String> =
            [1, 2, 4, 8, 16].iter().filter(|n| d.sample_counts & **n != 0).map(u32::to_string).collect();
        let mut table = Table::new(2, &[d.name.as_str(), ""]);
        for (what, value) in [
            ("fits", fits),
            ("uuid", d.uuid.clone()),
            ("kind", d.kind.to_string()),
            ("driver", d.driver.clone()),
            ("Vulkan", d.api.clone()),
            ("device memory", output::bytes(d.device_bytes)),
            ("largest image side", d.max_image_side.to_string()),
            ("most layers", d.max_layers.to_string()),
            ("largest buffer", output::bytes(d.max_storage_bytes)),
            ("samples a pixel", counts.join(", ")),
            ("trees by graphics", has(d.max_vertex_components >= tree_components())),
            ("pushed descriptors", has(d.push_descriptors)),
            ("layers by vertices", has(d.vertex_layers)),
            ("draws counted by shaders", has(d.counted_draws)),
            ("pipeline statistics", has(d.pipeline_statistics)),
        ] {
            table.row([format!("  {what}"), value]);
        }
        text += &table.text();
    }
    if devices.is_empty() {
        text = "no Vulkan device; on Debian: apt-get install mesa-vulkan-drivers\n".into();
    }
    output::print(&text)
}
