//! What buffers and images are, before there are any: a plan counts their bytes, and the device makes them of the same.

use ash::vk;
use bytemuck::Pod;

use super::context::Gpu;
use super::memory::{Buffer, ImageDesc};
use super::transfer::texel_bytes;
use crate::{Error, Result};

/// What a buffer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferDesc {
    /// Name in captures and reports.
    pub name: &'static str,
    /// Size, bytes.
    pub bytes: u64,
    /// Format of its texels and their bytes, where shaders read it as an array of such.
    pub texels: Option<(vk::Format, u64)>,
}

/// What a volume of one mip level is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeDesc {
    /// Name in captures and reports.
    pub name: &'static str,
    /// Texel format.
    pub format: vk::Format,
    /// Width, height and depth, texels.
    pub size: [u32; 3],
}

/// What is allocated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Description {
    /// A buffer.
    Buffer(BufferDesc),
    /// An image.
    Image(ImageDesc<'static>),
    /// A volume.
    Volume(VolumeDesc),
}

impl Description {
    /// Name in captures and reports.
    pub fn name(&self) -> &'static str {
        match self {
            Description::Buffer(d) => d.name,
            Description::Image(d) => d.name,
            Description::Volume(d) => d.name,
        }
    }

    /// Bytes of its content; drivers may add some.
    pub fn bytes(&self) -> u64 {
        match self {
            Description::Buffer(d) => d.bytes,
            Description::Image(d) => d.bytes(),
            Description::Volume(d) => texels(d.size) * texel(d.format),
        }
    }
}

impl From<BufferDesc> for Description {
    fn from(d: BufferDesc) -> Self {
        Description::Buffer(d)
    }
}

impl From<ImageDesc<'static>> for Description {
    fn from(d: ImageDesc<'static>) -> Self {
        Description::Image(d)
    }
}

impl From<VolumeDesc> for Description {
    fn from(d: VolumeDesc) -> Self {
        Description::Volume(d)
    }
}

impl BufferDesc {
    /// A buffer that shaders read as such only.
    pub const fn new(name: &'static str, bytes: u64) -> Self {
        BufferDesc { name, bytes, texels: None }
    }
}

impl<'a> ImageDesc<'a> {
    /// An image of one layer, mip level and sample a texel, for sampling.
    pub const fn plain(name: &'a str, format: vk::Format, size: [u32; 2]) -> Self {
        ImageDesc {
            name,
            format,
            size,
            layers: 1,
            levels: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::empty(),
        }
    }

    /// One texel that stands for an image which nobody reads.
    pub const fn stand_in(name: &'a str, format: vk::Format) -> Self {
        Self::plain(name, format, [1; 2])
    }

    /// Bytes of all levels, layers and samples; drivers may add some.
    pub fn bytes(&self) -> u64 {
        let level = |l: u32| texels([self.size[0] >> l, self.size[1] >> l, 1].map(|n| n.max(1)));
        let all: u64 = (0..self.levels).map(level).sum();
        all * u64::from(self.layers) * u64::from(self.samples) * texel(self.format)
    }
}

fn texels(size: [u32; 3]) -> u64 {
    size.map(u64::from).iter().product()
}

/// Bytes of a texel; of a format that is not read back, as many as any has.
fn texel(format: vk::Format) -> u64 {
    texel_bytes(format).map_or(16, |n| n as u64)
}

impl Gpu {
    /// A device-local buffer as described.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and [`Gpu::texel_buffer`].
    pub fn described_buffer(&self, d: &BufferDesc) -> Result<Buffer> {
        match d.texels {
            Some(texels) => self.texel_buffer(d.name, d.bytes, texels),
            None => self.buffer(d.name, d.bytes),
        }
    }

    /// The same with its whole content.
    ///
    /// # Errors
    /// As [`Gpu::described_buffer`]; [`Error::Usage`] for content of another size.
    pub fn described_buffer_with<T: Pod>(&self, d: &BufferDesc, content: &[T]) -> Result<Buffer> {
        let bytes = size_of_val(content) as u64;
        if bytes != d.bytes {
            return Err(Error::Usage(format!(
                "buffer \"{}\" is described with {} bytes, and its content has {bytes}",
                d.name, d.bytes
            )));
        }
        let buffer = self.described_buffer(d)?;
        self.upload(&buffer, 0, content)?;
        Ok(buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_all_levels_layers_and_samples() {
        let plain = ImageDesc::plain("a", vk::Format::R8G8B8A8_UNORM, [8, 2]);
        assert_eq!(plain.bytes(), 4 * 16);
        let levels = ImageDesc { levels: 4, layers: 3, ..plain };
        assert_eq!(levels.bytes(), 4 * 3 * (16 + 4 + 2 + 1));
        assert_eq!(ImageDesc { samples: 4, ..plain }.bytes(), 4 * plain.bytes());
        let volume = VolumeDesc { name: "v", format: vk::Format::R16G16B16A16_SFLOAT, size: [2, 3, 5] };
        assert_eq!(Description::from(volume).bytes(), 8 * 30);
    }
}
