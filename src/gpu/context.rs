//! Device, queue and allocator, and what keeps them alive.

use std::collections::BTreeMap;
use std::ffi::{CStr, CString};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::failures::{Failure, Failures};
use super::instance::{Root, Validation};
use super::memory::Retired;
use super::program::Sampler;
use super::select::{DeviceInfo, choose};
use super::timing::{Calibration, TimingState, calibration_extension};
use crate::{Error, Result};

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// UUID or part of the name; `None` takes the best that fits.
    pub device: Option<String>,
    /// What the validation layers watch.
    pub validation: Validation,
    /// Do without what not every device has, though this one has it: for tests.
    #[doc(hidden)]
    pub frugal: bool,
}

/// An open Vulkan device. Cheap to clone; the device closes with the last clone or resource.
#[derive(Clone)]
pub struct Gpu {
    pub(super) shared: Arc<Shared>,
}

/// What every resource keeps alive.
pub(super) struct Shared {
    pub device: ash::Device,
    /// Descriptors with the commands that use them; without, sets come from pools.
    pub push: Option<khr::push_descriptor::Device>,
    pub names: Option<ext::debug_utils::Device>,
    pub queue: vk::Queue,
    /// The queue's family.
    pub family: u32,
    pub pool: vk::CommandPool,
    pub timeline: vk::Semaphore,
    /// Number of the last submission.
    pub submitted: AtomicU64,
    pub allocator: Mutex<Option<Allocator>>,
    pub retired: Mutex<Vec<(u64, Retired)>>,
    /// The device's heaps and memory types.
    pub memory: vk::PhysicalDeviceMemoryProperties,
    /// Live pipelines by the name of their last shader.
    pub pipelines: Mutex<BTreeMap<&'static str, u32>>,
    /// Bytes of live allocations by heap.
    pub heap_bytes: Mutex<[u64; vk::MAX_MEMORY_HEAPS]>,
    pub samplers: Vec<vk::Sampler>,
    pub info: DeviceInfo,
    pub timing: TimingState,
    pub failures: Failures,
    // Last: the instance must outlive everything made through it.
    root: Root,
}

/// Maps a Vulkan failure to the error that carries the right exit code.
pub(super) fn device_error(what: &str) -> impl FnOnce(vk::Result) -> Error + '_ {
    move |e| {
        let remedy = match e {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                "out of device memory; choose a smaller --size or a lower --quality (`canopy plan` lists what takes how much), or close what else uses the device"
            }
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                "the driver is out of host memory; choose a smaller --size or a lower --quality, or close other programs"
            }
            vk::Result::ERROR_DEVICE_LOST => {
                "the device was lost: its driver reset it, or another program crashed it; run again, and see the system's log"
            }
            other => return Error::Device(format!("{what}: {other}")),
        };
        Error::Device(format!("{what}: {remedy}"))
    }
}

pub(super) fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with the reason for every device when none fits, or when validation is asked for and
    /// its layer is not installed; [`Error::Device`] when memory runs out.
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let failures = Failures::from_environment()?;
        let root = Root::new(options.validation)?;
        let (physical, mut info) = choose(&root.instance, options.device.as_deref())?;
        info.vertex_layers &= !options.frugal;
        info.counted_draws &= !options.frugal;
        // GPU-assisted validation (1.3.239) takes pushed descriptors for uninitialised, and checks nothing behind them.
        info.push_descriptors &= !options.frugal && options.validation != Validation::GpuAssisted;
        let shared = open(root, physical, info, failures)?;
        Ok(Gpu { shared: Arc::new(shared) })
    }

    /// What the open device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Validation messages so far; empty without validation.
    pub fn messages(&self) -> Vec<String> {
        lock(&self.shared.root.messages).clone()
    }

    /// Bytes that live buffers and images hold, by their names, largest first.
    pub fn memory_report(&self) -> Vec<(String, u64)> {
        let guard = lock(&self.shared.allocator);
        let mut all: Vec<(String, u64)> = guard
            .as_ref()
            .map(|a| a.generate_report().allocations.iter().map(|a| (a.name.clone(), a.size)).collect())
            .unwrap_or_default();
        all.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        all
    }

    /// Live pipelines: paths of their last shaders under `shaders/`, each with how many there are.
    pub fn pipelines(&self) -> Vec<(&'static str, u32)> {
        lock(&self.shared.pipelines).iter().map(|(name, count)| (*name, *count)).collect()
    }

    /// Bytes that live buffers and images hold in each heap, by the heap's number and kind.
    pub fn heap_report(&self) -> Vec<(String, u64)> {
        let bytes = lock(&self.shared.heap_bytes);
        let name = |k: usize, local: bool| format!("{k} {}", if local { "device-local" } else { "host" });
        let heaps = &self.shared.memory.memory_heaps[..self.shared.memory.memory_heap_count as usize];
        let local = |h: &vk::MemoryHeap| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        heaps.iter().enumerate().map(|(k, h)| (name(k, local(h)), bytes[k])).collect()
    }

    /// Makes the `n`-th place from now on fail, for tests; 0 stops that.
    #[doc(hidden)]
    pub fn fail(&self, failure: Failure, n: u32) {
        self.shared.failures.arm(failure, n);
    }

    /// Places that need memory, and submissions and waits, since [`Gpu::fail`]: as many can fail.
    #[doc(hidden)]
    pub fn passed(&self) -> [u32; 2] {
        self.shared.failures.passed()
    }

    /// Makes an object that nothing destroys, so that a test can prove that closing reports one.
    #[doc(hidden)]
    pub fn forget_for_test(&self) {
        // SAFETY: the device is alive, and the object is never used.
        let _ = unsafe { self.shared.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
    }

    /// Waits for the device, then reports what should not be: validation messages and live allocations. Closes the device
    /// if this is its last owner, so that the layers also say which objects were forgotten.
    /// Call it when every resource has been dropped.
    ///
    /// # Errors
    /// [`Error::Validation`] with every message; [`Error::Check`] with the names of what is still allocated;
    /// [`Error::Device`] if the device fails.
    pub fn close(self) -> Result<()> {
        let waited = self.shared.wait_idle().map_err(device_error("waiting for the device"));
        self.shared.collect(u64::MAX);
        let live = self.memory_report();
        let messages = self.shared.root.messages.clone();
        drop(self);
        let messages = lock(&messages);
        if !messages.is_empty() {
            let mut text = format!("{} validation message(s):", messages.len());
            // A message that every pass repeats is shown once.
            let mut shown = std::collections::HashSet::new();
            for m in messages.iter().filter(|m| shown.insert(m.as_str())) {
                text += &format!("\n{}", m.trim_end());
            }
            return Err(Error::Validation(text));
        }
        if !live.is_empty() {
            let names: Vec<String> = live.iter().map(|(n, b)| format!("{n} ({b} bytes)")).collect();
            return Err(Error::Check(format!("still allocated at exit: {}", names.join(", "))));
        }
        waited
    }
}

fn open(root: Root, physical: vk::PhysicalDevice, info: DeviceInfo, failures: Failures) -> Result<Shared> {
    let instance = root.instance.clone();
    // SAFETY: instance and physical device are alive throughout; every create struct outlives its call. On failure
    // `Shared` destroys what was made so far.
    unsafe {
        let families = instance.get_physical_device_queue_family_properties(physical);
        let all_work = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families
            .iter()
            .position(|q| q.queue_flags.contains(all_work) && q.timestamp_valid_bits > 0)
            .ok_or_else(|| Error::NoDevice("the device lost its graphics queue".into()))?
            as u32;
        let queue_info =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
        let calibration = calibration_extension(&root.entry, &instance, physical);
        let push = info.push_descriptors.then_some(khr::push_descriptor::NAME);
        let extensions: Vec<_> = [push, calibration].into_iter().flatten().map(CStr::as_ptr).collect();
        let features = vk::PhysicalDeviceFeatures::default()
            .pipeline_statistics_query(info.pipeline_statistics)
            .multi_draw_indirect(info.counted_draws)
            .draw_indirect_first_instance(info.counted_draws);
        let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
            .timeline_semaphore(true)
            .shader_output_layer(info.vertex_layers)
            .draw_indirect_count(info.counted_draws);
        let mut f13 = vk::PhysicalDeviceVulkan13Features::default()
            .synchronization2(true)
            .dynamic_rendering(true)
            // glslang writes workgroup sizes as LocalSizeId.
            .maintenance4(true);
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queue_info)
            .enabled_extension_names(&extensions)
            .enabled_features(&features)
            .push_next(&mut f12)
            .push_next(&mut f13);
        let device = instance
            .create_device(physical, &create, None)
            .map_err(|e| Error::NoDevice(format!("{}: cannot open the device: {e}", info.name)))?;
        let valid_bits = families[family as usize].timestamp_valid_bits;
        let calibration = calibration.map(|name| {
            if name == khr::calibrated_timestamps::NAME {
                Calibration::Khr(khr::calibrated_timestamps::Device::new(&instance, &device))
            } else {
                Calibration::Ext(ext::calibrated_timestamps::Device::new(&instance, &device))
            }
        });
        let mut shared = Shared {
            timing: TimingState { calibration, valid_bits, ..TimingState::default() },
            memory: instance.get_physical_device_memory_properties(physical),
            pipelines: Mutex::default(),
            heap_bytes: Mutex::new([0; vk::MAX_MEMORY_HEAPS]),
            push: push.map(|_| khr::push_descriptor::Device::new(&instance, &device)),
            names: root.debug_utils.then(|| ext::debug_utils::Device::new(&instance, &device)),
            queue: device.get_device_queue(family, 0),
            family,
            device: device.clone(),
            pool: vk::CommandPool::null(),
            timeline: vk::Semaphore::null(),
            submitted: AtomicU64::new(0),
            allocator: Mutex::new(None),
            retired: Mutex::new(Vec::new()),
            samplers: Vec::new(),
            info,
            failures,
            root,
        };
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let semaphore = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        let free = shared.failures.memory();
        shared.timeline = free
            .and_then(|()| device.create_semaphore(&semaphore, None))
            .map_err(device_error("timeline semaphore"))?;
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        let free = shared.failures.memory();
        shared.pool = free
            .and_then(|()| device.create_command_pool(&pool, None))
            .map_err(device_error("command pool"))?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance,
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|e| Error::Device(format!("allocator: {e}")))?;
        shared.allocator = Mutex::new(Some(allocator));
        for sampler in Sampler::ALL {
            let made = shared.failures.memory().and_then(|()| sampler.make(&device));
            shared.samplers.push(made.map_err(device_error("sampler"))?);
        }
        Ok(shared)
    }
}

impl Shared {
    /// Names an object for validation messages and captures.
    pub fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        if let (Some(names), Ok(text)) = (&self.names, CString::new(name)) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&text);
            // SAFETY: the handle belongs to this device. A failure only loses the name.
            let _ = unsafe { names.set_debug_utils_object_name(&info) };
        }
    }

    /// The heap of an allocation: that of the memory type with its properties.
    pub fn heap_of(&self, allocation: &gpu_allocator::vulkan::Allocation) -> usize {
        let types = &self.memory.memory_types[..self.memory.memory_type_count as usize];
        let found = types.iter().find(|t| t.property_flags == allocation.memory_properties());
        found.map_or(0, |t| t.heap_index as usize)
    }

    /// Waits until the device has nothing to do.
    pub fn wait_idle(&self) -> std::result::Result<(), vk::Result> {
        // SAFETY: the device is alive; no other thread submits. A device that only plays lost is waited for all the same.
        let done = unsafe { self.device.device_wait_idle() };
        self.failures.device().and(done)
    }

    /// Keeps a resource until the submission that may still use it is done.
    pub fn retire(&self, resource: Retired) {
        lock(&self.retired).push((self.submitted.load(Ordering::Acquire) + 1, resource));
    }

    /// Destroys what no submission up to `done` can use.
    pub fn collect(&self, done: u64) {
        let mut retired = lock(&self.retired);
        let mut kept = Vec::new();
        for (at, resource) in retired.drain(..) {
            if at <= done {
                resource.destroy(self);
            } else {
                kept.push((at, resource));
            }
        }
        *retired = kept;
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: this is the last owner, so no resource, recorder or other thread uses the device; children go
        // before the device, the device before the instance, which is the last field.
        unsafe {
            // A lost device has nothing left to wait for.
            let _ = self.wait_idle();
            self.collect(u64::MAX);
            drop(lock(&self.allocator).take());
            for s in &self.samplers {
                self.device.destroy_sampler(*s, None);
            }
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_semaphore(self.timeline, None);
            self.device.destroy_device(None);
        }
    }
}
