//! What no plan may be: more than a device has, or than the scene allows.

use super::{Item, Plan};
use crate::gpu::DeviceInfo;
use crate::gpu::interface as gpu;
use crate::scene::Scene;
use crate::{Error, Result};

impl Plan {
    /// Refuses more species than shaders hold.
    pub(super) fn check_species(&self, scene: &Scene) -> Result<()> {
        match scene.species.len() {
            n if n > gpu::MAX_SPECIES as usize => {
                Err(Error::Usage(format!("{n} species; at most {} fit a scene", gpu::MAX_SPECIES)))
            }
            _ => Ok(()),
        }
    }

    /// Refuses more memory than the budget or the device has, and images that it does not draw.
    pub(super) fn check(&self, budget_mib: u32, device: Option<&DeviceInfo>) -> Result<()> {
        let budget = u64::from(budget_mib) << 20;
        let largest = || {
            let mut items: Vec<&Item> = self.items.iter().filter(|i| i.bytes() > 0).collect();
            items.sort_by_key(|i| std::cmp::Reverse(i.bytes()));
            let named: Vec<String> =
                items.iter().take(3).map(|i| format!("{} ({} MiB)", i.name, i.bytes() >> 20)).collect();
            named.join(", ")
        };
        if self.bytes() > budget {
            return Err(Error::Usage(format!(
                "the plan takes {} MiB, more than memory_mib = {budget_mib}; the largest items: {}",
                self.bytes() >> 20,
                largest()
            )));
        }
        let Some(d) = device else { return Ok(()) };
        if self.bytes() > d.device_bytes {
            return Err(Error::Usage(format!(
                "the plan takes {} MiB; {} has {} MiB; the largest items: {}",
                self.bytes() >> 20,
                d.name,
                d.device_bytes >> 20,
                largest()
            )));
        }
        if self.size.iter().any(|n| *n == 0 || *n > d.max_image_side) {
            return Err(Error::Usage(format!(
                "an image of {} x {} pixels; {} draws 1 to {} a side",
                self.size[0], self.size[1], d.name, d.max_image_side
            )));
        }
        Ok(())
    }
}

/// The largest supported number of samples up to the wanted one.
pub(super) fn samples(wanted: u32, device: Option<&DeviceInfo>) -> u32 {
    let supported = device.map_or(0b1_0101, |d| d.sample_counts);
    [8, 4, 1].into_iter().find(|n| *n <= wanted && supported & n != 0).unwrap_or(1)
}
