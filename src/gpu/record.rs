//! Recording a frame: a pass is a label, a pair of timestamps and the barriers around its work; a stage is several passes.

use std::sync::atomic::Ordering;

use ash::vk;
use bytemuck::Pod;

use super::context::{Gpu, device_error};
use super::memory::{Buffer, Image};
use super::program::{Program, Sampler};
use super::ring::{InFlight, Later, Ring, Slot, Wanted};
use super::timing::{MAX_SCOPES, Queries, Scope, Stamps, Timing, TimingOptions};
use crate::clock::{monotonic_ns, process_cpu_ms_since, process_cpu_ns};
use crate::{Error, Result};

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
    /// So many from the first on: vertices choose, on devices where they can ([`super::DeviceInfo::vertex_layers`]).
    Chosen(u32),
}

/// What [`Recorder::fault_for_test`] does wrong.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Core validation must report it.
    CopyBeyondTheEnd,
    /// Synchronization validation must report it.
    WriteAfterWrite,
}

/// Records commands for one submission.
pub struct Recorder<'g> {
    gpu: &'g Gpu,
    ring: Ring,
    /// What it records into; `None` once it is launched.
    slot: Option<Slot>,
    /// The slot's command buffer; null where it cannot be recorded to.
    cmd: vk::CommandBuffer,
    queries: Queries,
    wanted: Wanted,
    /// Uploads are recorded that no barrier has followed.
    uploaded: bool,
    options: TimingOptions,
    scopes: Vec<Scope>,
    draws: u32,
    dispatches: u32,
    /// When the first submission began, ns.
    submitted: Option<u64>,
    /// Time from submissions to their ends, ns.
    waited: u64,
    error: Option<Error>,
}

/// A full memory barrier: everything before is visible to everything after.
pub(super) fn barrier(device: &ash::Device, cmd: vk::CommandBuffer) {
    let all = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS | vk::PipelineStageFlags2::HOST)
        .dst_access_mask(
            vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE | vk::AccessFlags2::HOST_READ,
        )];
    // SAFETY: the command buffer is being recorded.
    unsafe { device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&all)) };
}

impl Gpu {
    /// Starts a recording that is alone.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn record(&self) -> Result<Recorder<'_>> {
        self.record_in(&Ring::default())
    }

    /// Starts recording in a slot of a ring.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn record_in(&self, ring: &Ring) -> Result<Recorder<'_>> {
        let options = self.timing();
        let mut slot = ring.take(self)?;
        let prepared = slot.prepare(self, options.statistics);
        let queries = match prepared {
            Ok(queries) => queries,
            Err(e) => {
                ring.put(slot);
                return Err(e);
            }
        };
        let mut recorder = Recorder {
            gpu: self,
            ring: ring.clone(),
            slot: Some(slot),
            cmd: vk::CommandBuffer::null(),
            queries,
            wanted: Wanted::default(),
            uploaded: false,
            options,
            scopes: Vec::new(),
            draws: 0,
            dispatches: 0,
            submitted: None,
            waited: 0,
            error: None,
        };
        recorder.begin()?;
        let (device, cmd) = (&self.shared.device, recorder.cmd);
        // What came before on the queue is done, and seen, before anything here.
        barrier(device, cmd);
        // SAFETY: the command buffer is being recorded; no other recording uses the pools.
        unsafe {
            device.cmd_reset_query_pool(cmd, queries.stamps, 0, 2 * MAX_SCOPES + 2);
            if let Some(pool) = queries.statistics {
                device.cmd_reset_query_pool(cmd, pool, 0, MAX_SCOPES);
            }
        }
        if options.stamps != Stamps::None {
            recorder.stamp(0);
        }
        Ok(recorder)
    }

    /// Submits one command buffer and waits for it.
    pub(super) fn submit(&self, cmd: vk::CommandBuffer) -> Result<()> {
        self.wait(self.send(cmd)?)
    }

    /// Submits one command buffer, and returns its number.
    pub(super) fn send(&self, cmd: vk::CommandBuffer) -> Result<u64> {
        let s = &self.shared;
        let value = s.submitted.fetch_add(1, Ordering::AcqRel) + 1;
        // Not vkQueueSubmit2: after it, GPU-assisted validation (1.3.239) never sees the timeline semaphore signalled.
        let (commands, semaphores, values) = ([cmd], [s.timeline], [value]);
        let mut signal = vk::TimelineSemaphoreSubmitInfo::default().signal_semaphore_values(&values);
        let submit = [vk::SubmitInfo::default()
            .command_buffers(&commands)
            .signal_semaphores(&semaphores)
            .push_next(&mut signal)];
        let works = s.failures.memory().and_then(|()| s.failures.device());
        // SAFETY: the command buffer is complete, and its resources are alive until it is waited for: they are retired, not
        // destroyed, and its slot is not used before.
        let sent = works.and_then(|()| unsafe { s.device.queue_submit(s.queue, &submit, vk::Fence::null()) });
        sent.map(|()| value).map_err(device_error("submit"))
    }

    /// Waits for a submission; then frees what was retired before it.
    pub(super) fn wait(&self, number: u64) -> Result<()> {
        let s = &self.shared;
        let (semaphores, values) = ([s.timeline], [number]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the device is alive. One that only plays lost is waited for all the same: it has the commands.
        let done = unsafe { s.device.wait_semaphores(&wait, u64::MAX) };
        s.failures.device().and(done).map_err(device_error("waiting for the device"))?;
        s.collect(number);
        Ok(())
    }
}

impl<'g> Recorder<'g> {
    fn device(&self) -> &'g ash::Device {
        &self.gpu.shared.device
    }

    /// Begins the slot's command buffer.
    fn begin(&mut self) -> Result<()> {
        if let Some(slot) = &self.slot {
            slot.begin()?;
            self.cmd = slot.commands;
        }
        Ok(())
    }

    /// Ends the command buffer and submits it; returns the number of the submission.
    fn send(&mut self) -> Result<u64> {
        let s = &self.gpu.shared;
        self.submitted.get_or_insert_with(monotonic_ns);
        let cmd = std::mem::take(&mut self.cmd);
        let ended = s.failures.memory().and_then(|()| {
            // SAFETY: every pass is closed.
            unsafe { s.device.end_command_buffer(cmd) }
        });
        ended.map_err(device_error("recording"))?;
        self.gpu.send(cmd)
    }

    /// Submits what is recorded so far, waits for it, and returns the CPU time that all threads took meanwhile, ms.
    fn flush(&mut self) -> Result<Option<f64>> {
        let (start, cpu) = (monotonic_ns(), process_cpu_ns());
        let number = self.send()?;
        self.gpu.wait(number)?;
        let cpu = process_cpu_ms_since(cpu);
        self.waited += monotonic_ns() - start;
        Ok(cpu)
    }

    /// Writes `content` into `buffer` from byte `offset` on, before whatever is recorded from now on. Between two passes no
    /// byte may be written twice.
    ///
    /// # Errors
    /// [`Error::Usage`] if it does not fit; [`Error::Device`] when out of memory.
    pub fn upload<T: Pod>(&mut self, buffer: &Buffer, offset: u64, content: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(content);
        let size = bytes.len() as u64;
        if offset + size > buffer.bytes() {
            return Err(Error::Usage(format!("upload of {size} bytes at {offset} is too long")));
        }
        let (device, cmd) = (self.device(), self.cmd);
        let Some(slot) = self.slot.as_mut().filter(|_| size > 0 && cmd != vk::CommandBuffer::null()) else {
            return Ok(());
        };
        let (from, at) = slot.uploads.take(self.gpu, size)?;
        from.mapped()?[at as usize..][..bytes.len()].copy_from_slice(bytes);
        let region = [vk::BufferCopy { src_offset: at, dst_offset: offset, size }];
        // SAFETY: the command buffer is being recorded, both buffers are alive, and the region is in range of both.
        unsafe { device.cmd_copy_buffer(cmd, from.handle, buffer.handle, &region) };
        self.uploaded = true;
        Ok(())
    }

    /// The same into a buffer that is made anew when it is too short.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and [`Recorder::upload`].
    pub fn renew<T: Pod>(&mut self, buffer: &mut Buffer, name: &str, content: &[T]) -> Result<()> {
        let bytes = size_of_val(content) as u64;
        if bytes > buffer.bytes() {
            *buffer = self.gpu.buffer(name, bytes.next_power_of_two())?;
        }
        self.upload(buffer, 0, content)
    }

    /// Reads `count` values of a buffer from byte `offset` on as they are at the end of the recording.
    ///
    /// # Errors
    /// [`Error::Usage`] if the range is outside the buffer.
    pub fn read<T: Pod>(&mut self, buffer: &Buffer, offset: u64, count: usize) -> Result<Later<T>> {
        self.wanted.add(buffer, offset, count)
    }

    /// Writes a timestamp. A barrier follows because lavapipe may otherwise run the stamp after the work that it precedes.
    fn stamp(&self, query: u32) {
        if self.cmd == vk::CommandBuffer::null() {
            return;
        }
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the command buffer is being recorded; the query was reset.
        unsafe { self.device().cmd_write_timestamp2(self.cmd, stage, self.queries.stamps, query) };
        barrier(self.device(), self.cmd);
    }

    /// A named scope: its label and its stamps around `work`; returns its index.
    fn within(&mut self, name: &str, pass: bool, work: impl FnOnce(&mut Self)) -> Option<usize> {
        let index = self.scopes.len();
        if index >= MAX_SCOPES as usize {
            self.error.get_or_insert(Error::Usage(format!("more than {MAX_SCOPES} passes in a frame")));
            return None;
        }
        self.scopes.push(Scope { name: name.to_string(), pass, cpu_ms: None });
        let _span = tracing::info_span!("scope", name).entered();
        let gpu = self.gpu;
        // Labels must close in the command buffer that they were opened in.
        let names = gpu.shared.names.as_ref().filter(|_| pass || !self.options.apart);
        if let (Some(names), Ok(text)) = (names, std::ffi::CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&text);
            // SAFETY: the command buffer is being recorded.
            unsafe { names.cmd_begin_debug_utils_label(self.cmd, &label) };
        }
        if std::mem::take(&mut self.uploaded) {
            barrier(self.device(), self.cmd);
        }
        let stamped = self.options.stamps == Stamps::Scopes;
        if stamped {
            self.stamp(2 * index as u32 + 2);
        }
        work(self);
        if pass {
            barrier(self.device(), self.cmd);
        }
        if stamped {
            self.stamp(2 * index as u32 + 3);
        }
        if let Some(names) = names {
            // SAFETY: the label was begun above.
            unsafe { names.cmd_end_debug_utils_label(self.cmd) };
        }
        Some(index)
    }

    fn pass(&mut self, name: &str, work: impl FnOnce(&mut Self)) {
        // What a failed submission left cannot be recorded to.
        if self.cmd == vk::CommandBuffer::null() {
            return;
        }
        let index = self.within(name, true, work);
        if let Some(index) = index.filter(|_| self.options.apart && self.error.is_none()) {
            let done = self.flush().and_then(|cpu| self.begin().map(|()| cpu));
            match done {
                Ok(cpu) => self.scopes[index].cpu_ms = cpu,
                Err(e) => self.error = Some(e),
            }
        }
    }

    /// A stage of several passes, timed as a whole too.
    pub fn stage(&mut self, name: &str, work: impl FnOnce(&mut Self)) {
        if self.cmd != vk::CommandBuffer::null() {
            self.within(name, false, work);
        }
    }

    /// Counts what the pipeline does in `work`, which is all of the last pass.
    fn counted(&mut self, work: impl FnOnce(&mut Self)) {
        let pool = self.queries.statistics.filter(|_| self.options.statistics);
        let query = self.scopes.len() as u32 - 1;
        if let Some(pool) = pool {
            // SAFETY: the command buffer is being recorded; the query was reset.
            unsafe { self.device().cmd_begin_query(self.cmd, pool, query, vk::QueryControlFlags::empty()) };
        }
        work(self);
        if let Some(pool) = pool {
            // SAFETY: the query was begun above.
            unsafe { self.device().cmd_end_query(self.cmd, pool, query) };
        }
    }

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

    /// A pass of copies: clears a buffer range to a 32-bit word.
    pub fn fill(&mut self, name: &str, buffer: &Buffer, word: u32) {
        self.pass(name, |r| {
            // SAFETY: the buffer is alive.
            unsafe { r.device().cmd_fill_buffer(r.cmd, buffer.handle, 0, vk::WHOLE_SIZE, word) };
        });
    }

    /// Records a deliberate fault, so that a test can prove that validation reports one. It is never submitted.
    #[doc(hidden)]
    pub fn fault_for_test(self, fault: Fault, buffer: &Buffer) {
        let (device, b) = (self.device(), buffer.handle);
        let half = buffer.bytes() / 2;
        let copy = [vk::BufferCopy { src_offset: 0, dst_offset: half, size: half }];
        let beyond = [vk::BufferCopy { src_offset: 0, dst_offset: buffer.bytes(), size: half }];
        // SAFETY: recorded only: the recorder is dropped without a submission, so nothing runs.
        unsafe {
            match fault {
                Fault::CopyBeyondTheEnd => device.cmd_copy_buffer(self.cmd, b, b, &beyond),
                Fault::WriteAfterWrite => {
                    device.cmd_copy_buffer(self.cmd, b, b, &copy);
                    device.cmd_copy_buffer(self.cmd, b, b, &copy);
                }
            }
        }
    }

    /// Submits, waits, and returns what the recording measured.
    ///
    /// # Errors
    /// What went wrong while recording, or [`Error::Device`].
    pub fn submit(self) -> Result<Timing> {
        self.launch()?.wait().map(|done| done.timing)
    }

    /// Submits, and does not wait.
    ///
    /// # Errors
    /// What went wrong while recording, or [`Error::Device`].
    pub fn launch(mut self) -> Result<InFlight> {
        if let Some(e) = self.error.take() {
            return Err(e);
        }
        if let Some(slot) = &mut self.slot {
            if std::mem::take(&mut self.uploaded) {
                barrier(&self.gpu.shared.device, slot.commands);
            }
            self.wanted.record(self.gpu, slot)?;
        }
        // What is copied is the host's to read.
        barrier(self.device(), self.cmd);
        let stamped = self.options.stamps != Stamps::None;
        if stamped {
            self.stamp(1);
        }
        let clock = stamped.then(|| self.gpu.calibrate()).flatten();
        let sent_ns = monotonic_ns();
        let number = self.send()?;
        let timing = Timing {
            wait_ms: self.waited as f64 * 1e-6,
            submit_ns: self.submitted.unwrap_or(sent_ns),
            draws: self.draws,
            dispatches: self.dispatches,
            ..Timing::default()
        };
        Ok(InFlight {
            gpu: self.gpu.clone(),
            ring: self.ring.clone(),
            slot: self.slot.take(),
            number,
            options: self.options,
            scopes: std::mem::take(&mut self.scopes),
            clock,
            wanted: std::mem::take(&mut self.wanted),
            timing,
            sent_ns,
        })
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        // Nothing of it was submitted that was not waited for.
        if let Some(slot) = self.slot.take() {
            self.ring.put(slot);
        }
    }
}

/// What compute and render passes share: programs, bindings and push constants.
pub struct Work<'r, 'g> {
    recorder: &'r mut Recorder<'g>,
    program: Option<(vk::PipelineLayout, vk::ShaderStageFlags, u32)>,
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
