//! Instance, device, queue, allocator, validation.

use std::ffi::{CStr, CString, c_void};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::memory::Retired;
use super::program::{Sampler, make_samplers};
use super::select::{DeviceInfo, choose};
use super::timing::{Calibration, TimingState, calibration_extension};
use crate::{Error, Result};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layers watch. Messages are kept for [`Gpu::messages`], and [`Gpu::close`] fails with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// Nothing: the layers are not loaded.
    #[default]
    Off,
    /// Core and synchronization validation.
    Full,
    /// Core validation alone.
    Core,
    /// Synchronization validation alone.
    Synchronization,
    /// Shaders too, by instrumenting them: slow.
    GpuAssisted,
}

impl Validation {
    /// What the layers do beside, and instead of, core validation.
    fn features(
        self,
    ) -> (&'static [vk::ValidationFeatureEnableEXT], &'static [vk::ValidationFeatureDisableEXT]) {
        use {vk::ValidationFeatureDisableEXT as Disable, vk::ValidationFeatureEnableEXT as Enable};
        match self {
            Validation::Off | Validation::Core => (&[], &[]),
            Validation::Full => (&[Enable::SYNCHRONIZATION_VALIDATION], &[]),
            Validation::Synchronization => (&[Enable::SYNCHRONIZATION_VALIDATION], &[Disable::CORE_CHECKS]),
            Validation::GpuAssisted => {
                (&[Enable::GPU_ASSISTED, Enable::GPU_ASSISTED_RESERVE_BINDING_SLOT], &[])
            }
        }
    }
}

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// UUID or part of the name; `None` takes the best that fits.
    pub device: Option<String>,
    /// What the validation layers watch.
    pub validation: Validation,
}

/// An open Vulkan device. Cheap to clone; the device closes with the last clone or resource.
#[derive(Clone)]
pub struct Gpu {
    pub(super) shared: Arc<Shared>,
}

/// What every resource keeps alive.
pub(super) struct Shared {
    pub device: ash::Device,
    pub push: khr::push_descriptor::Device,
    pub names: Option<ext::debug_utils::Device>,
    pub queue: vk::Queue,
    pub pool: vk::CommandPool,
    pub timeline: vk::Semaphore,
    /// Number of the last submission.
    pub submitted: AtomicU64,
    pub allocator: Mutex<Option<Allocator>>,
    pub retired: Mutex<Vec<(u64, Retired)>>,
    /// The device's heaps and memory types.
    pub memory: vk::PhysicalDeviceMemoryProperties,
    /// Bytes of live allocations by heap.
    pub heap_bytes: Mutex<[u64; vk::MAX_MEMORY_HEAPS]>,
    pub samplers: Vec<vk::Sampler>,
    pub info: DeviceInfo,
    pub timing: TimingState,
    messages: Arc<Mutex<Vec<String>>>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ash::Instance,
    // Last: the loader must outlive everything made through it.
    _entry: ash::Entry,
}

pub(super) fn load_entry() -> Result<ash::Entry> {
    // SAFETY: the Vulkan loader is a well-behaved library; nothing else runs in its initialisers.
    unsafe { ash::Entry::load() }.map_err(|e| {
        Error::NoDevice(format!(
            "no Vulkan loader ({e}); on Debian: apt-get install libvulkan1 mesa-vulkan-drivers"
        ))
    })
}

/// Maps a Vulkan failure to the error that carries the right exit code.
pub(super) fn device_error(what: &str) -> impl FnOnce(vk::Result) -> Error + '_ {
    move |e| Error::Device(format!("{what}: {e}"))
}

pub(super) fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with the reason for every device when none fits, or when validation is asked for and
    /// its layer is not installed.
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let entry = load_entry()?;
        let app = vk::ApplicationInfo::default()
            .application_name(c"canopy")
            .engine_name(c"canopy")
            .api_version(vk::API_VERSION_1_3);
        // SAFETY: the loader is loaded.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        let validate = options.validation != Validation::Off;
        if validate && !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION)) {
            return Err(Error::NoDevice(
                "validation was asked for but VK_LAYER_KHRONOS_validation is not installed \
                 (on Debian: apt-get install vulkan-validationlayers)"
                    .into(),
            ));
        }
        // SAFETY: the loader is loaded.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let debug_utils =
            validate || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        let layer_names = [VALIDATION.as_ptr()];
        let extension_names = [ext::debug_utils::NAME.as_ptr()];
        let (enables, disables) = options.validation.features();
        let mut features = vk::ValidationFeaturesEXT::default()
            .enabled_validation_features(enables)
            .disabled_validation_features(disables);
        let mut create = vk::InstanceCreateInfo::default().application_info(&app);
        if debug_utils {
            create = create.enabled_extension_names(&extension_names);
        }
        if validate {
            create = create.enabled_layer_names(&layer_names).push_next(&mut features);
        }
        // SAFETY: `create` and what it points to live through the call.
        let instance = unsafe { entry.create_instance(&create, None) }
            .map_err(|e| Error::NoDevice(format!("no Vulkan instance: {e}")))?;

        let messages = Arc::new(Mutex::new(Vec::new()));
        let messenger = validate.then(|| listen(&entry, &instance, &messages)).transpose()?;
        let (physical, info) = match choose(&instance, options.device.as_deref()) {
            Ok(found) => found,
            Err(e) => {
                // SAFETY: nothing but the messenger was made from the instance.
                unsafe {
                    if let Some((debug, m)) = &messenger {
                        debug.destroy_debug_utils_messenger(*m, None);
                    }
                    instance.destroy_instance(None);
                }
                return Err(e);
            }
        };
        let shared = open(entry, instance, physical, info, debug_utils, messages, messenger)?;
        Ok(Gpu { shared: Arc::new(shared) })
    }

    /// What the open device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Validation messages so far; empty without validation.
    pub fn messages(&self) -> Vec<String> {
        lock(&self.shared.messages).clone()
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

    /// Bytes that live buffers and images hold in each heap, by the heap's number and kind.
    pub fn heap_report(&self) -> Vec<(String, u64)> {
        let bytes = lock(&self.shared.heap_bytes);
        let name = |k: usize, local: bool| format!("{k} {}", if local { "device-local" } else { "host" });
        let heaps = &self.shared.memory.memory_heaps[..self.shared.memory.memory_heap_count as usize];
        let local = |h: &vk::MemoryHeap| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        heaps.iter().enumerate().map(|(k, h)| (name(k, local(h)), bytes[k])).collect()
    }

    /// Waits for the device, then reports what should not be: validation messages and live allocations.
    /// Call it when every resource has been dropped.
    ///
    /// # Errors
    /// [`Error::Validation`] with every message; [`Error::Check`] with the names of what is still allocated.
    pub fn close(self) -> Result<()> {
        // SAFETY: the device is alive; no other thread submits.
        unsafe { self.shared.device.device_wait_idle() }.map_err(device_error("waiting for the device"))?;
        self.shared.collect(u64::MAX);
        let messages = self.messages();
        if !messages.is_empty() {
            let mut text = format!("{} validation message(s):", messages.len());
            // A message that every pass repeats is shown once.
            let mut shown = std::collections::HashSet::new();
            for m in messages.iter().filter(|m| shown.insert(m.as_str())) {
                text += &format!("\n{}", m.trim_end());
            }
            return Err(Error::Validation(text));
        }
        let live = self.memory_report();
        if !live.is_empty() {
            let names: Vec<String> = live.iter().map(|(n, b)| format!("{n} ({b} bytes)")).collect();
            return Err(Error::Check(format!("still allocated at exit: {}", names.join(", "))));
        }
        Ok(())
    }
}

fn listen(
    entry: &ash::Entry,
    instance: &ash::Instance,
    messages: &Arc<Mutex<Vec<String>>>,
) -> Result<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)> {
    let debug = ext::debug_utils::Instance::new(entry, instance);
    let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
        )
        // Not PERFORMANCE: it dislikes images in GENERAL layout, which is a choice here.
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(messages) as *mut c_void);
    // SAFETY: `messages` is kept by `Shared` until after the messenger is destroyed.
    let messenger = unsafe { debug.create_debug_utils_messenger(&create, None) }
        .map_err(device_error("debug messenger"))?;
    Ok((debug, messenger))
}

/// Keeps a validation message.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data; `user` is the message list that `Shared` keeps alive.
    unsafe {
        let text = CStr::from_ptr((*data).p_message).to_string_lossy().into_owned();
        lock(&*(user as *const Mutex<Vec<String>>)).push(text);
    }
    vk::FALSE
}

fn open(
    entry: ash::Entry,
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    info: DeviceInfo,
    debug_utils: bool,
    messages: Arc<Mutex<Vec<String>>>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
) -> Result<Shared> {
    // SAFETY: instance and physical device are alive throughout; every create struct outlives its call.
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
        let calibration = calibration_extension(&entry, &instance, physical);
        let extensions: Vec<_> =
            [Some(khr::push_descriptor::NAME), calibration].into_iter().flatten().map(CStr::as_ptr).collect();
        let features =
            vk::PhysicalDeviceFeatures::default().pipeline_statistics_query(info.pipeline_statistics);
        let mut f12 =
            vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true).shader_output_layer(true);
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
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let timeline = device
            .create_semaphore(&vk::SemaphoreCreateInfo::default().push_next(&mut kind), None)
            .map_err(device_error("timeline semaphore"))?;
        let pool = device
            .create_command_pool(&vk::CommandPoolCreateInfo::default().queue_family_index(family), None)
            .map_err(device_error("command pool"))?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|e| Error::Device(format!("allocator: {e}")))?;
        let samplers = make_samplers(&device)?;
        debug_assert_eq!(samplers.len(), Sampler::ALL.len());
        let calibration = calibration.map(|name| {
            if name == khr::calibrated_timestamps::NAME {
                Calibration::Khr(khr::calibrated_timestamps::Device::new(&instance, &device))
            } else {
                Calibration::Ext(ext::calibrated_timestamps::Device::new(&instance, &device))
            }
        });
        let valid_bits = families[family as usize].timestamp_valid_bits;
        Ok(Shared {
            timing: TimingState { calibration, valid_bits, ..TimingState::default() },
            push: khr::push_descriptor::Device::new(&instance, &device),
            names: debug_utils.then(|| ext::debug_utils::Device::new(&instance, &device)),
            queue: device.get_device_queue(family, 0),
            device,
            pool,
            timeline,
            submitted: AtomicU64::new(0),
            allocator: Mutex::new(Some(allocator)),
            retired: Mutex::new(Vec::new()),
            memory: instance.get_physical_device_memory_properties(physical),
            heap_bytes: Mutex::new([0; vk::MAX_MEMORY_HEAPS]),
            samplers,
            info,
            messages,
            messenger,
            instance,
            _entry: entry,
        })
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
        // before the device, the device before the instance.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.collect(u64::MAX);
            drop(lock(&self.allocator).take());
            self.timing.destroy(&self.device);
            for s in &self.samplers {
                self.device.destroy_sampler(*s, None);
            }
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_semaphore(self.timeline, None);
            self.device.destroy_device(None);
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
