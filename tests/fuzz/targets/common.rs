//! What the targets share.

use std::alloc::System;
use std::path::{Path, PathBuf};

use cap::Cap;

/// No small file may make a reader want a gigabyte: beyond it, allocation fails and the run ends with a finding.
#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, 1 << 30);

/// A file with these bytes, in `TMPDIR`, for readers that take a path; the same file each time.
#[allow(dead_code)] // Each target is a program of its own.
pub fn file(bytes: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("canopy-fuzz-{}", std::process::id()));
    std::fs::write(&path, bytes).expect("TMPDIR can be written");
    path
}

/// What every reader promises: a value, or an error that is the user's to mend and says something.
#[allow(dead_code)]
pub fn settled<T>(result: canopy::Result<T>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) => {
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(!error.to_string().is_empty());
            None
        }
    }
}

/// The seeds of a target.
#[allow(dead_code)]
pub fn seeds(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target)
}
