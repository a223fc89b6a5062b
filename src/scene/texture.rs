//! Colour images: model textures, ground albedo, skies.
//!
//! Dimensions are checked on the header, before an image is decoded.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::{ImageDecoder, ImageFormat, ImageReader};

use super::{Sky, Texture};
use crate::input::{check_content, decoded, read_bytes};
use crate::{Error, Result};

/// Most texels along a side of a texture or sky.
pub const MAX_SIDE: u32 = 8192;

/// Largest radiance of a sky; the sun itself belongs in `[sun]`.
pub const MAX_RADIANCE: f32 = 1e6;

const MAX_BYTES: u64 = 1 << 30;

fn check_side(file: &Path, place: &str, width: u64, height: u64) -> Result<()> {
    let side = 1..=u64::from(MAX_SIDE);
    if side.contains(&width) && side.contains(&height) {
        return Ok(());
    }
    let what = format!("the image is {width} × {height}");
    Err(Error::input(file, place, what, format!("use 1 to {MAX_SIDE} texels a side")))
}

/// Decodes a PNG or JPEG of at most [`MAX_SIDE`] texels a side, grey or colour, with or without opacity.
/// `file` and `place` are for messages.
pub fn decode_texture(file: &Path, place: &str, bytes: &[u8]) -> Result<Texture> {
    let bad = |e: image::ImageError| Error::input(file, place, e.to_string(), "write the image again");
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        _ => return Err(Error::input(file, place, "the image is neither PNG nor JPEG", "convert it to PNG")),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::no_limits();
    // 16-bit RGBA is the widest a PNG has, and the decoder needs rows beside the image.
    limits.max_alloc = Some(u64::from(MAX_SIDE).pow(2) * 8 + (64 << 20));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(bad)?;
    let (width, height) = decoder.dimensions();
    check_side(file, place, width.into(), height.into())?;
    check_content(file, place, bytes.len(), (width.into(), height.into()), decoder.total_bytes())?;
    let decode = || Ok(image::DynamicImage::from_decoder(decoder).map_err(bad)?.into_rgba8().into_raw());
    let rgba = decoded(file, place, decode)?;
    Ok(Texture { width, height, rgba })
}

/// Reads a PNG or JPEG file; see [`decode_texture`].
pub fn load_texture(path: &Path) -> Result<Texture> {
    decode_texture(path, "", &read_bytes(path, MAX_BYTES)?)
}

/// Reads a latitude-longitude sky, linear RGB radiance, from Radiance `.hdr` or OpenEXR; told apart by content.
///
/// Errors: images that are not twice as wide as high, or wider than 2 × [`MAX_SIDE`]; radiance that is negative, not
/// finite or above [`MAX_RADIANCE`], with its position.
pub fn load_sky(path: &Path) -> Result<Sky> {
    let bytes = read_bytes(path, MAX_BYTES)?;
    let (width, height, pixels) = match bytes.get(..4) {
        Some(b"\x76\x2f\x31\x01") => decode_exr(path, &bytes)?,
        Some(start) if start.starts_with(b"#?") => decode_hdr(path, &bytes)?,
        _ => {
            let what = "this is neither Radiance HDR nor OpenEXR";
            return Err(Error::input(path, "", what, "convert it to .hdr or .exr"));
        }
    };
    for (i, &value) in pixels.iter().enumerate() {
        if !(0.0..=MAX_RADIANCE).contains(&value) {
            let (column, row) = (i / 3 % width as usize, i / 3 / width as usize);
            let what = format!("the radiance is {value}, not 0 to {MAX_RADIANCE}");
            return Err(Error::input(path, format!("column {column}, row {row}"), what, "correct the image"));
        }
    }
    Ok(Sky::LatLong { width, height, pixels: Arc::new(pixels) })
}

fn check_sky(path: &Path, width: u64, height: u64) -> Result<()> {
    check_side(path, "", width.div_ceil(2), height)?;
    if width != 2 * height {
        let what = format!("the image is {width} × {height}");
        return Err(Error::input(path, "", what, "a latitude-longitude image is twice as wide as high"));
    }
    Ok(())
}

fn decode_hdr(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<f32>)> {
    let bad = |e: image::ImageError| Error::input(path, "", e.to_string(), "write the image again");
    let decoder = image::codecs::hdr::HdrDecoder::new(Cursor::new(bytes)).map_err(bad)?;
    let (width, height) = decoder.dimensions();
    check_sky(path, width.into(), height.into())?;
    check_content(path, "", bytes.len(), (width.into(), height.into()), decoder.total_bytes())?;
    let pixels = image::DynamicImage::from_decoder(decoder).map_err(bad)?.into_rgb32f().into_raw();
    Ok((width, height, pixels))
}

fn decode_exr(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<f32>)> {
    use exr::prelude::{Compression, ReadChannels, ReadLayers, ReadSpecificChannel};
    let bad = |e: exr::error::Error| Error::input(path, "", e.to_string(), "write the image again");
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(bad)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        check_sky(path, width, height)?;
        // The decoder of these overflows on damaged blocks, and not on a thread of ours where that could be caught.
        if matches!(header.compression, Compression::B44 | Compression::B44A) {
            let what = format!("the compression is {}", header.compression);
            return Err(Error::input(path, "", what, "write the image with ZIP, PIZ or no compression"));
        }
        check_content(path, "", bytes.len(), (width, height), width * height * 12)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| (size.width(), vec![0f32; size.area() * 3]),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| {
                let i = (at.y() * *width + at.x()) * 3;
                pixels[i..i + 3].copy_from_slice(&[r, g, b]);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(bad)?;
    let size = image.layer_data.size;
    Ok((size.width() as u32, size.height() as u32, image.layer_data.channel_data.pixels.1))
}
