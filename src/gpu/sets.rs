//! Descriptor sets from pools, one a binding, instead of pushed ones: GPU-assisted validation (1.3.239) takes pushed descriptors
//! for uninitialised and checks nothing behind them. Slow, and only for that.

use ash::vk;

use super::context::Shared;
use super::memory::Retired;
use super::program::Program;

/// Allocates, writes and binds a set that lives until the recording has been executed.
pub(super) fn bind(
    s: &Shared,
    cmd: vk::CommandBuffer,
    program: &Program,
    writes: &[vk::WriteDescriptorSet],
) -> ash::prelude::VkResult<()> {
    let size =
        |w: &vk::WriteDescriptorSet| vk::DescriptorPoolSize { ty: w.descriptor_type, descriptor_count: 1 };
    let sizes: Vec<_> = writes.iter().map(size).collect();
    let create = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
    s.failures.memory()?;
    // SAFETY: the device is alive; the pool is retired, with its set, until the submission to come is done.
    unsafe {
        let pool = s.device.create_descriptor_pool(&create, None)?;
        s.retire(Retired::Pool(pool));
        s.failures.memory()?;
        let layouts = [program.set];
        let allocate = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let sets = s.device.allocate_descriptor_sets(&allocate)?;
        let writes: Vec<_> = writes.iter().map(|w| w.dst_set(sets[0])).collect();
        s.device.update_descriptor_sets(&writes, &[]);
        s.device.cmd_bind_descriptor_sets(cmd, program.bind_point, program.layout, 0, &sets, &[]);
    }
    Ok(())
}
