//! A short soak; `tests/proofs/soak.rs` has the long one.

use crate::device;

#[test]
fn sixty_camera_jumps_leave_device_memory_as_it_was() {
    let gpu = device::open();
    device::soak(&gpu, &device::small_scene(device::WOODS), 60, |_| ());
    gpu.close().unwrap();
}
