//! Frames in flight: the same bits as alone, read-backs of the right frame, memory that stays what it was, and what happens when
//! a slot is used too early.

use canopy::camera::Eye;
use canopy::frame::{FrameReport, Renderer, Ticket};
use canopy::gpu::{Gpu, Ring};
use canopy::image::Picture;
use canopy::scene::{Camera, Scene};
use std::collections::VecDeque;

use crate::device;

const SIZE: [u32; 2] = [96, 64];

/// Woods, and cameras from which different numbers of trees are seen.
fn woods() -> (Scene, Vec<Camera>) {
    let scene = device::small_scene(device::WOODS);
    let cameras = (0..8).map(|frame| device::jump(&scene, frame)).collect();
    (scene, cameras)
}

fn submit(renderer: &mut Renderer, camera: &Camera) -> Ticket {
    let eye = Eye::new(camera, &renderer.scene().terrain, SIZE);
    let cascades = renderer.cascades(&eye);
    renderer.submit(&eye, &cascades, 1.0).unwrap()
}

/// Draws from every camera with so many frames in flight; the reports, and the last picture.
fn draw(gpu: &Gpu, in_flight: usize) -> (Vec<FrameReport>, Picture) {
    let (scene, cameras) = woods();
    let mut renderer = device::renderer(gpu, &scene, &cameras[0], SIZE, true);
    let (mut reports, mut waiting) = (Vec::new(), VecDeque::new());
    for camera in &cameras {
        if waiting.len() == in_flight {
            reports.push(renderer.finish(waiting.pop_front().unwrap()).unwrap().0);
        }
        waiting.push_back(submit(&mut renderer, camera));
    }
    // Before the last are waited for: reading a picture waits for its frame.
    let picture = renderer.picture().unwrap();
    reports.extend(waiting.into_iter().map(|ticket| renderer.finish(ticket).unwrap().0));
    (reports, picture)
}

#[test]
fn one_two_and_three_frames_in_flight_draw_the_same_and_report_their_own() {
    let gpu = device::open();
    let (alone, picture) = draw(&gpu, 1);
    let seen = |r: &FrameReport| {
        (r.trees.clone(), r.produced, r.evicted, r.terrain_quads, r.seed_quads, r.timing.dispatches)
    };
    let trees: std::collections::BTreeSet<u32> = alone.iter().map(|r| r.trees.camera).collect();
    assert!(trees.len() > alone.len() / 2, "frames that are alike prove nothing: {trees:?}");
    for in_flight in [2, 3] {
        let (reports, same) = draw(&gpu, in_flight);
        let [found, want] = [&reports, &alone].map(|all| all.iter().map(seen).collect::<Vec<_>>());
        assert_eq!(found, want, "{in_flight} in flight");
        assert!(same == picture, "{in_flight} in flight: other bits");
        let ends: Vec<u64> = reports.iter().map(|r| r.timing.done_ns).collect();
        assert!(ends.is_sorted() && reports.iter().all(|r| r.timing.lost == 0));
    }
    gpu.close().unwrap();
}

#[test]
fn a_hundred_camera_jumps_two_at_a_time_leave_device_memory_as_it_was() {
    let gpu = device::open();
    device::soak_in_flight(&gpu, &device::small_scene(device::WOODS), (100, 2), |_| ());
    gpu.close().unwrap();
}

/// A frame that fails takes nothing with it: neither the one in flight before it, nor the slots.
#[test]
fn a_frame_that_fails_leaves_the_others() {
    let gpu = device::open();
    let (scene, cameras) = woods();
    let mut renderer = device::renderer(&gpu, &scene, &cameras[0], SIZE, true);
    let want: Vec<_> = cameras.iter().map(|c| renderer.render(c, 1.0).unwrap().trees).collect();
    let picture = renderer.picture().unwrap();
    for place in 1..40 {
        let first = submit(&mut renderer, &cameras[0]);
        gpu.fail(canopy::gpu::Failure::HostMemory, place);
        let eye = Eye::new(&cameras[1], &scene.terrain, SIZE);
        let cascades = renderer.cascades(&eye);
        let second = renderer.submit(&eye, &cascades, 1.0);
        gpu.fail(canopy::gpu::Failure::HostMemory, 0);
        assert_eq!(renderer.finish(first).unwrap().0.trees, want[0]);
        match second {
            Ok(second) => {
                assert!(place > 2, "no place in a frame can fail");
                renderer.finish(second).unwrap();
                break;
            }
            Err(e) => assert_eq!(e.exit_code(), 6, "{e}"),
        }
    }
    renderer.render(cameras.last().unwrap(), 1.0).unwrap();
    assert!(renderer.picture().unwrap() == picture, "a failure has left its mark");
    drop(renderer);
    gpu.close().unwrap();
}

/// The layers notice a slot that is used again before its submission was waited for.
#[test]
fn a_slot_that_is_used_too_early_is_reported() {
    let gpu = device::open();
    let ring = Ring::default();
    let buffer = gpu.buffer("victim", 64).unwrap();
    let mut recorder = gpu.record_in(&ring).unwrap();
    recorder.fill("fill", &buffer, 7);
    recorder.launch().unwrap().reuse_for_test();
    // The device itself is long done: only the wait is missing, so nothing goes wrong but what the layers see.
    std::thread::sleep(std::time::Duration::from_millis(300));
    gpu.record_in(&ring).unwrap().submit().unwrap();
    drop((ring, buffer));
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.contains("VUID-vkResetCommandPool")), "{messages:?}");
    assert_eq!(gpu.close().unwrap_err().exit_code(), 4);
}

/// What is uploaded for a frame is that frame's, though the next one's is written before the device begins.
#[test]
fn uploads_in_flight_are_those_of_their_recording() {
    let gpu = device::open();
    let ring = Ring::default();
    let buffer = gpu.buffer("numbers", 1 << 19).unwrap();
    // The third is longer than a slot's first memory.
    let content = |k: u32| vec![k; if k == 2 { 1 << 16 } else { 16 }];
    let flights: Vec<_> = (0..5)
        .map(|k| {
            let mut recorder = gpu.record_in(&ring).unwrap();
            recorder.upload(&buffer, 0, &content(k)).unwrap();
            recorder.upload(&buffer, 1 << 18, &[k + 100]).unwrap();
            let first = recorder.read::<u32>(&buffer, 0, 16).unwrap();
            let other = recorder.read::<u32>(&buffer, 1 << 18, 1).unwrap();
            (k, recorder.launch().unwrap(), first, other)
        })
        .collect();
    for (k, flight, first, other) in flights {
        let done = flight.wait().unwrap();
        assert_eq!((done.get(&first), done.get(&other)), (vec![k; 16], vec![k + 100]));
    }
    drop((ring, buffer));
    gpu.close().unwrap();
}
