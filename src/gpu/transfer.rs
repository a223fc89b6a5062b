//! Uploads and read-backs outside frames: staged, and waited for. Those of a frame are recorded in it.

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

use super::context::{Gpu, device_error};
use super::memory::{Buffer, Image};
use crate::{Error, Result};

impl Gpu {
    /// A device-local buffer with this content.
    ///
    /// # Errors
    /// As [`Gpu::buffer`].
    pub fn buffer_with<T: Pod>(&self, name: &str, content: &[T]) -> Result<Buffer> {
        let buffer = self.buffer(name, size_of_val(content) as u64)?;
        self.upload(&buffer, 0, content)?;
        Ok(buffer)
    }

    /// Writes `content` into `buffer` from byte `offset` on, and waits.
    ///
    /// # Errors
    /// [`Error::Usage`] if it does not fit; [`Error::Device`] if the device fails.
    pub fn upload<T: Pod>(&self, buffer: &Buffer, offset: u64, content: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(content);
        if offset + bytes.len() as u64 > buffer.bytes() {
            return Err(Error::Usage(format!("upload of {} bytes at {offset} is too long", bytes.len())));
        }
        if bytes.is_empty() {
            return Ok(());
        }
        let staging = self.staging(bytes)?;
        let region = [vk::BufferCopy { src_offset: 0, dst_offset: offset, size: bytes.len() as u64 }];
        self.immediate(|device, cmd| {
            // SAFETY: both buffers are alive and the region is in range of both.
            unsafe { device.cmd_copy_buffer(cmd, staging.handle, buffer.handle, &region) };
        })
    }

    /// Writes one mip level of all layers (or of `layers` from `first` on; of a volume, all slices of its only layer), rows
    /// tightly packed, and waits.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn upload_image(
        &self,
        image: &Image,
        level: u32,
        first: u32,
        layers: u32,
        texels: &[u8],
    ) -> Result<()> {
        let staging = self.staging(texels)?;
        let region = [copy_region(image, level, first, layers)];
        self.immediate(|device, cmd| {
            // SAFETY: both are alive; the staging buffer holds the whole region; the image is in GENERAL.
            unsafe {
                device.cmd_copy_buffer_to_image(
                    cmd,
                    staging.handle,
                    image.handle,
                    vk::ImageLayout::GENERAL,
                    &region,
                )
            };
        })
    }

    /// The content of a buffer.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails; [`Error::Usage`] if the range is outside the buffer.
    pub fn read<T: Pod>(&self, buffer: &Buffer, offset: u64, count: usize) -> Result<Vec<T>> {
        let bytes = (count * size_of::<T>()) as u64;
        if offset + bytes > buffer.bytes() {
            return Err(Error::Usage(format!("reading {bytes} bytes at {offset} is too long")));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let mut staging = self.make_buffer("read-back", bytes, MemoryLocation::GpuToCpu)?;
        let region = [vk::BufferCopy { src_offset: offset, dst_offset: 0, size: bytes }];
        self.immediate(|device, cmd| {
            // SAFETY: both buffers are alive and the region is in range of both.
            unsafe { device.cmd_copy_buffer(cmd, buffer.handle, staging.handle, &region) };
        })?;
        Ok(bytemuck::pod_collect_to_vec(&staging.mapped()?[..bytes as usize]))
    }

    /// The texels of one layer and level of an image, rows tightly packed.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails; [`Error::Usage`] if `T` is not a texel of the image.
    pub fn read_image<T: Pod>(&self, image: &Image, level: u32, layer: u32) -> Result<Vec<T>> {
        let [w, h] = image.size().map(|n| (n >> level).max(1) as usize);
        let bytes = w * h * image.depth() as usize * texel_bytes(image.format())?;
        let mut staging = self.make_buffer("read-back", bytes as u64, MemoryLocation::GpuToCpu)?;
        let region = [copy_region(image, level, layer, 1)];
        self.immediate(|device, cmd| {
            // SAFETY: both are alive; the buffer holds the whole region; the image is in GENERAL.
            unsafe {
                device.cmd_copy_image_to_buffer(
                    cmd,
                    image.handle,
                    vk::ImageLayout::GENERAL,
                    staging.handle,
                    &region,
                )
            };
        })?;
        Ok(bytemuck::pod_collect_to_vec(&staging.mapped()?[..bytes]))
    }

    fn staging(&self, bytes: &[u8]) -> Result<Buffer> {
        let mut staging = self.make_buffer("staging", bytes.len() as u64, MemoryLocation::CpuToGpu)?;
        staging.mapped()?[..bytes.len()].copy_from_slice(bytes);
        Ok(staging)
    }

    /// Records, submits and waits; for work outside the frame.
    pub(super) fn immediate(&self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Result<()> {
        let s = &self.shared;
        let allocate = vk::CommandBufferAllocateInfo::default()
            .command_pool(s.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is used by one thread at a time (the recorder borrows the Gpu on this one); the command
        // buffer is freed only after the wait.
        unsafe {
            let free = s.failures.memory();
            let cmd = free
                .and_then(|()| s.device.allocate_command_buffers(&allocate))
                .map_err(device_error("command buffer"))?[0];
            let begin =
                vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            let free = s.failures.memory();
            let recorded = free.and_then(|()| s.device.begin_command_buffer(cmd, &begin)).and_then(|()| {
                super::record::barrier(&s.device, cmd);
                record(&s.device, cmd);
                super::record::barrier(&s.device, cmd);
                s.failures.memory().and_then(|()| s.device.end_command_buffer(cmd))
            });
            let done = recorded.map_err(device_error("recording")).and_then(|()| self.submit(cmd));
            s.device.free_command_buffers(s.pool, &[cmd]);
            done
        }
    }
}

fn copy_region(image: &Image, level: u32, first: u32, layers: u32) -> vk::BufferImageCopy {
    let [w, h] = image.size().map(|n| (n >> level).max(1));
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: image.aspect(),
            mip_level: level,
            base_array_layer: first,
            layer_count: layers,
        })
        .image_extent(vk::Extent3D { width: w, height: h, depth: image.depth() })
}

pub(super) fn texel_bytes(format: vk::Format) -> Result<usize> {
    Ok(match format {
        vk::Format::R8_UNORM | vk::Format::R8_UINT => 1,
        vk::Format::R8G8B8A8_UNORM
        | vk::Format::R8G8B8A8_SNORM
        | vk::Format::R8G8B8A8_SRGB
        | vk::Format::R32_UINT
        | vk::Format::R32_SFLOAT
        | vk::Format::R16G16_SFLOAT
        | vk::Format::D32_SFLOAT => 4,
        vk::Format::R16G16B16A16_SFLOAT => 8,
        vk::Format::R32G32B32A32_SFLOAT => 16,
        other => return Err(Error::Usage(format!("images of format {other:?} are not read back"))),
    })
}
