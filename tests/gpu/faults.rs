//! Validation is alive: deliberate faults are reported, each kind of check by its own.

use crate::device;
use canopy::gpu::Fault;

#[test]
fn a_copy_beyond_the_end_is_reported() {
    let gpu = device::open();
    let buffer = gpu.buffer("victim", 64).unwrap();
    gpu.record().unwrap().fault_for_test(Fault::CopyBeyondTheEnd, &buffer);
    drop(buffer);
    let messages = gpu.messages();
    assert!(
        messages.iter().any(|m| m.contains("VUID-vkCmdCopyBuffer")),
        "core validation is silent: {messages:?}"
    );
    let error = gpu.close().expect_err("a message must fail the run");
    assert_eq!(error.exit_code(), 4, "{error}");
}

#[test]
fn two_writes_without_a_barrier_are_reported() {
    let gpu = device::open();
    let buffer = gpu.buffer("victim", 64).unwrap();
    gpu.record().unwrap().fault_for_test(Fault::WriteAfterWrite, &buffer);
    drop(buffer);
    let messages = gpu.messages();
    assert!(
        messages.iter().any(|m| m.contains("SYNC-HAZARD-WRITE")),
        "synchronization validation is silent: {messages:?}"
    );
    assert_eq!(gpu.close().unwrap_err().exit_code(), 4);
}

#[test]
fn without_a_fault_there_is_no_message() {
    let gpu = device::open();
    let buffer = gpu.buffer("innocent", 64).unwrap();
    let mut recorder = gpu.record().unwrap();
    recorder.fill("fill", &buffer, 7);
    recorder.fill("fill again", &buffer, 8);
    recorder.submit().unwrap();
    assert_eq!(gpu.read::<u32>(&buffer, 0, 16).unwrap(), [8; 16]);
    drop(buffer);
    gpu.close().unwrap();
}

#[test]
fn a_leak_is_reported_by_name() {
    let gpu = device::open();
    let buffer = gpu.buffer("forgotten", 64).unwrap();
    let error = gpu.clone().close().expect_err("a live buffer is a leak").to_string();
    assert!(error.contains("forgotten"), "{error}");
    drop(buffer);
    gpu.close().unwrap();
}
