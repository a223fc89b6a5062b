//! Compute passes, and render passes with what they draw to.

use ash::vk;

use super::work::Work;
use super::{Recorder, barrier};
use crate::Error;
use crate::gpu::memory::{Buffer, Image};

/// A colour or depth attachment.
#[derive(Clone, Copy)]
pub struct Attachment<'a> {
    /// The image drawn to.
    pub image: &'a Image,
    /// Single-sample image that gets the average (or, for integers and depth, sample 0).
    pub resolve: Option<&'a Image>,
    /// Value to start from; `None` keeps the content.
    pub clear: Option<[f32; 4]>,
}

/// What a render pass draws to.
#[derive(Clone, Copy)]
pub struct Targets<'a> {
    /// Colour attachments.
    pub colors: &'a [Attachment<'a>],
    /// Depth attachment.
    pub depth: Option<Attachment<'a>>,
    /// Layers drawn to.
    pub layers: Layers,
}

/// Which layers of its targets a pass draws to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// This one.
    One(u32),
    /// So many from the first on: vertices choose, on devices where they can ([`crate::gpu::DeviceInfo::vertex_layers`]).
    Chosen(u32),
}

impl Recorder<'_> {
    /// A pass of compute work.
    pub fn compute(&mut self, name: &str, work: impl FnOnce(&mut ComputePass)) {
        self.pass(name, |r| {
            r.counted(|r| work(&mut ComputePass { work: Work { recorder: r, program: None } }));
        });
    }

    /// A pass that draws to `targets`.
    pub fn render(&mut self, name: &str, targets: &Targets, work: impl FnOnce(&mut RenderPass)) {
        let Some(first) = targets.colors.first().or(targets.depth.as_ref()) else {
            self.error.get_or_insert(Error::Usage(format!("pass {name} draws to nothing")));
            return;
        };
        let [width, height] = first.image.size();
        let info = |a: &Attachment, depth: bool| {
            let mut info = vk::RenderingAttachmentInfo::default()
                .image_view(a.image.drawn(targets.layers))
                .image_layout(vk::ImageLayout::GENERAL)
                .store_op(vk::AttachmentStoreOp::STORE)
                .load_op(vk::AttachmentLoadOp::LOAD);
            if let Some(c) = a.clear {
                let value = if depth {
                    vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: c[0], stencil: 0 } }
                } else if is_uint(a.image.format()) {
                    vk::ClearValue { color: vk::ClearColorValue { uint32: c.map(|v| v as u32) } }
                } else {
                    vk::ClearValue { color: vk::ClearColorValue { float32: c } }
                };
                info = info.load_op(vk::AttachmentLoadOp::CLEAR).clear_value(value);
            }
            if let Some(r) = a.resolve {
                let average = !depth && !is_uint(a.image.format());
                info = info
                    .resolve_image_view(r.view)
                    .resolve_image_layout(vk::ImageLayout::GENERAL)
                    .resolve_mode(if average {
                        vk::ResolveModeFlags::AVERAGE
                    } else {
                        vk::ResolveModeFlags::SAMPLE_ZERO
                    });
            }
            info
        };
        let colors: Vec<_> = targets.colors.iter().map(|a| info(a, false)).collect();
        let depth = targets.depth.as_ref().map(|a| info(a, true));
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let mut begin = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(if let Layers::Chosen(count) = targets.layers { count } else { 1 })
            .color_attachments(&colors);
        if let Some(d) = &depth {
            begin = begin.depth_attachment(d);
        }
        let viewport = [vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        self.pass(name, |r| {
            let (device, cmd) = (r.device(), r.cmd);
            // SAFETY: the attachments are alive, in GENERAL layout, and not otherwise used in this pass.
            unsafe {
                device.cmd_begin_rendering(cmd, &begin);
                device.cmd_set_viewport(cmd, 0, &viewport);
                device.cmd_set_scissor(cmd, 0, &[area]);
            }
            // Inside the render pass: outside, fragments of the resolve would count too.
            r.counted(|r| work(&mut RenderPass { work: Work { recorder: r, program: None } }));
            // SAFETY: rendering was begun above.
            unsafe { device.cmd_end_rendering(cmd) };
        });
    }
}

/// Inside a compute pass.
pub struct ComputePass<'r, 'g> {
    work: Work<'r, 'g>,
}

/// Inside a render pass.
pub struct RenderPass<'r, 'g> {
    work: Work<'r, 'g>,
}

impl<'r, 'g> std::ops::Deref for ComputePass<'r, 'g> {
    type Target = Work<'r, 'g>;
    fn deref(&self) -> &Self::Target {
        &self.work
    }
}

impl std::ops::DerefMut for ComputePass<'_, '_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.work
    }
}

impl<'r, 'g> std::ops::Deref for RenderPass<'r, 'g> {
    type Target = Work<'r, 'g>;
    fn deref(&self) -> &Self::Target {
        &self.work
    }
}

impl std::ops::DerefMut for RenderPass<'_, '_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.work
    }
}

impl ComputePass<'_, '_> {
    /// Runs `groups` workgroups of the bound program.
    pub fn dispatch(&mut self, groups: [u32; 3]) {
        if groups.contains(&0) || self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.dispatches += 1;
        // SAFETY: a program and its resources are bound.
        unsafe { r.device().cmd_dispatch(r.cmd, groups[0], groups[1], groups[2]) };
    }

    /// Runs the bound program with the number of workgroups that stands at byte `offset` of `commands`.
    pub fn dispatch_indirect(&mut self, commands: &Buffer, offset: u64) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.dispatches += 1;
        // SAFETY: a program and its resources are bound; the buffer is alive and holds what the shader that wrote it put there.
        unsafe { r.device().cmd_dispatch_indirect(r.cmd, commands.handle, offset) };
    }

    /// A barrier between two dispatches of the same pass.
    pub fn barrier(&mut self) {
        let r = &*self.work.recorder;
        barrier(r.device(), r.cmd);
    }
}

impl RenderPass<'_, '_> {
    /// Draws only to a rectangle from now on: its first texel and the one beyond its last.
    pub fn scissor(&mut self, rectangle: [[u32; 2]; 2]) {
        let r = &*self.work.recorder;
        // SAFETY: rendering was begun.
        unsafe { r.device().cmd_set_scissor(r.cmd, 0, &[rect(rectangle)]) };
    }

    /// Sets the depth of a rectangle of a layer: of its first texel to before the one beyond its last.
    pub fn clear_depth(&mut self, rectangle: [[u32; 2]; 2], layer: u32, depth: f32) {
        let r = &*self.work.recorder;
        let value = [vk::ClearAttachment {
            aspect_mask: vk::ImageAspectFlags::DEPTH,
            color_attachment: 0,
            clear_value: vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } },
        }];
        let area = [vk::ClearRect { rect: rect(rectangle), base_array_layer: layer, layer_count: 1 }];
        // SAFETY: rendering was begun; the caller keeps the rectangle and the layer within its targets.
        unsafe { r.device().cmd_clear_attachments(r.cmd, &value, &area) };
    }

    /// Draws `vertices` vertices without an index buffer.
    pub fn draw(&mut self, vertices: u32, instances: u32) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: a program and its resources are bound.
        unsafe { r.device().cmd_draw(r.cmd, vertices, instances, 0, 0) };
    }

    /// Draws without an index buffer; the arguments are the command at byte `offset` of `commands`.
    pub fn draw_indirect(&mut self, commands: &Buffer, offset: u64) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: a program and its resources are bound; the buffer is alive and holds what the shader that wrote it put there.
        unsafe { r.device().cmd_draw_indirect(r.cmd, commands.handle, offset, 1, 16) };
    }

    /// The same where the word in `count` is 1, on a device with counted draws. Mesa 22.3's llvmpipe counts an indirect draw that has no count of its own by
    /// the last one that had: behind a counted draw of none it draws none.
    pub fn draw_indirect_counted(&mut self, (commands, offset): (&Buffer, u64), count: &Buffer) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: a program and its resources are bound; the buffers are alive and hold what was put there, and the feature was enabled.
        unsafe { r.device().cmd_draw_indirect_count(r.cmd, commands.handle, offset, count.handle, 0, 1, 16) };
    }

    /// Draws with 32-bit indices; the arguments are the command at byte `offset` of `commands`.
    pub fn draw_indexed_indirect(&mut self, indices: &Buffer, commands: &Buffer, offset: u64) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: both buffers are alive and hold what the shader that wrote them put there.
        unsafe {
            r.device().cmd_bind_index_buffer(r.cmd, indices.handle, 0, vk::IndexType::UINT32);
            r.device().cmd_draw_indexed_indirect(r.cmd, commands.handle, offset, 1, 20);
        }
    }

    /// Draws with 32-bit indices so many times as stands in `count`, at most `most`; the arguments are commands from byte `offset` of `commands` on.
    /// Only where the device takes such ([`crate::gpu::DeviceInfo::counted_draws`]).
    pub fn draw_indexed_counted(
        &mut self,
        indices: &Buffer,
        (commands, offset): (&Buffer, u64),
        count: &Buffer,
        most: u32,
    ) {
        if self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: the buffers are alive and hold what the shader that wrote them put there, and the feature was enabled.
        unsafe {
            let (device, cmd) = (r.device(), r.cmd);
            device.cmd_bind_index_buffer(cmd, indices.handle, 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed_indirect_count(cmd, commands.handle, offset, count.handle, 0, most, 20);
        }
    }

    /// Draws `count` 32-bit indices for each of the instances.
    pub fn draw_indexed(&mut self, indices: &Buffer, count: u32, instances: std::ops::Range<u32>) {
        if instances.is_empty() || self.work.program.is_none() {
            return;
        }
        let r = &mut *self.work.recorder;
        r.draws += 1;
        // SAFETY: the buffer is alive and holds `count` indices.
        unsafe {
            r.device().cmd_bind_index_buffer(r.cmd, indices.handle, 0, vk::IndexType::UINT32);
            let number = instances.end - instances.start;
            r.device().cmd_draw_indexed(r.cmd, count, number, 0, 0, instances.start);
        }
    }
}

fn rect([low, high]: [[u32; 2]; 2]) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D { x: low[0] as i32, y: low[1] as i32 },
        extent: vk::Extent2D {
            width: high[0].saturating_sub(low[0]),
            height: high[1].saturating_sub(low[1]),
        },
    }
}

fn is_uint(format: vk::Format) -> bool {
    matches!(format, vk::Format::R32_UINT | vk::Format::R8_UINT)
}
