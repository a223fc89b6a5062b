//! Which Vulkan device to use, and why the others do not fit.

use std::ffi::CStr;

use ash::vk;

use super::instance::Plain;
use super::{Shader, shaders};
use crate::{Error, Result};

/// What a device is and can do, as far as it matters here.
#[derive(Clone, Debug, serde::Serialize)]
pub struct DeviceInfo {
    /// Marketing name.
    pub name: String,
    /// Device UUID in hexadecimal, for `--device`.
    pub uuid: String,
    /// Kind: `cpu`, `integrated`, `discrete`, `virtual` or `other`.
    pub kind: &'static str,
    /// Driver name and version as the driver states them.
    pub driver: String,
    /// Vulkan version, `major.minor.patch`.
    pub api: String,
    /// Largest side of a 2D image, texels.
    pub max_image_side: u32,
    /// Largest side of a 3D image, texels.
    pub max_volume_side: u32,
    /// Most layers of an image array.
    pub max_layers: u32,
    /// Largest storage buffer, bytes.
    pub max_storage_bytes: u64,
    /// Most texels that shaders read of a buffer.
    pub max_texel_elements: u32,
    /// Sum of the device-local heaps, bytes.
    pub device_bytes: u64,
    /// Sample counts that colours, integers and depth all take, as a bit mask (1 | 4 | 8 …).
    pub sample_counts: u32,
    /// Nanoseconds a timestamp tick.
    pub timestamp_ns: f32,
    /// It counts what the pipeline does.
    pub pipeline_statistics: bool,
    /// Most components that a vertex shader passes on: the graphics rasteriser of trees takes [`tree_components`].
    pub max_vertex_components: u32,
    /// Resources are bound with the commands that use them; otherwise from pools, which takes a little longer.
    pub push_descriptors: bool,
    /// Vertex shaders choose the layer that they draw to; otherwise each layer is drawn by itself.
    pub vertex_layers: bool,
    /// It takes indexed draws as many as a shader has counted, each with a first instance of its own; otherwise they are recorded one by one.
    pub counted_draws: bool,
    /// Why canopy cannot use it; empty if it can.
    pub missing: Vec<String>,
}

/// Every Vulkan device of this machine, fit or not.
///
/// # Errors
/// [`Error::NoDevice`] if there is no Vulkan loader or the instance cannot be made.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    Ok(all(&Plain::get()?.instance)?.into_iter().map(|(_, info)| info).collect())
}

/// The device that [`super::Gpu::new`] would open, unopened.
///
/// # Errors
/// [`Error::NoDevice`] with the reason for every device when none fits.
pub fn find(wanted: Option<&str>) -> Result<DeviceInfo> {
    choose(&Plain::get()?.instance, wanted).map(|(_, info)| info)
}

fn all(instance: &ash::Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
    // SAFETY: the instance is alive.
    let physical = unsafe { instance.enumerate_physical_devices() }
        .map_err(|e| Error::NoDevice(format!("cannot list Vulkan devices: {e}")))?;
    Ok(physical.into_iter().map(|p| (p, describe(instance, p))).collect())
}

/// The device that `wanted` names (UUID or part of the name), or else the best that fits: GPUs before CPUs.
pub(super) fn choose(
    instance: &ash::Instance,
    wanted: Option<&str>,
) -> Result<(vk::PhysicalDevice, DeviceInfo)> {
    let all = all(instance)?;
    if all.is_empty() {
        return Err(Error::NoDevice(
            "no Vulkan device: install a driver (on Debian: apt-get install mesa-vulkan-drivers)".into(),
        ));
    }
    let simplified = |s: &str| s.to_lowercase().replace('-', "");
    let named = |i: &DeviceInfo| {
        wanted.is_none_or(|w| {
            simplified(&i.uuid) == simplified(w) || i.name.to_lowercase().contains(&w.to_lowercase())
        })
    };
    let rank = |i: &DeviceInfo| match i.kind {
        "discrete" => 0,
        "integrated" => 1,
        "virtual" => 2,
        _ => 3,
    };
    let best = all.iter().filter(|(_, i)| named(i) && i.missing.is_empty()).min_by_key(|(_, i)| rank(i));
    best.cloned().ok_or_else(|| {
        let mut text = match wanted {
            Some(w) => format!("no Vulkan device fits --device {w}:"),
            None => "no Vulkan device fits:".to_string(),
        };
        for (_, i) in &all {
            let reason = if i.missing.is_empty() {
                "is not the one named".to_string()
            } else {
                format!("lacks {}", i.missing.join(", "))
            };
            text += &format!("\n  {} ({}): {reason}", i.name, i.uuid);
        }
        Error::NoDevice(text)
    })
}

/// Components that the vertex shader of the graphics rasteriser's trees passes on.
pub fn tree_components() -> u32 {
    4 * shaders::FRAME_TREES_ZFIELD_VERT.locations
}

/// Which limits are under what the shaders take, and by how much. What Vulkan promises everywhere is not asked for.
fn short(l: &vk::PhysicalDeviceLimits) -> Vec<String> {
    let most = |of: &dyn Fn(&Shader) -> u32| shaders::ALL.iter().map(|s| of(s)).max().unwrap_or(0);
    let kinds = |s: &Shader, kinds: &[vk::DescriptorType]| {
        s.bindings.iter().filter(|b| kinds.contains(&b.kind)).count() as u32
    };
    let sampled = [vk::DescriptorType::COMBINED_IMAGE_SAMPLER, vk::DescriptorType::UNIFORM_TEXEL_BUFFER];
    // Trees in the graphics pipeline are left to devices that pass so much on; everything else is not.
    let trees = shaders::FRAME_TREES_ZFIELD_VERT.name;
    let components = |s: &Shader| if s.name == trees { 0 } else { 4 * s.locations };
    let all = [
        ("maxPushConstantsSize", l.max_push_constants_size, most(&|s| s.push_constant_bytes)),
        (
            "maxPerStageDescriptorStorageBuffers",
            l.max_per_stage_descriptor_storage_buffers,
            most(&|s| kinds(s, &[vk::DescriptorType::STORAGE_BUFFER])),
        ),
        (
            "maxPerStageDescriptorUniformBuffers",
            l.max_per_stage_descriptor_uniform_buffers,
            most(&|s| kinds(s, &[vk::DescriptorType::UNIFORM_BUFFER])),
        ),
        (
            "maxPerStageDescriptorSampledImages",
            l.max_per_stage_descriptor_sampled_images,
            most(&|s| kinds(s, &sampled)),
        ),
        (
            "maxPerStageDescriptorStorageImages",
            l.max_per_stage_descriptor_storage_images,
            most(&|s| kinds(s, &[vk::DescriptorType::STORAGE_IMAGE])),
        ),
        ("maxPerStageResources", l.max_per_stage_resources, most(&|s| s.bindings.len() as u32)),
        ("maxComputeWorkGroupInvocations", l.max_compute_work_group_invocations, most(&|s| s.invocations)),
        (
            "maxVertexOutputComponents",
            l.max_vertex_output_components.min(l.max_fragment_input_components),
            most(&components),
        ),
        ("maxColorAttachments", l.max_color_attachments, 4),
    ];
    let short = all.into_iter().filter(|(_, has, takes)| has < takes);
    short.map(|(name, has, takes)| format!("{name} {takes} (has {has})")).collect()
}

/// Sample counts that all multisampled targets take: colours, what samples see, and depth.
fn sample_counts(instance: &ash::Instance, p: vk::PhysicalDevice) -> vk::SampleCountFlags {
    use vk::ImageUsageFlags as Usage;
    let targets = [
        (vk::Format::R16G16B16A16_SFLOAT, Usage::COLOR_ATTACHMENT | Usage::SAMPLED),
        (vk::Format::R32_UINT, Usage::COLOR_ATTACHMENT | Usage::SAMPLED),
        (vk::Format::D32_SFLOAT, Usage::DEPTH_STENCIL_ATTACHMENT | Usage::SAMPLED),
    ];
    let (kind, tiling, flags) =
        (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL, vk::ImageCreateFlags::empty());
    let counts = targets.map(|(format, usage)| {
        // SAFETY: the instance and device are alive.
        let found = unsafe {
            instance.get_physical_device_image_format_properties(p, format, kind, tiling, usage, flags)
        };
        found.map_or(vk::SampleCountFlags::empty(), |f| f.sample_counts)
    });
    counts.into_iter().fold(vk::SampleCountFlags::from_raw(u32::MAX), |all, counts| all & counts)
}

fn describe(instance: &ash::Instance, p: vk::PhysicalDevice) -> DeviceInfo {
    // SAFETY: the instance and device are alive; each chain is built of fresh structs.
    let (base, memory, families, extensions) = unsafe {
        (
            instance.get_physical_device_properties(p),
            instance.get_physical_device_memory_properties(p),
            instance.get_physical_device_queue_family_properties(p),
            instance.enumerate_device_extension_properties(p).unwrap_or_default(),
        )
    };
    let text = |c: &[std::ffi::c_char]| {
        let bytes: Vec<u8> = c.iter().take_while(|b| **b != 0).map(|b| *b as u8).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let mut missing = Vec::new();
    let (mut pipeline_statistics, mut vertex_layers, mut counted_draws) = (false, false, false);
    let (mut id, mut driver) =
        (vk::PhysicalDeviceIDProperties::default(), vk::PhysicalDeviceDriverProperties::default());
    let api = base.api_version;
    if api < vk::API_VERSION_1_3 {
        missing.push("Vulkan 1.3".to_string());
    } else {
        let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut f = vk::PhysicalDeviceFeatures2::default().push_next(&mut f12).push_next(&mut f13);
        let mut props = vk::PhysicalDeviceProperties2::default().push_next(&mut id).push_next(&mut driver);
        // SAFETY: as above.
        unsafe {
            instance.get_physical_device_features2(p, &mut f);
            instance.get_physical_device_properties2(p, &mut props);
        }
        let several =
            [f.features.multi_draw_indirect, f.features.draw_indirect_first_instance] == [vk::TRUE; 2];
        pipeline_statistics = f.features.pipeline_statistics_query == vk::TRUE;
        vertex_layers = f12.shader_output_layer == vk::TRUE;
        counted_draws = several && f12.draw_indirect_count == vk::TRUE;
        for (has, what) in [
            (f13.synchronization2, "synchronization2"),
            (f13.dynamic_rendering, "dynamicRendering"),
            (f13.maintenance4, "maintenance4"),
            (f12.timeline_semaphore, "timelineSemaphore"),
        ] {
            if has == vk::FALSE {
                missing.push(what.to_string());
            }
        }
    }
    let push_descriptors =
        extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::khr::push_descriptor::NAME));
    let all_work = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    if !families.iter().any(|q| q.queue_flags.contains(all_work) && q.timestamp_valid_bits > 0) {
        missing.push("a graphics and compute queue with timestamps".to_string());
    }
    let l = &base.limits;
    missing.extend(short(l));
    let driver_name = text(&driver.driver_name);
    // SAFETY: driver_info is a NUL-terminated array filled by the driver, or zeros.
    let driver_info = unsafe { CStr::from_ptr(driver.driver_info.as_ptr()) }.to_string_lossy().into_owned();
    DeviceInfo {
        name: text(&base.device_name),
        uuid: id.device_uuid.iter().map(|b| format!("{b:02x}")).collect(),
        kind: match base.device_type {
            vk::PhysicalDeviceType::CPU => "cpu",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            _ => "other",
        },
        driver: format!("{driver_name} {driver_info}").trim().to_string(),
        api: format!(
            "{}.{}.{}",
            vk::api_version_major(api),
            vk::api_version_minor(api),
            vk::api_version_patch(api)
        ),
        max_image_side: l.max_image_dimension2_d,
        max_volume_side: l.max_image_dimension3_d,
        max_layers: l.max_image_array_layers,
        max_storage_bytes: l.max_storage_buffer_range as u64,
        max_texel_elements: l.max_texel_buffer_elements,
        device_bytes: memory.memory_heaps[..memory.memory_heap_count as usize]
            .iter()
            .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|h| h.size)
            .sum(),
        sample_counts: sample_counts(instance, p).as_raw(),
        timestamp_ns: l.timestamp_period,
        pipeline_statistics,
        max_vertex_components: l.max_vertex_output_components.min(l.max_fragment_input_components),
        push_descriptors,
        vertex_layers,
        counted_draws,
        missing,
    }
}
