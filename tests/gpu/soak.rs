//! A short soak; `tests/proofs/soak.rs` has the long one.

use crate::device;

const SCENE: &str = "[terrain]\nheightmap = \"builtin:ridge\"\n[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\n\
    density = 0.02\n[[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = 0.01\nbelow_slope = 30.0\n\
    [sun]\nazimuth = 180.0\nelevation = 40.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
    [[camera]]\nname = \"a\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n";

#[test]
fn sixty_camera_jumps_leave_device_memory_as_it_was() {
    let gpu = device::open();
    device::soak(&gpu, &device::small_scene(SCENE), 60, |_| ());
    gpu.close().unwrap();
}
