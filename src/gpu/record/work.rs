//! What compute and render passes share: the program in use, its resources and its push constants.

use ash::vk;
use bytemuck::Pod;

use super::Recorder;
use crate::Error;
use crate::gpu::context::device_error;
use crate::gpu::memory::{Buffer, Image};
use crate::gpu::program::{Program, Sampler};

/// What a shader binding gets.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    /// A storage or uniform buffer, whole.
    Buffer(&'a Buffer),
    /// A buffer read as texels.
    Texels(&'a Buffer),
    /// A sampled image.
    Texture(&'a Image, Sampler),
    /// A storage image without mip levels.
    Storage(&'a Image),
    /// A mip level of a storage image that has several.
    StorageLevel(&'a Image, u32),
}

/// What compute and render passes share: programs, bindings and push constants.
pub struct Work<'r, 'g> {
    pub(super) recorder: &'r mut Recorder<'g>,
    pub(super) program: Option<(vk::PipelineLayout, vk::ShaderStageFlags, u32)>,
}

impl Work<'_, '_> {
    /// Uses a program with its resources by name; every binding of the program must be named.
    pub fn bind(&mut self, program: &Program, resources: &[(&str, Resource)]) {
        let s = &self.recorder.gpu.shared;
        // What cannot be bound is an error, and nothing runs without.
        self.program = None;
        let mut buffers = Vec::with_capacity(program.bindings.len());
        let mut images = Vec::with_capacity(program.bindings.len());
        let mut views = Vec::with_capacity(program.bindings.len());
        for b in &program.bindings {
            let found = resources.iter().find(|(name, _)| *name == b.name).map(|(_, r)| *r);
            let (mut buffer, mut image) =
                (vk::DescriptorBufferInfo::default(), vk::DescriptorImageInfo::default());
            let mut texels = vk::BufferView::null();
            let fits = match (found, b.kind) {
                (
                    Some(Resource::Buffer(r)),
                    vk::DescriptorType::STORAGE_BUFFER | vk::DescriptorType::UNIFORM_BUFFER,
                ) => {
                    buffer = buffer.buffer(r.handle).range(vk::WHOLE_SIZE);
                    true
                }
                (Some(Resource::Texels(r)), vk::DescriptorType::UNIFORM_TEXEL_BUFFER) => {
                    texels = r.texels;
                    texels != vk::BufferView::null()
                }
                (Some(Resource::Texture(r, sampler)), vk::DescriptorType::COMBINED_IMAGE_SAMPLER) => {
                    image = image
                        .image_view(r.view)
                        .image_layout(vk::ImageLayout::GENERAL)
                        .sampler(s.samplers[sampler as usize]);
                    true
                }
                (Some(Resource::Storage(r)), vk::DescriptorType::STORAGE_IMAGE) => {
                    image = image.image_view(r.view).image_layout(vk::ImageLayout::GENERAL);
                    true
                }
                (Some(Resource::StorageLevel(r, level)), vk::DescriptorType::STORAGE_IMAGE) => {
                    let view = r.level_views.get(level as usize);
                    image = image
                        .image_view(view.copied().unwrap_or_default())
                        .image_layout(vk::ImageLayout::GENERAL);
                    view.is_some()
                }
                _ => false,
            };
            if !fits {
                let e = format!("{}: \"{}\" wants a {:?}", program.name(), b.name, b.kind);
                self.recorder.error.get_or_insert(Error::Usage(e));
                return;
            }
            buffers.push([buffer]);
            images.push([image]);
            views.push([texels]);
        }
        let writes: Vec<_> = program
            .bindings
            .iter()
            .zip(buffers.iter().zip(&images).zip(&views))
            .map(|(b, ((buffer, image), texels))| {
                let write = vk::WriteDescriptorSet::default().dst_binding(b.binding).descriptor_type(b.kind);
                if texels[0] != vk::BufferView::null() {
                    write.texel_buffer_view(texels)
                } else if buffer[0].buffer == vk::Buffer::null() {
                    write.image_info(image)
                } else {
                    write.buffer_info(buffer)
                }
            })
            .collect();
        // SAFETY: program and resources are alive until the submission is waited for: the caller owns them and
        // dropping only retires them.
        unsafe {
            s.device.cmd_bind_pipeline(self.recorder.cmd, program.bind_point, program.pipeline);
            match (&s.push, &mut self.recorder.slot) {
                _ if writes.is_empty() => (),
                (Some(push), _) => {
                    let (cmd, layout) = (self.recorder.cmd, program.layout);
                    push.cmd_push_descriptor_set(cmd, program.bind_point, layout, 0, &writes);
                }
                (None, Some(slot)) => {
                    if let Err(e) = slot.sets.bind(self.recorder.cmd, program, &writes) {
                        self.recorder.error.get_or_insert(device_error("descriptor set")(e));
                        return;
                    }
                }
                (None, None) => return,
            }
        }
        self.program = Some((program.layout, program.stages, program.push_bytes));
    }

    /// Sets the bound program's push constants.
    pub fn push<T: Pod>(&mut self, constants: &T) {
        let bytes = bytemuck::bytes_of(constants);
        match self.program {
            Some((layout, stages, expected)) if expected as usize == bytes.len() => {
                // SAFETY: the layout is that of the bound program and takes exactly these bytes.
                unsafe {
                    let cmd = self.recorder.cmd;
                    self.recorder.device().cmd_push_constants(cmd, layout, stages, 0, bytes);
                }
            }
            other => {
                let e = format!("push constants of {} bytes for {other:?}", bytes.len());
                self.recorder.error.get_or_insert(Error::Usage(e));
            }
        }
    }
}
