//! What a measurement was made on: machine, driver and its variables, and which build.

use std::collections::BTreeMap;
use std::path::Path;

/// The machine and the program.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Host {
    /// CPU model.
    pub cpu: String,
    /// Hardware threads that this process may use.
    pub threads: u32,
    /// Kernel.
    pub kernel: String,
    /// Load average over the minute before, if the system tells.
    pub load_average: Option<f64>,
    /// Version of LLVM, where the driver names it.
    pub llvm: Option<String>,
    /// Driver manifests that the Vulkan loader finds.
    pub icd: Vec<String>,
    /// Vulkan layers asked for, by this program or the environment.
    pub layers: Vec<String>,
    /// Variables that drivers and the loader read: `LP_…`, `MESA_…`, `GALLIUM_…`, `VK_…`.
    pub variables: BTreeMap<String, String>,
    /// Version of this program.
    pub version: String,
    /// `git describe` of the folder that it was built in, as that stands now.
    pub revision: Option<String>,
    /// BLAKE3 of the program file, in hexadecimal: which build it was.
    pub program: Option<String>,
}

impl Host {
    /// This machine, with a device of this name; `validate` adds the validation layer.
    pub fn here(device: &str, validate: bool) -> Self {
        let variables: BTreeMap<String, String> = std::env::vars_os()
            .map(|(k, v)| (k.to_string_lossy().into_owned(), v.to_string_lossy().into_owned()))
            .filter(|(k, _)| ["LP_", "MESA_", "GALLIUM_", "VK_"].iter().any(|p| k.starts_with(p)))
            .collect();
        let mut layers: Vec<String> = ["VK_INSTANCE_LAYERS", "VK_LOADER_LAYERS_ENABLE"]
            .iter()
            .filter_map(|k| variables.get(*k))
            .flat_map(|v| v.split([':', ',']).map(str::to_string))
            .collect();
        if validate {
            layers.push("VK_LAYER_KHRONOS_validation".into());
        }
        Host {
            cpu: cpu_model(),
            threads: std::thread::available_parallelism().map_or(1, |n| n.get() as u32),
            kernel: read_line("/proc/sys/kernel/osrelease").unwrap_or_else(|| std::env::consts::OS.into()),
            load_average: read_line("/proc/loadavg").and_then(|l| l.split(' ').next()?.parse().ok()),
            llvm: llvm(device),
            icd: manifests(&variables),
            layers,
            variables,
            version: env!("CARGO_PKG_VERSION").into(),
            revision: revision(),
            program: program(),
        }
    }
}

fn read_line(path: &str) -> Option<String> {
    Some(std::fs::read_to_string(path).ok()?.lines().next()?.trim().to_string())
}

fn cpu_model() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.into(), |(_, name)| name.trim().to_string())
}

/// "15.0.6" of "llvmpipe (LLVM 15.0.6, 256 bits)".
fn llvm(device: &str) -> Option<String> {
    let (_, rest) = device.split_once("LLVM ")?;
    let version: String = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    (!version.is_empty()).then_some(version)
}

/// Driver manifests: those that variables name, else those in the loader's usual folders.
fn manifests(variables: &BTreeMap<String, String>) -> Vec<String> {
    if let Some(named) = variables.get("VK_DRIVER_FILES").or_else(|| variables.get("VK_ICD_FILENAMES")) {
        return named.split(':').map(str::to_string).collect();
    }
    let folders = ["/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/share/vulkan/icd.d"];
    let mut found: Vec<String> = folders
        .iter()
        .filter_map(|f| std::fs::read_dir(f).ok())
        .flatten()
        .filter_map(|e| Some(e.ok()?.path().display().to_string()))
        .collect();
    found.sort();
    found
}

fn revision() -> Option<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let args = ["describe", "--always", "--dirty", "--abbrev=12"];
    let out = std::process::Command::new("git").arg("-C").arg(folder).args(args).output().ok()?;
    let text = String::from_utf8(out.stdout).ok()?;
    (out.status.success() && !text.trim().is_empty()).then(|| text.trim().to_string())
}

fn program() -> Option<String> {
    let bytes = std::fs::read(std::env::current_exe().ok()?).ok()?;
    Some(blake3::hash(&bytes).to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn llvm_is_read_from_the_device_name() {
        assert_eq!(llvm("llvmpipe (LLVM 15.0.6, 256 bits)").as_deref(), Some("15.0.6"));
        assert_eq!(llvm("NVIDIA H200"), None);
    }

    #[test]
    fn a_host_says_which_build_measured() {
        let host = Host::here("", true);
        assert!(host.threads >= 1 && !host.cpu.is_empty() && host.program.is_some());
        assert_eq!(host.layers.last().map(String::as_str), Some("VK_LAYER_KHRONOS_validation"));
    }
}
