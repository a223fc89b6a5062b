//! Nothing grows: a thousand frames, each from another place.

use crate::device;

/// Memory of the process that is in use, MiB.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_camera_jumps_leave_memory_flat() {
    let gpu = device::open();
    let scene = device::small_scene(device::WOODS);
    let mut found = Vec::new();
    device::soak(&gpu, &scene, 1000, |frame| {
        if frame % 100 == 99 {
            found.push(resident());
            println!("frame {}: {:.1} MiB in use", frame + 1, found[found.len() - 1]);
        }
    });
    gpu.close().unwrap();
    // The first hundreds of frames fill caches that were set aside, the driver's too.
    let (early, late) = (found[2], found[9]);
    println!("{early:.1} MiB after 300 frames, {late:.1} after 1000");
    assert!(late <= 1.02 * early + 4.0, "{found:?}");
}
