//! The container, the buffers and the images of a glTF file: GLB chunks, `data:` URIs and files beside the model.

use std::path::{Component, Path, PathBuf};

use base64::Engine;
use gltf::json;
use percent_encoding::percent_decode_str;

use super::MAX_BYTES;
use crate::input::read_bytes;
use crate::{Error, Result};

/// The bytes of every buffer, each exactly as long as the file says.
pub(super) struct Buffers {
    data: Vec<Vec<u8>>,
    folder: Option<PathBuf>,
}

impl Buffers {
    /// The bytes of a buffer.
    pub fn get(&self, index: usize) -> Option<&[u8]> {
        self.data.get(index).map(Vec::as_slice)
    }

    /// The bytes of a view; `None` if it leaves its buffer.
    pub fn view(&self, view: &gltf::buffer::View) -> Option<&[u8]> {
        let end = view.offset().checked_add(view.length())?;
        self.get(view.buffer().index())?.get(view.offset()..end)
    }

    /// The file bytes of an image. Errors name the image.
    pub fn image(&self, name: &Path, document: &gltf::Document, index: usize) -> Result<Vec<u8>> {
        let place = format!("images[{index}]");
        let image = &document.as_json().images[index];
        match (&image.uri, &image.buffer_view) {
            (Some(uri), None) => resolve(name, &place, uri, self.folder.as_deref()),
            (None, Some(view)) => {
                // Validated: the view exists.
                let bytes = document.views().nth(view.value()).and_then(|v| self.view(&v));
                let remedy = "the file is damaged or truncated; export or copy it again";
                bytes.map(<[u8]>::to_vec).ok_or_else(|| {
                    Error::input(
                        name,
                        &place,
                        format!("bufferViews[{}] leaves its buffer", view.value()),
                        remedy,
                    )
                })
            }
            _ => Err(Error::input(
                name,
                &place,
                "the image needs either `uri` or `bufferView`",
                "export it again",
            )),
        }
    }
}

/// Parses and validates the document and reads its buffers.
pub(super) fn open(name: &Path, bytes: &[u8], folder: Option<&Path>) -> Result<(gltf::Document, Buffers)> {
    let (text, mut chunk) = split(name, bytes)?;
    let mut root: json::Root = json::deserialize::from_slice(text).map_err(|e| {
        let place = format!("JSON line {}, column {}", e.line(), e.column());
        Error::input(name, place, e.to_string(), "export the model again")
    })?;
    check_positions(name, &root)?;
    // Of this the `gltf` crate knows nothing, and we do.
    root.extensions_required.retain(|e| e != super::transmission::NAME);
    let document = gltf::Document::from_json(root).map_err(|e| invalid(name, e))?;
    let mut data = Vec::new();
    let mut total = 0u64;
    for (i, buffer) in document.as_json().buffers.iter().enumerate() {
        let place = format!("buffers[{i}]");
        let mut bytes = match &buffer.uri {
            Some(uri) => resolve(name, &place, uri, folder)?,
            // Only the first buffer may be the binary chunk (glTF 2.0, 4.4.3.3).
            None => match chunk.take().filter(|_| i == 0) {
                Some(chunk) => chunk.to_vec(),
                None => {
                    return Err(Error::input(
                        name,
                        place,
                        "the buffer has no data",
                        "add its `uri` or the GLB's BIN chunk",
                    ));
                }
            },
        };
        let length = buffer.byte_length.0;
        if (bytes.len() as u64) < length {
            let what = format!("the buffer has {} bytes; `byteLength` is {length}", bytes.len());
            return Err(Error::input(
                name,
                place,
                what,
                "the file is damaged or truncated; export or copy it again",
            ));
        }
        bytes.truncate(length as usize);
        total += length;
        if total > MAX_BYTES {
            let what = format!("the buffers have more than {MAX_BYTES} bytes");
            return Err(Error::input(name, place, what, "simplify the model"));
        }
        data.push(bytes);
    }
    Ok((document, Buffers { data, folder: folder.map(Path::to_path_buf) }))
}

/// That every POSITION names an accessor: the `gltf` crate's own validation looks its bounds up unchecked.
fn check_positions(name: &Path, root: &json::Root) -> Result<()> {
    let position = json::validation::Checked::Valid(json::mesh::Semantic::Positions);
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(index) = primitive.attributes.get(&position)
                && index.value() >= root.accessors.len()
            {
                let what =
                    format!("POSITION is accessors[{}]; there are {}", index.value(), root.accessors.len());
                let place = format!("meshes[{m}].primitives[{p}]");
                return Err(Error::input(name, place, what, "export the model again"));
            }
        }
    }
    Ok(())
}

/// The JSON and the binary chunk, if there is one. The header is checked before the `gltf` crate reads it, because that
/// subtracts from its length field.
fn split<'a>(name: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let bad = |what: String| {
        Error::input(name, "GLB header", what, "the file is damaged or truncated; export or copy it again")
    };
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let length = word(8).ok_or_else(|| bad(format!("the file has only {} bytes", bytes.len())))? as usize;
    if length < 20 || length > bytes.len() {
        return Err(bad(format!("it announces {length} bytes; the file has {}", bytes.len())));
    }
    let glb = gltf::Glb::from_slice(&bytes[..length]).map_err(|e| bad(e.to_string()))?;
    match (glb.json, glb.bin) {
        (std::borrow::Cow::Borrowed(json), None) => Ok((json, None)),
        (std::borrow::Cow::Borrowed(json), Some(std::borrow::Cow::Borrowed(bin))) => Ok((json, Some(bin))),
        _ => Err(bad("the chunks could not be read".to_string())),
    }
}

fn invalid(name: &Path, error: gltf::Error) -> Error {
    let remedy = "export the model again, as plain glTF 2.0 without required extensions";
    match error {
        gltf::Error::Validation(list) => match list.first() {
            Some((path, error)) => Error::input(name, path.to_string(), error.to_string(), remedy),
            None => Error::input(name, "", "the model is invalid", remedy),
        },
        other => Error::input(name, "", other.to_string(), remedy),
    }
}

/// The bytes at a URI: `data:` with base64, or a file in `folder` or below it.
fn resolve(name: &Path, place: &str, uri: &str, folder: Option<&Path>) -> Result<Vec<u8>> {
    // Data URIs run to megabytes: messages show their beginning.
    let shown: String = uri.chars().take(80).collect();
    let bad =
        |what: String, remedy: &str| Error::input(name, format!("{place}, URI \"{shown}\""), what, remedy);
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, payload)) = data.split_once(";base64,") else {
            return Err(bad("the data URI is not base64".into(), "export the model again"));
        };
        let decoded = base64::engine::general_purpose::STANDARD.decode(payload);
        return decoded.map_err(|e| bad(format!("the base64 is wrong: {e}"), "export the model again"));
    }
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|e| bad(e.to_string(), "use UTF-8"))?;
    let relative = Path::new(decoded.as_ref());
    let plain = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    // A colon is a scheme or a drive, a backslash a separator on some systems.
    if !plain || decoded.is_empty() || decoded.contains([':', '\\', '\0']) {
        let what = "the URI is absolute, has a scheme, or leaves the model's folder";
        return Err(bad(what.into(), "put the file beside the model and use a relative URI"));
    }
    let Some(folder) = folder else {
        return Err(bad("this model is not in a folder".into(), "embed the data in the model"));
    };
    // An empty parent, that of a bare file name, is the current folder.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(relative);
    let missing =
        |e: std::io::Error| bad(format!("the file cannot be read: {e}"), "put the file beside the model");
    let real = path.canonicalize().map_err(missing)?;
    if !real.starts_with(folder.canonicalize().map_err(missing)?) {
        let what = "a link leads out of the model's folder";
        return Err(bad(what.into(), "put the file itself beside the model"));
    }
    read_bytes(&real, MAX_BYTES)
}
