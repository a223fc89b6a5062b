//! Buffers and images. Each is named, counted by the allocator, and retired when dropped.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};

use super::context::{Gpu, Shared, device_error, lock};
use super::record::Layers;
use crate::{Error, Result};

/// A buffer on the device, or visible to the host for transfers.
pub struct Buffer {
    shared: Arc<Shared>,
    pub(super) handle: vk::Buffer,
    /// View through which shaders read it as texels; null if they do not.
    pub(super) texels: vk::BufferView,
    allocation: Option<Allocation>,
    bytes: u64,
}

/// What an image is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageDesc<'a> {
    /// Name in captures and reports.
    pub name: &'a str,
    /// Texel format.
    pub format: vk::Format,
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Array layers.
    pub layers: u32,
    /// Mip levels.
    pub levels: u32,
    /// Samples a texel.
    pub samples: u32,
    /// What it is for, besides transfers and sampling.
    pub usage: vk::ImageUsageFlags,
}

/// An image with one view of everything (as an array, or a volume), always in `GENERAL` layout; storage images with mip
/// levels have one more of each level.
pub struct Image {
    shared: Arc<Shared>,
    pub(super) handle: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) level_views: Vec<vk::ImageView>,
    /// Views of single layers, of depth images with several where vertices do not choose among them.
    layer_views: Vec<vk::ImageView>,
    allocation: Option<Allocation>,
    format: vk::Format,
    size: [u32; 2],
    depth: u32,
    layers: u32,
    levels: u32,
}

/// A resource waiting for its last submission.
pub(super) enum Retired {
    Buffer(vk::Buffer, vk::BufferView, Allocation),
    Image(vk::Image, Vec<vk::ImageView>, Allocation),
    Program(vk::Pipeline, vk::PipelineLayout, vk::DescriptorSetLayout),
    Pool(vk::DescriptorPool),
    Commands(vk::CommandPool),
    Queries(vk::QueryPool),
}

impl Retired {
    /// Destroys the resource; the device must be done with it.
    pub fn destroy(self, shared: &Shared) {
        // SAFETY: the caller has waited for the last submission that could use the handles, and owns them.
        unsafe {
            let allocation = match self {
                Retired::Buffer(b, view, a) => {
                    shared.device.destroy_buffer_view(view, None);
                    shared.device.destroy_buffer(b, None);
                    a
                }
                Retired::Image(i, views, a) => {
                    for view in views {
                        shared.device.destroy_image_view(view, None);
                    }
                    shared.device.destroy_image(i, None);
                    a
                }
                Retired::Pool(pool) => {
                    shared.device.destroy_descriptor_pool(pool, None);
                    return;
                }
                Retired::Commands(pool) => {
                    shared.device.destroy_command_pool(pool, None);
                    return;
                }
                Retired::Queries(pool) => {
                    shared.device.destroy_query_pool(pool, None);
                    return;
                }
                Retired::Program(p, l, s) => {
                    shared.device.destroy_pipeline(p, None);
                    shared.device.destroy_pipeline_layout(l, None);
                    shared.device.destroy_descriptor_set_layout(s, None);
                    return;
                }
            };
            lock(&shared.heap_bytes)[shared.heap_of(&allocation)] -= allocation.size();
            if let Some(allocator) = lock(&shared.allocator).as_mut() {
                // Freeing fails only for foreign allocations; these are all ours.
                let _ = allocator.free(allocation);
            }
        }
    }
}

impl Gpu {
    /// A device-local buffer of at least `bytes`, for storage, uniforms, indices, indirect commands and transfers.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory; [`Error::Usage`] for a buffer larger than the device can bind.
    pub fn buffer(&self, name: &str, bytes: u64) -> Result<Buffer> {
        if bytes > self.info().max_storage_bytes {
            return Err(Error::Usage(format!(
                "buffer \"{name}\" needs {bytes} bytes; {} binds at most {}",
                self.info().name,
                self.info().max_storage_bytes
            )));
        }
        self.make_buffer(name, bytes, MemoryLocation::GpuOnly)
    }

    /// The same, which shaders may also read as an array of texels of `texel` bytes and a format, where the device reads so many.
    /// Where drivers run shaders on the CPU, that takes a fraction of what reading a storage buffer does.
    ///
    /// # Errors
    /// As [`Gpu::buffer`].
    pub fn texel_buffer(&self, name: &str, bytes: u64, (format, texel): (vk::Format, u64)) -> Result<Buffer> {
        let mut buffer = self.buffer(name, bytes)?;
        // Plans leave what reads texels out where there are too many.
        if buffer.bytes / texel > u64::from(self.info().max_texel_elements) {
            return Ok(buffer);
        }
        let s = &self.shared;
        let create =
            vk::BufferViewCreateInfo::default().buffer(buffer.handle).format(format).range(vk::WHOLE_SIZE);
        let free = s.failures.memory();
        let made = free.and_then(|()| {
            // SAFETY: the device and the buffer are alive; dropping the buffer destroys the view with it.
            unsafe { s.device.create_buffer_view(&create, None) }
        });
        buffer.texels = made.map_err(device_error(name))?;
        s.name(buffer.texels, name);
        Ok(buffer)
    }

    pub(super) fn make_buffer(&self, name: &str, bytes: u64, location: MemoryLocation) -> Result<Buffer> {
        let s = &self.shared;
        let bytes = bytes.max(16).next_multiple_of(16);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::INDEX_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let create = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device is alive; on failure the handle is destroyed before returning.
        unsafe {
            let free = s.failures.memory();
            let handle =
                free.and_then(|()| s.device.create_buffer(&create, None)).map_err(device_error(name))?;
            let requirements = s.device.get_buffer_memory_requirements(handle);
            let allocation = match self.allocate(name, requirements, location, true) {
                Ok(a) => a,
                Err(e) => {
                    s.device.destroy_buffer(handle, None);
                    return Err(e);
                }
            };
            let free = s.failures.memory();
            let bound = free
                .and_then(|()| s.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()));
            s.name(handle, name);
            let texels = vk::BufferView::null();
            let buffer = Buffer { shared: s.clone(), handle, texels, allocation: Some(allocation), bytes };
            bound.map_err(device_error(name))?;
            Ok(buffer)
        }
    }

    /// An image in `GENERAL` layout, with undefined content.
    ///
    /// # Errors
    /// [`Error::Usage`] for sizes beyond the device's limits; [`Error::Device`] when out of memory.
    pub fn image(&self, d: &ImageDesc) -> Result<Image> {
        let i = self.info();
        if d.size.iter().any(|n| *n == 0 || *n > i.max_image_side) || d.layers == 0 || d.layers > i.max_layers
        {
            return Err(Error::Usage(format!(
                "image \"{}\" of {}x{}, {} layers: {} takes 1 to {} texels a side and {} layers",
                d.name, d.size[0], d.size[1], d.layers, i.name, i.max_image_side, i.max_layers
            )));
        }
        self.make_image(d, 1)
    }

    /// A volume of one mip level for sampling, in `GENERAL` layout, with undefined content.
    ///
    /// # Errors
    /// As [`Gpu::image`].
    pub fn volume(&self, name: &str, format: vk::Format, size: [u32; 3]) -> Result<Image> {
        let i = self.info();
        if size.iter().any(|n| *n == 0 || *n > i.max_volume_side) {
            return Err(Error::Usage(format!(
                "volume \"{name}\" of {} x {} x {}; {} takes 1 to {} texels a side",
                size[0], size[1], size[2], i.name, i.max_volume_side
            )));
        }
        let [width, height, depth] = size;
        let usage = vk::ImageUsageFlags::empty();
        self.make_image(
            &ImageDesc { name, format, size: [width, height], layers: 1, levels: 1, samples: 1, usage },
            depth,
        )
    }

    fn make_image(&self, d: &ImageDesc, depth: u32) -> Result<Image> {
        let s = &self.shared;
        let (kind, view_kind) = if depth > 1 {
            (vk::ImageType::TYPE_3D, vk::ImageViewType::TYPE_3D)
        } else {
            (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D_ARRAY)
        };
        let create = vk::ImageCreateInfo::default()
            .image_type(kind)
            .format(d.format)
            .extent(vk::Extent3D { width: d.size[0], height: d.size[1], depth })
            .mip_levels(d.levels)
            .array_layers(d.layers)
            .samples(vk::SampleCountFlags::from_raw(d.samples))
            .usage(
                d.usage
                    | if d.samples == 1 {
                        vk::ImageUsageFlags::SAMPLED
                            | vk::ImageUsageFlags::TRANSFER_SRC
                            | vk::ImageUsageFlags::TRANSFER_DST
                    } else {
                        vk::ImageUsageFlags::empty()
                    },
            );
        let aspect = if d.format == vk::Format::D32_SFLOAT {
            vk::ImageAspectFlags::DEPTH
        } else {
            vk::ImageAspectFlags::COLOR
        };
        // SAFETY: the device is alive; on failure the handles made so far are destroyed before returning.
        let image = unsafe {
            let free = s.failures.memory();
            let handle =
                free.and_then(|()| s.device.create_image(&create, None)).map_err(device_error(d.name))?;
            let requirements = s.device.get_image_memory_requirements(handle);
            let allocation = match self.allocate(d.name, requirements, MemoryLocation::GpuOnly, false) {
                Ok(a) => a,
                Err(e) => {
                    s.device.destroy_image(handle, None);
                    return Err(e);
                }
            };
            let free = s.failures.memory();
            let bound = free
                .and_then(|()| s.device.bind_image_memory(handle, allocation.memory(), allocation.offset()));
            let view = vk::ImageViewCreateInfo::default()
                .image(handle)
                .view_type(view_kind)
                .format(d.format)
                .subresource_range(whole(aspect));
            let view = bound
                .and_then(|()| s.failures.memory())
                .and_then(|()| s.device.create_image_view(&view, None));
            let mut image = Image {
                shared: s.clone(),
                handle,
                view: view.unwrap_or_default(),
                level_views: Vec::new(),
                layer_views: Vec::new(),
                allocation: Some(allocation),
                format: d.format,
                size: d.size,
                depth,
                layers: d.layers,
                levels: d.levels,
            };
            view.map_err(device_error(d.name))?;
            s.name(handle, d.name);
            s.name(image.view, d.name);
            let one = |range: vk::ImageSubresourceRange| {
                let create = vk::ImageViewCreateInfo::default()
                    .image(handle)
                    .view_type(vk::ImageViewType::TYPE_2D_ARRAY)
                    .format(d.format)
                    .subresource_range(range);
                let made = s.failures.memory().and_then(|()| s.device.create_image_view(&create, None));
                made.map_err(device_error(d.name))
            };
            if d.levels > 1 && d.usage.contains(vk::ImageUsageFlags::STORAGE) {
                for level in 0..d.levels {
                    let range =
                        vk::ImageSubresourceRange { base_mip_level: level, level_count: 1, ..whole(aspect) };
                    image.level_views.push(one(range)?);
                }
            }
            if d.layers > 1 && aspect == vk::ImageAspectFlags::DEPTH && !self.info().vertex_layers {
                for layer in 0..d.layers {
                    let range = vk::ImageSubresourceRange {
                        base_array_layer: layer,
                        layer_count: 1,
                        ..whole(aspect)
                    };
                    image.layer_views.push(one(range)?);
                }
            }
            image
        };
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::GENERAL)
            .image(image.handle)
            .subresource_range(whole(aspect))];
        self.immediate(|device, cmd| {
            let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
            // SAFETY: the command buffer is being recorded and the image is alive.
            unsafe { device.cmd_pipeline_barrier2(cmd, &dependency) };
        })?;
        Ok(image)
    }

    fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let what = format!("{name}, {} bytes", requirements.size);
        self.shared.failures.memory().map_err(device_error(&what))?;
        let mut guard = lock(&self.shared.allocator);
        let allocator = guard.as_mut().ok_or_else(|| Error::Device("the device is closing".into()))?;
        let allocation = allocator
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|e| match e {
                AllocationError::OutOfMemory => device_error(&what)(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY),
                other => Error::Device(format!("{what}: {other}")),
            })?;
        lock(&self.shared.heap_bytes)[self.shared.heap_of(&allocation)] += allocation.size();
        Ok(allocation)
    }
}

fn whole(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}

impl Buffer {
    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The mapped bytes of a host-visible buffer.
    pub(super) fn mapped(&mut self) -> Result<&mut [u8]> {
        self.allocation
            .as_mut()
            .and_then(|a| a.mapped_slice_mut())
            .ok_or_else(|| Error::Device("a transfer buffer is not visible to the host".into()))
    }
}

impl Image {
    /// Width and height of level 0, texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Slices of a volume; 1 otherwise.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Array layers.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Mip levels.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// Texel format.
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// The view for drawing to layers.
    pub(super) fn drawn(&self, layers: Layers) -> vk::ImageView {
        match layers {
            Layers::One(layer) => self.layer_views.get(layer as usize).copied().unwrap_or(self.view),
            Layers::Chosen(_) => self.view,
        }
    }

    pub(super) fn aspect(&self) -> vk::ImageAspectFlags {
        if self.format == vk::Format::D32_SFLOAT {
            vk::ImageAspectFlags::DEPTH
        } else {
            vk::ImageAspectFlags::COLOR
        }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(a) = self.allocation.take() {
            self.shared.retire(Retired::Buffer(self.handle, self.texels, a));
        }
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        if let Some(a) = self.allocation.take() {
            let mut views = std::mem::take(&mut self.level_views);
            views.append(&mut self.layer_views);
            views.push(self.view);
            self.shared.retire(Retired::Image(self.handle, views, a));
        }
    }
}
