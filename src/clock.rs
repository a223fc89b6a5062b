//! The host's clocks.

/// Nanoseconds of the host's monotonic clock (`CLOCK_MONOTONIC` where there is one), the one that Vulkan's calibrated
/// timestamps refer to.
pub fn monotonic_ns() -> u64 {
    #[cfg(unix)]
    {
        nanoseconds(rustix::time::clock_gettime(rustix::time::ClockId::Monotonic))
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
        START.get_or_init(std::time::Instant::now).elapsed().as_nanos() as u64
    }
}

/// Nanoseconds of CPU time, user and system, of all threads of this process; `None` where the system does not tell.
pub fn process_cpu_ns() -> Option<u64> {
    #[cfg(unix)]
    {
        Some(nanoseconds(rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime)))
    }
    #[cfg(not(unix))]
    {
        None
    }
}

/// Milliseconds of CPU time since an earlier reading.
pub fn process_cpu_ms_since(earlier: Option<u64>) -> Option<f64> {
    Some(process_cpu_ns()?.saturating_sub(earlier?) as f64 * 1e-6)
}

#[cfg(unix)]
fn nanoseconds(t: rustix::time::Timespec) -> u64 {
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_go_forward_and_work_takes_cpu_time() {
        let (wall, cpu) = (monotonic_ns(), process_cpu_ns());
        let mut x = 1u64;
        while process_cpu_ms_since(cpu).is_some_and(|ms| ms < 1.0) {
            x = std::hint::black_box(x.wrapping_mul(6364136223846793005).wrapping_add(1));
        }
        assert!(monotonic_ns() >= wall);
    }
}
