//! Files as a whole or not at all: written beside their place, synchronised, then renamed.
//!
//! A full disk, a crash or a kill leaves what stood there before, or nothing; at worst a hidden `.NAME.part-…` stays
//! behind, which a later write of the same file clears away.

use std::collections::hash_map::RandomState;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, Hasher};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::{Error, Result};

/// How old a leftover is before it is cleared away: no write takes as long.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// A file that is not there yet. It takes its place with [`Unfinished::finish`], and is removed if that never comes.
pub(crate) struct Unfinished {
    path: PathBuf,
    beside: PathBuf,
    file: File,
}

impl Unfinished {
    /// Starts a file beside `path`.
    pub fn new(path: &Path) -> io::Result<Self> {
        let name = path.file_name().ok_or_else(|| io::Error::other("this is no file name"))?;
        // A random name: process numbers repeat between containers that share a folder.
        let mut mine = prefix(name);
        mine.push(format!("{:016x}", RandomState::new().build_hasher().finish()));
        let beside = path.with_file_name(mine);
        let file = OpenOptions::new().write(true).create_new(true).open(&beside)?;
        Ok(Unfinished { path: path.to_path_buf(), beside, file })
    }

    /// Writes it through to the disk and puts it in its place.
    pub fn finish(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.beside, &self.path)?;
        clear(&self.path);
        Ok(())
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // It is gone after the rename, and there is nothing to be done about any other failure.
        let _ = fs::remove_file(&self.beside);
    }
}

fn prefix(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(".part-");
    prefix
}

/// Removes what killed runs left of a file. Best effort: a leftover costs space, nothing else.
fn clear(path: &Path) {
    let (Some(name), Some(folder)) = (path.file_name(), path.parent()) else { return };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let prefix = prefix(name);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let ours = entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes());
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if ours && age().is_some_and(|age| age > ABANDONED) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Writes a file as a whole or not at all.
///
/// # Errors
/// [`Error::Io`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = Unfinished::new(path).map_err(|e| Error::io(path, e))?;
    file.write_all(bytes).and_then(|()| file.finish()).map_err(|e| Error::io(path, e))
}

/// BLAKE3 of bytes, in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Whether [`write_whole`] could write there now: for finding out before a long run. Leaves nothing behind.
///
/// # Errors
/// [`Error::Usage`] naming a folder that is missing; [`Error::Io`].
pub fn check_writable(path: &Path) -> Result<()> {
    let shown = path.display();
    if path.is_dir() {
        return Err(Error::Usage(format!("{shown} is a folder; name a file in it")));
    }
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty() && !p.is_dir()) {
        return Err(Error::Usage(format!("{shown}: there is no folder {}; make it first", folder.display())));
    }
    Unfinished::new(path).map(drop).map_err(|e| Error::io(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finished_was_never_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        write_whole(&path, b"first").unwrap();
        let mut second = Unfinished::new(&path).unwrap();
        second.write_all(b"sec").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        drop(second);
        check_writable(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn leftovers_are_cleared_when_they_are_old_and_of_the_same_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let old = std::time::SystemTime::now() - 2 * ABANDONED;
        for name in [".a.bin.part-00", ".b.bin.part-00", ".a.bin"] {
            File::create(path(name)).unwrap().set_modified(old).unwrap();
        }
        File::create(path(".a.bin.part-11")).unwrap();
        write_whole(&path("a.bin"), b"").unwrap();
        let kept = [".a.bin.part-00", ".a.bin.part-11", ".b.bin.part-00", ".a.bin"].map(|n| path(n).exists());
        assert_eq!(kept, [false, true, true, true]);
    }
}
