//! Samples of a field over the ground, such as a height or density map.

/// A raster of 32-bit floats; row 0 is **south**, so that row and y grow together.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Samples west to east.
    pub width: u32,
    /// Samples south to north.
    pub height: u32,
    /// `width * height` samples, row by row from the south-west corner.
    pub samples: Vec<f32>,
}
