//! Descriptor sets from pools, for devices that push none: a set a binding, from the pools of its recording's slot, which the next
//! recording in the slot takes again.

use std::sync::Arc;

use ash::vk;

use super::context::Shared;
use super::memory::Retired;
use super::program::Program;

/// Sets a pool.
const SETS: u32 = 64;
/// Descriptors of a kind a pool: a set has a few of each, and storage buffers and textures most.
const DESCRIPTORS: [(vk::DescriptorType, u32); 5] = [
    (vk::DescriptorType::STORAGE_BUFFER, 16 * SETS),
    (vk::DescriptorType::UNIFORM_BUFFER, 4 * SETS),
    (vk::DescriptorType::UNIFORM_TEXEL_BUFFER, 8 * SETS),
    (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 16 * SETS),
    (vk::DescriptorType::STORAGE_IMAGE, 8 * SETS),
];

/// Pools of one slot, filled one after the other.
pub(super) struct SetPools {
    shared: Arc<Shared>,
    pools: Vec<vk::DescriptorPool>,
    /// Pools that are full.
    full: usize,
}

impl SetPools {
    pub fn new(shared: &Arc<Shared>) -> Self {
        SetPools { shared: shared.clone(), pools: Vec::new(), full: 0 }
    }

    /// Empties them; the device must be done with their sets.
    pub fn reset(&mut self) {
        self.full = 0;
        for pool in &self.pools {
            // SAFETY: the device is alive, and no submission uses the sets. Resetting cannot fail.
            let _ = unsafe {
                self.shared.device.reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty())
            };
        }
    }

    /// Allocates, writes and binds a set that lives until the pools are emptied.
    pub fn bind(
        &mut self,
        cmd: vk::CommandBuffer,
        program: &Program,
        writes: &[vk::WriteDescriptorSet],
    ) -> ash::prelude::VkResult<()> {
        let set = self.allocate(program)?;
        let writes: Vec<_> = writes.iter().map(|w| w.dst_set(set)).collect();
        let device = &self.shared.device;
        // SAFETY: the set is fresh; the command buffer is being recorded.
        unsafe {
            device.update_descriptor_sets(&writes, &[]);
            device.cmd_bind_descriptor_sets(cmd, program.bind_point, program.layout, 0, &[set], &[]);
        }
        Ok(())
    }

    fn allocate(&mut self, program: &Program) -> ash::prelude::VkResult<vk::DescriptorSet> {
        loop {
            let fresh = self.full == self.pools.len();
            if fresh {
                self.pools.push(self.make()?);
            }
            let layouts = [program.set];
            let pool = self.pools[self.full];
            let allocate =
                vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            self.shared.failures.memory()?;
            // SAFETY: the device, the pool and the layout are alive.
            match unsafe { self.shared.device.allocate_descriptor_sets(&allocate) } {
                Ok(sets) => return Ok(sets[0]),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) if !fresh => {
                    self.full += 1;
                }
                Err(e) => return Err(e),
            }
        }
    }

    fn make(&self) -> ash::prelude::VkResult<vk::DescriptorPool> {
        let sizes = DESCRIPTORS.map(|(ty, descriptor_count)| vk::DescriptorPoolSize { ty, descriptor_count });
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
        self.shared.failures.memory()?;
        // SAFETY: the device is alive; dropping the pools retires this one.
        unsafe { self.shared.device.create_descriptor_pool(&create, None) }
    }
}

impl Drop for SetPools {
    fn drop(&mut self) {
        for pool in self.pools.drain(..) {
            self.shared.retire(Retired::Pool(pool));
        }
    }
}
