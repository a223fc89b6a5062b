//! Recording a frame: a pass is a label, a pair of timestamps and the barriers around its work; a stage is several passes.

mod pass;
mod work;

use std::sync::atomic::Ordering;

use ash::vk;
use bytemuck::Pod;

use super::context::{Gpu, device_error};
use super::memory::Buffer;
use super::ring::{InFlight, Later, Ring, Slot, Wanted};
use super::timing::{MAX_SCOPES, Queries, Scope, Stamps, Timing, TimingOptions};
use crate::clock::{monotonic_ns, process_cpu_ms_since, process_cpu_ns};
use crate::{Error, Result};

pub use pass::{Attachment, ComputePass, Layers, RenderPass, Targets};
pub use work::{Resource, Work};

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
