//! One error type; each kind knows its exit code.

use std::path::{Path, PathBuf};

/// What can go wrong, in the terms of the person at the terminal.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Wrong input: names the file, the place in it and the remedy. Exit code 2.
    #[error("{file}{sep}{place}: {what}\n  remedy: {remedy}", sep = if place.is_empty() { "" } else { ": " })]
    Input {
        /// The file as the user named it.
        file: String,
        /// Where in the file: a line, a key, an accessor; empty for the file as a whole.
        place: String,
        /// What is wrong.
        what: String,
        /// What to do about it.
        remedy: String,
    },
    /// Wrong usage of a command or a knob. Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Reading or writing failed. Exit code 2.
    #[error("{}: {source}", path.display())]
    Io {
        /// The path that failed.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A check failed. Exit code 1.
    #[error("{0}")]
    Check(String),
    /// No Vulkan device fits. Exit code 3.
    #[error("{0}")]
    NoDevice(String),
    /// The validation layers spoke. Exit code 4.
    #[error("{0}")]
    Validation(String),
    /// A comparison found something slower than allowed. Exit code 5.
    #[error("{0}")]
    Regression(String),
    /// Device lost or out of memory. Exit code 6.
    #[error("{0}")]
    Device(String),
}

impl Error {
    /// An input error; see [`Error::Input`].
    pub fn input(
        file: impl AsRef<Path>,
        place: impl Into<String>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Error::Input {
            file: file.as_ref().display().to_string(),
            place: place.into(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    /// An input/output error at a path.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io { path: path.as_ref().to_path_buf(), source }
    }

    /// The program's exit code for this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Check(_) => 1,
            Error::Input { .. } | Error::Usage(_) | Error::Io { .. } => 2,
            Error::NoDevice(_) => 3,
            Error::Validation(_) => 4,
            Error::Regression(_) => 5,
            Error::Device(_) => 6,
        }
    }
}

/// Shorthand used throughout the crate.
pub type Result<T> = std::result::Result<T, Error>;
