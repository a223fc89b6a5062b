//! Reading files with a bound on their size, so that a wrong path cannot exhaust memory.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::{Error, Result};

/// Reads a whole regular file of at most `limit` bytes.
///
/// Errors: [`Error::Io`] if it cannot be read, [`Error::Input`] if it is no regular file or too large.
pub(crate) fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let io = |e| Error::io(path, e);
    // Asked before it is opened: opening a pipe would wait for a writer.
    let meta = path.metadata().map_err(io)?;
    if !meta.is_file() {
        return Err(Error::input(path, "", "this is not a regular file", "name a file"));
    }
    let mut file = File::open(path).map_err(io)?;
    let too_large = |length: u64| {
        let what = format!("the file has {length} bytes; at most {limit} are read");
        Error::input(path, "", what, "use a smaller file")
    };
    if meta.len() > limit {
        return Err(too_large(meta.len()));
    }
    let mut bytes = Vec::with_capacity(meta.len() as usize);
    // The file may grow while it is read: the bound holds for what arrives, not for what was announced.
    file.by_ref().take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Reads a whole UTF-8 text file of at most `limit` bytes. Errors as [`read_bytes`], and for text that is not UTF-8.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<String> {
    String::from_utf8(read_bytes(path, limit)?).map_err(|e| {
        let place = format!("byte {}", e.utf8_error().valid_up_to());
        Error::input(path, place, "the text is not valid UTF-8", "save the file as UTF-8")
    })
}

/// How many bytes of image a byte of file can hold: Deflate reaches 1032, LZW 1340, JPEG less.
const MAX_EXPANSION: u64 = 2048;

/// Refuses an image of `needed` decoded bytes that a file of `bytes` cannot hold, before memory is set aside for it: a
/// few damaged bytes in a header would otherwise ask for gigabytes.
///
/// Errors: [`Error::Input`] with the size that the header announces.
pub(crate) fn check_content(
    path: &Path,
    place: &str,
    bytes: usize,
    (width, height): (u64, u64),
    needed: u64,
) -> Result<()> {
    if needed <= (bytes as u64).saturating_mul(MAX_EXPANSION) {
        return Ok(());
    }
    let what = format!("the header announces {width} × {height}, but there are only {bytes} bytes");
    Err(Error::input(path, place, what, "the image is damaged or truncated; write it again"))
}

/// Decodes an image. Decoders of others have been seen to panic on damaged files: that is the file's fault, not the end of
/// the program.
pub(crate) fn decoded<T>(path: &Path, place: &str, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        Err(Error::input(path, place, "the decoder gave up on this image", "it is damaged; write it again"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_and_encoding_are_checked() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        std::fs::write(&path, b"abc\xff").unwrap();
        assert_eq!(read_bytes(&path, 4).unwrap(), b"abc\xff");
        assert!(read_bytes(&path, 3).unwrap_err().to_string().contains("at most 3"));
        assert!(read_text(&path, 4).unwrap_err().to_string().contains("byte 3"));
        assert!(read_bytes(dir.path(), 10).is_err());
        assert!(matches!(read_bytes(&dir.path().join("none"), 10), Err(Error::Io { .. })));
    }
}
