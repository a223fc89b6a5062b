//! Frames in flight: the slots that recordings take in turn, and read-backs that arrive late.
//!
//! A slot is all of a recording that the host writes while the device may still work on another: its command buffer, its queries,
//! the memory that it uploads from and the memory that it reads back to. A ring has as many slots as recordings were ever open or
//! in flight at once. A slot comes back to its ring when the device is done with it, and only then serves another recording.

use std::marker::PhantomData;
use std::sync::{Arc, Mutex};

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

use super::context::{Gpu, Shared, device_error, lock};
use super::memory::{Buffer, Retired};
use super::sets::SetPools;
use super::timing::{Queries, Scope, Timing, TimingOptions};
use crate::clock::monotonic_ns;
use crate::{Error, Result};

/// Bytes of a slot's first piece of memory.
const FIRST_PIECE: u64 = 1 << 12;

/// Slots for recordings of which several are in flight. Cheap to clone; its memory goes with its last owner.
#[derive(Clone, Default)]
pub struct Ring {
    free: Arc<Mutex<Vec<Slot>>>,
}

/// What one recording has of its own.
pub(super) struct Slot {
    shared: Arc<Shared>,
    pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    pub queries: Option<Queries>,
    pub uploads: Arena,
    pub sets: SetPools,
    reads: Arena,
}

/// Memory that the host sees, filled from its beginning on. When a piece is full a larger one goes on.
pub(super) struct Arena {
    name: &'static str,
    location: MemoryLocation,
    pieces: Vec<Buffer>,
    used: u64,
}

impl Arena {
    fn new(name: &'static str, location: MemoryLocation) -> Self {
        Arena { name, location, pieces: Vec::new(), used: 0 }
    }

    /// Begins again, with the largest piece alone; the device must be done with all.
    fn reset(&mut self) {
        self.used = 0;
        self.pieces.drain(..self.pieces.len().saturating_sub(1));
    }

    /// Room for so many bytes: the buffer and where in it.
    pub fn take(&mut self, gpu: &Gpu, bytes: u64) -> Result<(&mut Buffer, u64)> {
        let held = self.pieces.last().map_or(0, Buffer::bytes);
        if self.used + bytes > held {
            let wanted = bytes.next_power_of_two().max(2 * held).max(FIRST_PIECE);
            self.pieces.push(gpu.make_buffer(self.name, wanted, self.location)?);
            self.used = 0;
        }
        let at = self.used;
        self.used += bytes.next_multiple_of(16);
        match self.pieces.last_mut() {
            Some(piece) => Ok((piece, at)),
            None => Err(Error::Device(format!("{}: no memory", self.name))),
        }
    }
}

impl Ring {
    /// A slot that nothing uses.
    pub(super) fn take(&self, gpu: &Gpu) -> Result<Slot> {
        match lock(&self.free).pop() {
            Some(slot) => Ok(slot),
            None => Slot::new(gpu),
        }
    }

    /// Takes back a slot that the device is done with.
    pub(super) fn put(&self, slot: Slot) {
        lock(&self.free).push(slot);
    }
}

impl Slot {
    fn new(gpu: &Gpu) -> Result<Self> {
        let s = &gpu.shared;
        let create = vk::CommandPoolCreateInfo::default().queue_family_index(s.family);
        let mut slot = Slot {
            shared: s.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            queries: None,
            sets: SetPools::new(s),
            uploads: Arena::new("uploads", MemoryLocation::CpuToGpu),
            reads: Arena::new("read-backs", MemoryLocation::GpuToCpu),
        };
        // SAFETY: the device is alive; dropping the slot destroys the pool, and its command buffer with it.
        unsafe {
            let pool = s.failures.memory().and_then(|()| s.device.create_command_pool(&create, None));
            slot.pool = pool.map_err(device_error("command pool"))?;
            let allocate = vk::CommandBufferAllocateInfo::default()
                .command_pool(slot.pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            let commands = s.failures.memory().and_then(|()| s.device.allocate_command_buffers(&allocate));
            slot.commands = commands.map_err(device_error("command buffer"))?[0];
        }
        Ok(slot)
    }

    /// Begins its command buffer anew.
    pub fn begin(&self) -> Result<()> {
        let s = &self.shared;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot belongs to one recording, and the device is done with what it recorded before.
        let begun = unsafe {
            let reset = s
                .failures
                .memory()
                .and_then(|()| s.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()));
            reset
                .and_then(|()| s.failures.memory())
                .and_then(|()| s.device.begin_command_buffer(self.commands, &begin))
        };
        begun.map_err(device_error("recording"))
    }

    /// Empties its memory for another recording, and gives it the queries that this one takes.
    pub fn prepare(&mut self, gpu: &Gpu, statistics: bool) -> Result<Queries> {
        self.uploads.reset();
        self.reads.reset();
        self.sets.reset();
        if let Some(q) = self.queries.filter(|q| q.statistics.is_some() == statistics) {
            return Ok(q);
        }
        self.retire_queries();
        let queries = gpu.make_queries(statistics)?;
        self.queries = Some(queries);
        Ok(queries)
    }

    fn retire_queries(&mut self) {
        if let Some(q) = self.queries.take() {
            [Some(q.stamps), q.statistics]
                .into_iter()
                .flatten()
                .for_each(|q| self.shared.retire(Retired::Queries(q)));
        }
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.retire_queries();
        self.shared.retire(Retired::Commands(self.pool));
    }
}

/// What a recording has asked to read back: where each piece is, and where it goes.
#[derive(Default)]
pub(super) struct Wanted {
    pieces: Vec<(vk::Buffer, vk::BufferCopy)>,
    bytes: u64,
}

impl Wanted {
    /// Notes a piece.
    pub fn add<T: Pod>(&mut self, buffer: &Buffer, offset: u64, count: usize) -> Result<Later<T>> {
        let size = (count * size_of::<T>()) as u64;
        if offset + size > buffer.bytes() {
            return Err(Error::Usage(format!("reading {size} bytes at {offset} is too long")));
        }
        let at = self.bytes;
        if size > 0 {
            self.pieces.push((buffer.handle, vk::BufferCopy { src_offset: offset, dst_offset: at, size }));
        }
        self.bytes += size.next_multiple_of(16);
        Ok(Later { at: at as usize, count, kind: PhantomData })
    }

    /// Records the copies of all pieces into a slot's memory.
    pub fn record(&mut self, gpu: &Gpu, slot: &mut Slot) -> Result<()> {
        if self.pieces.is_empty() {
            return Ok(());
        }
        let commands = slot.commands;
        // Nothing else is taken of this memory: it begins with them.
        let (to, _) = slot.reads.take(gpu, self.bytes)?;
        for (from, copy) in &self.pieces {
            let region = [*copy];
            // SAFETY: the command buffer is being recorded, both buffers are alive, and the region is in range of both.
            unsafe { gpu.shared.device.cmd_copy_buffer(commands, *from, to.handle, &region) };
        }
        Ok(())
    }

    /// What has come of them; the device must be done.
    fn arrived(&self, slot: &mut Slot) -> Result<Vec<u8>> {
        match slot.reads.pieces.last_mut().filter(|_| self.bytes > 0) {
            Some(piece) => Ok(piece.mapped()?[..self.bytes as usize].to_vec()),
            None => Ok(Vec::new()),
        }
    }
}

/// A part of a buffer as it is at the end of a recording; [`Done::get`] has it.
#[derive(Clone, Copy, Debug)]
pub struct Later<T> {
    at: usize,
    count: usize,
    kind: PhantomData<T>,
}

/// A recording that the device works on. Dropped, it is waited for all the same.
pub struct InFlight {
    pub(super) gpu: Gpu,
    pub(super) ring: Ring,
    pub(super) slot: Option<Slot>,
    /// Number of its submission.
    pub(super) number: u64,
    pub(super) options: TimingOptions,
    pub(super) scopes: Vec<Scope>,
    pub(super) clock: Option<(u64, u64)>,
    pub(super) wanted: Wanted,
    /// What is known of its timing already.
    pub(super) timing: Timing,
    /// When its last submission began, ns.
    pub(super) sent_ns: u64,
}

/// What a recording measured and read back.
pub struct Done {
    /// What it measured.
    pub timing: Timing,
    bytes: Vec<u8>,
}

impl Done {
    /// What was read back.
    pub fn get<T: Pod>(&self, later: &Later<T>) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.bytes[later.at..][..later.count * size_of::<T>()])
    }
}

impl InFlight {
    /// Waits until the device is done, and returns what the recording measured and read back.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn wait(mut self) -> Result<Done> {
        let waited = self.gpu.wait(self.number);
        let done_ns = monotonic_ns();
        let Some(mut slot) = self.slot.take() else { return Err(Error::Device("waited for twice".into())) };
        let scopes = std::mem::take(&mut self.scopes);
        let found = waited.and_then(|()| {
            let measured = match slot.queries {
                Some(queries) => self.gpu.read_timing(queries, self.options, scopes, self.clock),
                None => Timing::default(),
            };
            let known = &self.timing;
            let wait_ms = known.wait_ms + (done_ns - self.sent_ns) as f64 * 1e-6;
            let (draws, dispatches, submit_ns) = (known.draws, known.dispatches, known.submit_ns);
            let timing = Timing { wait_ms, submit_ns, done_ns, draws, dispatches, ..measured };
            Ok(Done { timing, bytes: self.wanted.arrived(&mut slot)? })
        });
        self.ring.put(slot);
        found
    }

    /// Gives its slot back although the device may not be done with it, so that a test can prove that this is noticed.
    #[doc(hidden)]
    pub fn reuse_for_test(mut self) {
        if let Some(slot) = self.slot.take() {
            self.ring.put(slot);
        }
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        if let Some(slot) = self.slot.take() {
            // A device that is lost has nothing left to wait for.
            let _ = self.gpu.wait(self.number);
            self.ring.put(slot);
        }
    }
}
