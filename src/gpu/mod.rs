//! The only Vulkan, and the only `unsafe`: context, memory, programs, passes, timing. Knows no forest.
//!
//! Rules that the rest of the module keeps, and that its `unsafe` blocks rely on:
//!
//! * **One queue, one thread at a time.** Commands are recorded through [`Recorder`], which borrows the [`Gpu`]. Submissions run
//!   one after the other, ordered by the barriers at the ends of passes; what the host writes for one lies in its [`Ring`] slot.
//! * **Images live in `GENERAL` layout** from creation to destruction; a full memory barrier stands at the start
//!   and end of every pass, so no pass depends on what another did but in order.
//! * **Handles outlive their use.** A dropped resource is retired with the number of the next submission and
//!   destroyed when the timeline semaphore has passed it.

mod capture;
mod context;
mod description;
mod failures;
mod instance;
pub mod interface;
mod memory;
mod program;
mod record;
mod ring;
mod select;
mod sets;
mod timing;
mod transfer;

pub use ash::vk;
pub use capture::FrameCapture;
pub use context::{Gpu, GpuOptions};
pub use description::{BufferDesc, Description, VolumeDesc};
#[doc(hidden)]
pub use failures::Failure;
pub use instance::Validation;
pub use memory::{Buffer, Image, ImageDesc};
pub use program::{DepthTest, GraphicsDesc, Program, Sampler};
#[doc(hidden)]
pub use record::Fault;
pub use record::{Attachment, ComputePass, Layers, Recorder, RenderPass, Resource, Targets, Work};
pub use ring::{Done, InFlight, Later, Ring};
pub use select::{DeviceInfo, devices, find, tree_components};
pub use timing::{PassTime, PipelineStatistics, Stamps, Timing, TimingOptions};

/// A descriptor binding of a shader, from reflection; every binding is in set 0.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Binding number.
    pub binding: u32,
    /// Name in the shader: callers bind by it.
    pub name: &'static str,
    /// Descriptor type.
    pub kind: vk::DescriptorType,
}

/// A compiled shader with what reflection says of it.
#[derive(Debug)]
pub struct Shader {
    /// Path under `shaders/`.
    pub name: &'static str,
    /// Its one stage.
    pub stage: vk::ShaderStageFlags,
    /// Bytes of its push constants.
    pub push_constant_bytes: u32,
    /// Locations that it writes, of four components each.
    pub locations: u32,
    /// Invocations a workgroup; 1 outside compute.
    pub invocations: u32,
    /// SPIR-V words as bytes.
    pub spirv: &'static [u8],
    /// Its bindings, sorted.
    pub bindings: &'static [Binding],
    /// Its specialization constants: name and id. Callers set them by name; one name means the same in every shader.
    pub constants: &'static [(&'static str, u32)],
}

/// Every shader of the program, compiled and reflected by `build.rs`.
#[allow(missing_docs)]
pub mod shaders {
    use super::{Binding, Shader, vk};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}
