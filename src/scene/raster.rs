//! Height and density rasters from PNG and TIFF files.
//!
//! Dimensions and sample types are checked on the header, before the image is decoded.

use std::io::Cursor;
use std::path::Path;

use image::ImageDecoder;
use tiff::decoder::DecodingResult;
use tiff::tags::Tag;

use crate::input::{check_content, read_bytes};
use crate::physics::raster::Raster;
use crate::{Error, Result};

/// Most samples along a side of a raster.
pub const MAX_SIDE: u32 = 16384;

const MAX_BYTES: u64 = 4 << 30;

/// Heights beyond these, m, are no ground on earth: they mark missing samples or wrong units.
const HEIGHTS: std::ops::RangeInclusive<f64> = -12_000.0..=12_000.0;

/// What producers of float rasters write for missing samples when they say so nowhere.
const USUAL_NODATA: f64 = -9999.0;

/// Samples as the file has them; row 0 is north.
enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    F32(Vec<f32>),
}

impl Samples {
    fn get(&self, i: usize) -> f64 {
        match self {
            Samples::U8(v) => v[i].into(),
            Samples::U16(v) => v[i].into(),
            Samples::I16(v) => v[i].into(),
            Samples::F32(v) => v[i].into(),
        }
    }

    fn len(&self) -> usize {
        match self {
            Samples::U8(v) => v.len(),
            Samples::U16(v) => v.len(),
            Samples::I16(v) => v.len(),
            Samples::F32(v) => v.len(),
        }
    }

    /// The largest value of an integer format.
    fn largest(&self) -> Option<f64> {
        match self {
            Samples::U8(_) => Some(u8::MAX.into()),
            Samples::U16(_) => Some(u16::MAX.into()),
            Samples::I16(_) => Some(i16::MAX.into()),
            Samples::F32(_) => None,
        }
    }
}

struct Grey {
    width: u32,
    height: u32,
    samples: Samples,
    nodata: Option<f64>,
}

impl Grey {
    /// Maps every sample and turns the rows around, south first. `map` fails with what is wrong with a sample.
    fn raster(&self, path: &Path, map: impl Fn(f64) -> std::result::Result<f32, String>) -> Result<Raster> {
        let (width, height) = (self.width as usize, self.height as usize);
        let mut samples = Vec::with_capacity(width * height);
        for row in (0..height).rev() {
            for column in 0..width {
                let value = self.samples.get(row * width + column);
                let mapped = if self.nodata == Some(value) {
                    Err(format!("the sample is {value}, which this file marks as missing"))
                } else {
                    map(value)
                };
                samples.push(mapped.map_err(|what| {
                    let place = format!("column {column}, row {row} (row 0 is north)");
                    Error::input(path, place, what, "fill in or correct the samples")
                })?);
            }
        }
        Ok(Raster { width: self.width, height: self.height, samples })
    }
}

fn check_side(path: &Path, width: u32, height: u32) -> Result<()> {
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
        let what = format!("the image is {width} × {height}");
        return Err(Error::input(path, "", what, format!("use 1 to {MAX_SIDE} samples a side")));
    }
    Ok(())
}

fn not_grey(path: &Path, what: impl std::fmt::Display) -> Error {
    let remedy = "use one grey channel: 8 or 16 bits (PNG, TIFF), or 32-bit float (TIFF)";
    Error::input(path, "", format!("the samples are {what}"), remedy)
}

fn decode_png(path: &Path, bytes: &[u8]) -> Result<Grey> {
    let bad = |e: image::ImageError| Error::input(path, "", e.to_string(), "write the PNG again");
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(2 << 30);
    let decoder = image::codecs::png::PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(bad)?;
    let (width, height) = decoder.dimensions();
    check_side(path, width, height)?;
    let color = decoder.color_type();
    if !matches!(color, image::ColorType::L8 | image::ColorType::L16) {
        return Err(not_grey(path, format!("{color:?}")));
    }
    check_content(path, "", bytes.len(), (width.into(), height.into()), decoder.total_bytes())?;
    let samples = match image::DynamicImage::from_decoder(decoder).map_err(bad)? {
        image::DynamicImage::ImageLuma8(i) => Samples::U8(i.into_raw()),
        image::DynamicImage::ImageLuma16(i) => Samples::U16(i.into_raw()),
        other => return Err(not_grey(path, format!("{:?}", other.color()))),
    };
    Ok(Grey { width, height, samples, nodata: None })
}

fn decode_tiff(path: &Path, bytes: &[u8]) -> Result<Grey> {
    let bad = |e: tiff::TiffError| Error::input(path, "", e.to_string(), "write the TIFF again");
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(bytes)).map_err(bad)?;
    let (width, height) = decoder.dimensions().map_err(bad)?;
    check_side(path, width, height)?;
    let color = decoder.colortype().map_err(bad)?;
    let tiff::ColorType::Gray(bits @ (8 | 16 | 32)) = color else {
        return Err(not_grey(path, format!("{color:?}")));
    };
    let size = (u64::from(width), u64::from(height));
    check_content(path, "", bytes.len(), size, size.0 * size.1 * u64::from(bits / 8))?;
    let mut limits = tiff::decoder::Limits::default();
    // Exactly this image: four bytes a sample, and a strip or tile as large as the whole.
    limits.decoding_buffer_size = width as usize * height as usize * 4;
    limits.intermediate_buffer_size = limits.decoding_buffer_size.max(1 << 20);
    // Tables of strips and tiles of the largest raster.
    limits.ifd_value_size = 16 << 20;
    let mut decoder = decoder.with_limits(limits);
    // GDAL writes the missing value as text, whatever the sample type.
    let nodata = match decoder.find_tag(Tag::GdalNodata).map_err(bad)? {
        Some(value) => {
            let text = value.into_string().map_err(bad)?;
            text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse::<f64>().ok()
        }
        None => None,
    };
    let samples = match decoder.read_image().map_err(bad)? {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::I16(v) => Samples::I16(v),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::U32(_) | DecodingResult::I32(_) => return Err(not_grey(path, "32-bit integers")),
        _ => return Err(not_grey(path, "of an unusual type")),
    };
    if samples.len() != width as usize * height as usize {
        return Err(Error::input(path, "", "the image data is incomplete", "write the TIFF again"));
    }
    Ok(Grey { width, height, samples, nodata })
}

fn decode(path: &Path) -> Result<Grey> {
    let bytes = read_bytes(path, MAX_BYTES)?;
    match bytes.get(..4) {
        Some(b"\x89PNG") => decode_png(path, &bytes),
        Some(b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+") => decode_tiff(path, &bytes),
        _ => Err(Error::input(path, "", "this is neither PNG nor TIFF", "convert it to PNG or TIFF")),
    }
}

/// Reads a height map, m: PNG with 8 or 16 bits, or TIFF with 8 or 16 bits or 32-bit float.
///
/// Integer samples need `height_range`, the heights at sample 0 and at the largest sample (255, 65535, or 32767
/// for signed samples, whose negative values continue the line); float samples are metres and must not have it.
/// Errors also: missing or non-finite samples and heights beyond ±12 km, with their position; fewer than 2 or more
/// than [`MAX_SIDE`] samples a side.
pub fn load_heights(path: &Path, height_range: Option<[f64; 2]>) -> Result<Raster> {
    let grey = decode(path)?;
    if grey.width < 2 || grey.height < 2 {
        let what = format!("a height map of {} × {} samples spans no ground", grey.width, grey.height);
        return Err(Error::input(path, "", what, "use at least 2 samples a side"));
    }
    let (low, step) = match (grey.samples.largest(), height_range) {
        (Some(largest), Some([low, high])) => (low, (high - low) / largest),
        (None, None) => (0.0, 1.0),
        (Some(_), None) => {
            let remedy =
                "add `height_range = [metres at sample 0, metres at the largest sample]` to [terrain]";
            return Err(Error::input(path, "", "integer samples say nothing about metres", remedy));
        }
        (None, Some(_)) => {
            let what = "the samples are floats, already metres, but [terrain] has `height_range`";
            return Err(Error::input(path, "", what, "remove `height_range`"));
        }
    };
    let float = grey.samples.largest().is_none();
    grey.raster(path, |sample| {
        let height = low + sample * step;
        if float && sample == USUAL_NODATA {
            Err(format!("the sample is {sample}, which usually marks missing data"))
        } else if !HEIGHTS.contains(&height) {
            Err(format!("the height is {height} m"))
        } else {
            Ok(height as f32)
        }
    })
}

/// Reads a density map, relative to the species' largest density: 8 or 16-bit samples become 0 to 1, 32-bit floats
/// must lie there already. Errors name the place of a sample that does not.
pub fn load_density(path: &Path) -> Result<Raster> {
    let grey = decode(path)?;
    let largest = grey.samples.largest().unwrap_or(1.0);
    grey.raster(path, |sample| {
        let value = sample / largest;
        if (0.0..=1.0).contains(&value) {
            Ok(value as f32)
        } else {
            Err(format!("the density is {value}, not 0 to 1"))
        }
    })
}
