//! Failures on demand: what a driver answers when memory runs out or the device is lost, at a chosen place.
//!
//! Every fallible Vulkan call of this module that creates, allocates, records or submits passes a [`Failures`] first.
//! Tests arm it through [`super::Gpu::fail`]; a harness that wants to see how it takes exit code 6 sets `CANOPY_FAIL` for any
//! command that opens a device, to `device-memory:N`, `host-memory:N` or `lost:N`: the N-th place fails.

use std::sync::Mutex;

use ash::vk;

use super::context::lock;
use crate::{Error, Result};

/// The environment variable that [`super::Gpu::new`] reads.
const VARIABLE: &str = "CANOPY_FAIL";

/// What fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// A call that needs memory answers `VK_ERROR_OUT_OF_DEVICE_MEMORY`, once.
    DeviceMemory,
    /// A call that needs memory answers `VK_ERROR_OUT_OF_HOST_MEMORY`, once.
    HostMemory,
    /// A submission or a wait answers `VK_ERROR_DEVICE_LOST`, and so does every one after it.
    DeviceLost,
}

impl Failure {
    const NAMES: [(&str, Failure); 3] = [
        ("device-memory", Failure::DeviceMemory),
        ("host-memory", Failure::HostMemory),
        ("lost", Failure::DeviceLost),
    ];

    fn result(self) -> vk::Result {
        match self {
            Failure::DeviceMemory => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            Failure::HostMemory => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            Failure::DeviceLost => vk::Result::ERROR_DEVICE_LOST,
        }
    }
}

/// Where the failure stands: nowhere, at the N-th call to come, or behind.
#[derive(Default)]
struct State {
    armed: Option<(Failure, u32)>,
    lost: bool,
    passed: [u32; 2],
}

/// The test layer of a device.
#[derive(Default)]
pub(super) struct Failures(Mutex<State>);

impl Failures {
    /// As the environment asks; without the variable, none.
    pub fn from_environment() -> Result<Self> {
        let failures = Failures::default();
        let Some(text) = std::env::var_os(VARIABLE) else { return Ok(failures) };
        let parsed = text.to_str().and_then(|t| t.split_once(':')).and_then(|(name, n)| {
            let found = Failure::NAMES.iter().find(|(known, _)| *known == name)?;
            Some((found.1, n.parse().ok().filter(|n| *n > 0)?))
        });
        let Some((failure, n)) = parsed else {
            let names = Failure::NAMES.map(|(name, _)| format!("{name}:N")).join(", ");
            return Err(Error::Usage(format!("{VARIABLE} is {text:?}; it takes {names} with N from 1")));
        };
        failures.arm(failure, n);
        Ok(failures)
    }

    /// Makes the `n`-th place from now on fail (0: none does), and forgets what was.
    pub fn arm(&self, failure: Failure, n: u32) {
        *lock(&self.0) = State { armed: (n > 0).then_some((failure, n)), ..State::default() };
    }

    /// How many places that need memory, and how many submissions and waits, have been passed since it was armed.
    pub fn passed(&self) -> [u32; 2] {
        lock(&self.0).passed
    }

    /// Before a call that needs memory.
    pub fn memory(&self) -> std::result::Result<(), vk::Result> {
        self.pass(0, |f| f != Failure::DeviceLost)
    }

    /// Before a submission or a wait.
    pub fn device(&self) -> std::result::Result<(), vk::Result> {
        self.pass(1, |f| f == Failure::DeviceLost)
    }

    fn pass(&self, kind: usize, mine: impl Fn(Failure) -> bool) -> std::result::Result<(), vk::Result> {
        let mut state = lock(&self.0);
        state.passed[kind] += 1;
        if kind == 1 && state.lost {
            return Err(vk::Result::ERROR_DEVICE_LOST);
        }
        match state.armed {
            Some((failure, n)) if mine(failure) && state.passed[kind] == n => {
                state.lost = failure == Failure::DeviceLost;
                Err(failure.result())
            }
            _ => Ok(()),
        }
    }
}
