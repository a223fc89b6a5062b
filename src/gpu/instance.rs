//! The loader, the instance, and what listens to its validation layers.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use ash::{ext, vk};

use super::context::{device_error, lock};
use crate::{Error, Result};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layers watch. Messages are kept for [`super::Gpu::messages`], and [`super::Gpu::close`] fails with them.
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

/// The instance, and what listens to its validation layers.
pub(super) struct Root {
    pub messages: Arc<Mutex<Vec<String>>>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Whether objects can be named.
    pub debug_utils: bool,
    pub instance: ash::Instance,
    /// It is this one's alone, and goes with it; otherwise it is [`Plain`].
    own: bool,
    // Last: the loader must outlive everything made through it.
    pub entry: ash::Entry,
}

impl Root {
    /// The plain instance, or one of its own with the layers that `validation` needs.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a loader or, when validation is asked for, without its layer.
    pub fn new(validation: Validation) -> Result<Self> {
        let Plain { entry, instance, debug_utils } = Plain::get()?;
        if validation == Validation::Off {
            return Ok(Root {
                messages: Arc::default(),
                messenger: None,
                debug_utils,
                instance,
                own: false,
                entry,
            });
        }
        // SAFETY: the loader is loaded.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        if !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION)) {
            return Err(Error::NoDevice(
                "validation was asked for but VK_LAYER_KHRONOS_validation is not installed \
                 (on Debian: apt-get install vulkan-validationlayers)"
                    .into(),
            ));
        }
        let layer_names = [VALIDATION.as_ptr()];
        let (enables, disables) = validation.features();
        let mut features = vk::ValidationFeaturesEXT::default()
            .enabled_validation_features(enables)
            .disabled_validation_features(disables);
        let create =
            vk::InstanceCreateInfo::default().enabled_layer_names(&layer_names).push_next(&mut features);
        let instance = create_instance(&entry, create, true)?;
        let mut root =
            Root { messages: Arc::default(), messenger: None, debug_utils: true, instance, own: true, entry };
        root.messenger = Some(listen(&root.entry, &root.instance, &root.messages)?);
        Ok(root)
    }
}

/// The instance without layers, one for the whole process. It is never destroyed: the loader unloads a driver with its last
/// instance, and NVIDIA's (580) cannot be loaded again after some thirty times, so that a program which opens device after
/// device, as the conformance cases do, would lose it. It is also what watched instances are made beside.
#[derive(Clone)]
pub(super) struct Plain {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    /// Whether objects can be named.
    debug_utils: bool,
}

impl Plain {
    /// Makes it the first time.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a loader or a driver; it is tried again the next time.
    pub fn get() -> Result<Self> {
        static PLAIN: Mutex<Option<Plain>> = Mutex::new(None);
        let mut plain = lock(&PLAIN);
        if let Some(made) = &*plain {
            return Ok(made.clone());
        }
        let entry = load_entry()?;
        // SAFETY: the loader is loaded.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let debug_utils =
            extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        let instance = create_instance(&entry, vk::InstanceCreateInfo::default(), debug_utils)?;
        Ok(plain.insert(Plain { entry, instance, debug_utils }).clone())
    }
}

/// An instance as `create` says, with the extension that names objects if `debug_utils`.
fn create_instance(
    entry: &ash::Entry,
    create: vk::InstanceCreateInfo<'_>,
    debug_utils: bool,
) -> Result<ash::Instance> {
    let app = vk::ApplicationInfo::default()
        .application_name(c"canopy")
        .engine_name(c"canopy")
        .api_version(vk::API_VERSION_1_3);
    let names = [ext::debug_utils::NAME.as_ptr()];
    let names = if debug_utils { &names[..] } else { &[] };
    let create = create.application_info(&app).enabled_extension_names(names);
    // SAFETY: `create` and what it points to live through the call.
    unsafe { entry.create_instance(&create, None) }
        .map_err(|e| Error::NoDevice(format!("no Vulkan instance: {e}")))
}

impl Drop for Root {
    fn drop(&mut self) {
        // SAFETY: `Shared`, the only other user, is gone or was never made: no device and no other child is alive.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            if self.own {
                self.instance.destroy_instance(None);
            }
        }
    }
}

fn load_entry() -> Result<ash::Entry> {
    // SAFETY: the Vulkan loader is a well-behaved library; nothing else runs in its initialisers.
    unsafe { ash::Entry::load() }.map_err(|e| {
        Error::NoDevice(format!(
            "no Vulkan loader ({e}); on Debian: apt-get install libvulkan1 mesa-vulkan-drivers"
        ))
    })
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
    // SAFETY: `messages` is kept by `Root` until after the messenger is destroyed.
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
    // SAFETY: the layer passes valid data; `user` is the message list that `Root` keeps alive.
    unsafe {
        let text = CStr::from_ptr((*data).p_message).to_string_lossy().into_owned();
        lock(&*(user as *const Mutex<Vec<String>>)).push(text);
    }
    vk::FALSE
}
