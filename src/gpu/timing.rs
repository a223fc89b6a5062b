//! What a recording measures of itself: nested scopes of two timestamps, pipeline statistics, CPU time on software drivers.
//!
//! * Stamps are read with their availability. A scope whose stamps are missing, or go backwards, is left out and counted
//!   in [`Timing::lost`]; no one gets a made-up time.
//! * On one clock with the host through calibrated timestamps, where the device has them.
//! * [`TimingOptions::apart`] submits every pass by itself, so that the process's CPU time can be told pass by pass. A
//!   software driver spends all its time on this process's threads, and CPU time does not count waiting for a core that
//!   others use, so it is much steadier there than the time between two stamps.

use std::sync::Mutex;

use ash::{ext, khr, vk};

use super::context::{Gpu, device_error, lock};
use crate::Result;

/// Most scopes in one recording.
pub(super) const MAX_SCOPES: u32 = 2048;

/// Where timestamps stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum Stamps {
    /// Nowhere.
    None,
    /// At the beginning and the end of a recording: passes run as they would without.
    #[default]
    Ends,
    /// Around every scope too, each with a barrier: no pass begins before the stamp of the one before is written.
    Scopes,
}

/// What recordings measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct TimingOptions {
    /// Where timestamps stand.
    pub stamps: Stamps,
    /// Every pass is a submission of its own, with its CPU time.
    pub apart: bool,
    /// Pipeline statistics a pass, on devices that have them ([`super::DeviceInfo::pipeline_statistics`]).
    pub statistics: bool,
}

/// What the pipeline did in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PipelineStatistics {
    /// Vertices assembled.
    pub input_vertices: u64,
    /// Invocations of vertex shaders.
    pub vertex_invocations: u64,
    /// Primitives that reached clipping.
    pub clipping_invocations: u64,
    /// Primitives that left it.
    pub clipping_primitives: u64,
    /// Invocations of fragment shaders.
    pub fragment_invocations: u64,
    /// Invocations of compute shaders.
    pub compute_invocations: u64,
}

/// Number of counters in [`PipelineStatistics`], and which.
const COUNTERS: usize = 6;
fn counters() -> vk::QueryPipelineStatisticFlags {
    vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_VERTICES
        | vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES
        | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS
}

/// GPU time of a scope: a pass, or a stage of several.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// Name of the scope.
    pub name: String,
    /// Milliseconds between its two timestamps.
    pub gpu_ms: f64,
    /// Milliseconds from the first timestamp of the recording to its own first.
    pub start_ms: f64,
    /// CPU time of all threads while it ran, ms; with [`TimingOptions::apart`], passes only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu_ms: Option<f64>,
    /// How often it was recorded; the times are of all of them together.
    #[serde(skip)]
    pub recorded: u32,
    /// What the pipeline did; passes only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistics: Option<PipelineStatistics>,
}

/// What a recording measured.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Timing {
    /// Passes in the order in which each is first recorded. Without stamps around scopes their times are zero.
    pub passes: Vec<PassTime>,
    /// Stages, each of several passes, in order.
    pub stages: Vec<PassTime>,
    /// Milliseconds from the first to the last stamp of the recording; `None` without stamps, or if one is missing.
    pub gpu_ms: Option<f64>,
    /// The first stamp on the clock of [`crate::clock::monotonic_ns`]; `None` without calibrated timestamps.
    pub gpu_start_ns: Option<u64>,
    /// When the first submission began, on the same clock.
    pub submit_ns: u64,
    /// When the last one was done.
    pub done_ns: u64,
    /// Milliseconds from submitting to done, of all submissions.
    pub wait_ms: f64,
    /// Draw commands recorded.
    pub draws: u32,
    /// Dispatches recorded.
    pub dispatches: u32,
    /// Scopes left out because a stamp was missing or went backwards.
    pub lost: u32,
}

/// A scope while recording.
pub(super) struct Scope {
    pub name: String,
    pub pass: bool,
    pub cpu_ms: Option<f64>,
}

/// Query pools of a recording.
#[derive(Clone, Copy)]
pub(super) struct Queries {
    pub stamps: vk::QueryPool,
    pub statistics: Option<vk::QueryPool>,
}

/// Calibrated timestamps, by whichever name the device has them.
pub(super) enum Calibration {
    Khr(khr::calibrated_timestamps::Device),
    Ext(ext::calibrated_timestamps::Device),
}

/// What the device keeps for timing.
#[derive(Default)]
pub(super) struct TimingState {
    pub options: Mutex<TimingOptions>,
    pub calibration: Option<Calibration>,
    /// Bits of a timestamp that mean something.
    pub valid_bits: u32,
}

/// The extension that calibrates timestamps against the monotonic clock, if the device has one.
pub(super) fn calibration_extension(
    entry: &ash::Entry,
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
) -> Option<&'static std::ffi::CStr> {
    // SAFETY: instance and physical device are alive; the function is called only where its extension is there.
    unsafe {
        let all = instance.enumerate_device_extension_properties(physical).ok()?;
        let has = |name| all.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        // The older name first: devices that know the newer one have both, but layers and tools may not have heard of it yet.
        let (name, domains) = if has(ext::calibrated_timestamps::NAME) {
            let i = ext::calibrated_timestamps::Instance::new(entry, instance);
            (ext::calibrated_timestamps::NAME, i.get_physical_device_calibrateable_time_domains(physical))
        } else if has(khr::calibrated_timestamps::NAME) {
            let i = khr::calibrated_timestamps::Instance::new(entry, instance);
            (khr::calibrated_timestamps::NAME, i.get_physical_device_calibrateable_time_domains(physical))
        } else {
            return None;
        };
        let domains = domains.ok()?;
        let both = [vk::TimeDomainKHR::DEVICE, vk::TimeDomainKHR::CLOCK_MONOTONIC];
        both.iter().all(|d| domains.contains(d)).then_some(name)
    }
}

impl Gpu {
    /// What recordings measure from now on.
    pub fn set_timing(&self, options: TimingOptions) {
        let statistics = options.statistics && self.info().pipeline_statistics;
        *lock(&self.shared.timing.options) = TimingOptions { statistics, ..options };
    }

    /// What recordings measure.
    pub fn timing(&self) -> TimingOptions {
        *lock(&self.shared.timing.options)
    }

    /// The device's ticks and the host's monotonic clock, ns, at the same moment.
    pub(super) fn calibrate(&self) -> Option<(u64, u64)> {
        let domain = |d| vk::CalibratedTimestampInfoKHR::default().time_domain(d);
        let both = [domain(vk::TimeDomainKHR::DEVICE), domain(vk::TimeDomainKHR::CLOCK_MONOTONIC)];
        // SAFETY: the extension is enabled and the device has both domains.
        let found = unsafe {
            match self.shared.timing.calibration.as_ref()? {
                Calibration::Khr(c) => c.get_calibrated_timestamps(&both),
                Calibration::Ext(c) => c.get_calibrated_timestamps(&both),
            }
        };
        found.ok().map(|(t, _)| (t[0], t[1]))
    }

    /// Query pools for one recording at a time.
    pub(super) fn make_queries(&self, statistics: bool) -> Result<Queries> {
        let s = &self.shared;
        let pool = |kind, count| vk::QueryPoolCreateInfo::default().query_type(kind).query_count(count);
        let stamps = pool(vk::QueryType::TIMESTAMP, 2 * MAX_SCOPES + 2);
        let counts = pool(vk::QueryType::PIPELINE_STATISTICS, MAX_SCOPES).pipeline_statistics(counters());
        // SAFETY: the device is alive and has the feature if statistics are wanted; on failure the first pool goes too.
        unsafe {
            let make = |pool| s.failures.memory().and_then(|()| s.device.create_query_pool(pool, None));
            let stamps = make(&stamps).map_err(device_error("timestamps"))?;
            let statistics = statistics.then(|| make(&counts)).transpose();
            match statistics {
                Ok(statistics) => Ok(Queries { stamps, statistics }),
                Err(e) => {
                    s.device.destroy_query_pool(stamps, None);
                    Err(device_error("pipeline statistics")(e))
                }
            }
        }
    }

    /// Reads what a recording of these scopes measured; its submissions must be done. Query 0 and 1 are the recording's own.
    pub(super) fn read_timing(
        &self,
        queries: Queries,
        options: TimingOptions,
        scopes: Vec<Scope>,
        clock: Option<(u64, u64)>,
    ) -> Timing {
        let s = &self.shared;
        let mut timing = Timing::default();
        let mut stamps = vec![[0u64; 2]; 2 * scopes.len() + 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        if options.stamps != Stamps::None {
            // SAFETY: the submissions that wrote the queries are complete. NOT_READY leaves availability at zero.
            let _ = unsafe { s.device.get_query_pool_results(queries.stamps, 0, &mut stamps, flags) };
        }
        let mut counts = vec![[0u64; COUNTERS + 1]; scopes.len()];
        if let Some(pool) = queries.statistics.filter(|_| options.statistics && !counts.is_empty()) {
            // SAFETY: as above.
            let _ = unsafe { s.device.get_query_pool_results(pool, 0, &mut counts, flags) };
        }
        let ms = f64::from(s.info.timestamp_ns) * 1e-6;
        let bits = s.timing.valid_bits;
        let whole = interval(stamps[0], stamps[1], bits);
        timing.gpu_ms = whole.map(|t| t as f64 * ms);
        let origin = clock.filter(|_| whole.is_some()).map(|(device, host)| {
            let since = signed_difference(stamps[0][0], device, bits) as f64 * ms * 1e6;
            host.saturating_add_signed(since as i64)
        });
        timing.gpu_start_ns = origin;
        for ((k, scope), count) in scopes.into_iter().enumerate().zip(counts) {
            let own = &stamps[2 * k + 2..2 * k + 4];
            let times = interval(stamps[0], own[0], bits).zip(interval(own[0], own[1], bits));
            let Some((start, length)) = times.or((options.stamps != Stamps::Scopes).then_some((0, 0))) else {
                timing.lost += 1;
                continue;
            };
            let [a, b, c, d, e, f, available] = count;
            let statistics = (scope.pass && available != 0).then_some(PipelineStatistics {
                input_vertices: a,
                vertex_invocations: b,
                clipping_invocations: c,
                clipping_primitives: d,
                fragment_invocations: e,
                compute_invocations: f,
            });
            let (gpu_ms, start_ms) = (length as f64 * ms, start as f64 * ms);
            let time = PassTime {
                name: scope.name,
                gpu_ms,
                start_ms,
                cpu_ms: scope.cpu_ms,
                recorded: 1,
                statistics,
            };
            add(if scope.pass { &mut timing.passes } else { &mut timing.stages }, time);
        }
        timing
    }
}

/// Adds a scope's time to those of scopes of its name, if there are any: what a recording does several times counts together.
fn add(all: &mut Vec<PassTime>, time: PassTime) {
    let Some(same) = all.iter_mut().find(|t| t.name == time.name) else {
        return all.push(time);
    };
    same.recorded += time.recorded;
    same.gpu_ms += time.gpu_ms;
    same.cpu_ms = same.cpu_ms.zip(time.cpu_ms).map(|(a, b)| a + b);
    same.statistics = same.statistics.zip(time.statistics).map(|(a, b)| PipelineStatistics {
        input_vertices: a.input_vertices + b.input_vertices,
        vertex_invocations: a.vertex_invocations + b.vertex_invocations,
        clipping_invocations: a.clipping_invocations + b.clipping_invocations,
        clipping_primitives: a.clipping_primitives + b.clipping_primitives,
        fragment_invocations: a.fragment_invocations + b.fragment_invocations,
        compute_invocations: a.compute_invocations + b.compute_invocations,
    });
}

/// Ticks from one stamp to another, each with its availability, of a counter with so many valid bits that may wrap.
fn interval(from: [u64; 2], to: [u64; 2], bits: u32) -> Option<u64> {
    if from[1] == 0 || to[1] == 0 {
        return None;
    }
    u64::try_from(signed_difference(to[0], from[0], bits)).ok()
}

/// a - b modulo the counter, as the nearest signed number.
fn signed_difference(a: u64, b: u64, bits: u32) -> i64 {
    let unused = 64 - bits.clamp(1, 64);
    (a.wrapping_sub(b) << unused) as i64 >> unused
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scopes_of_one_name_count_together() {
        let scope = |name: &str, start_ms, gpu_ms, cpu_ms| PassTime {
            name: name.into(),
            gpu_ms,
            start_ms,
            cpu_ms,
            recorded: 1,
            statistics: None,
        };
        let mut all = Vec::new();
        for time in
            [scope("a", 0.0, 1.0, Some(1.0)), scope("b", 1.0, 2.0, None), scope("a", 3.0, 4.0, Some(5.0))]
        {
            add(&mut all, time);
        }
        let twice = PassTime { recorded: 2, ..scope("a", 0.0, 5.0, Some(6.0)) };
        assert_eq!(all, [twice, scope("b", 1.0, 2.0, None)]);
    }

    #[test]
    fn stamps_missing_or_backwards_are_no_times() {
        assert_eq!(interval([10, 1], [25, 1], 64), Some(15));
        assert_eq!(interval([10, 1], [10, 1], 64), Some(0));
        assert_eq!(interval([10, 0], [25, 1], 64), None);
        assert_eq!(interval([10, 1], [25, 0], 64), None);
        assert_eq!(interval([25, 1], [10, 1], 64), None);
    }

    #[test]
    fn a_counter_of_few_bits_wraps() {
        let top = (1 << 36) - 5;
        assert_eq!(interval([top, 1], [7, 1], 36), Some(12));
        assert_eq!(interval([7, 1], [top, 1], 36), None);
        assert_eq!(signed_difference(3, u64::MAX - 1, 64), 5);
    }
}
