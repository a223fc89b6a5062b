//! The ground between the samples of a height map: bicubic Catmull-Rom interpolation; twin of
//! `shaders/physics/terrain.glsl`. Interpolates the samples, continuous with its slope.

use super::raster::Raster;

fn weights(f: f64) -> [f64; 4] {
    [
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (1.5 * f - 2.5),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (0.5 * f - 0.5),
    ]
}

fn slope_weights(f: f64) -> [f64; 4] {
    [-0.5 + f * (2.0 - 1.5 * f), f * (4.5 * f - 5.0), 0.5 + f * (4.0 - 4.5 * f), f * (1.5 * f - 1.0)]
}

/// Height and its derivatives east and north per texel at a position in texels; samples outside repeat the border.
pub fn height_and_slope(raster: &Raster, x: f64, y: f64) -> [f64; 3] {
    let (cx, cy) = (x.floor(), y.floor());
    let (wx, wy) = (weights(x - cx), weights(y - cy));
    let (dx, dy) = (slope_weights(x - cx), slope_weights(y - cy));
    let clamp = |v: f64, n: u32| v.clamp(0.0, f64::from(n - 1)) as usize;
    let mut sum = [0.0; 3];
    for j in 0..4 {
        let row = clamp(cy + j as f64 - 1.0, raster.height) * raster.width as usize;
        let (mut height, mut slope) = (0.0, 0.0);
        for i in 0..4 {
            let h = f64::from(raster.samples[row + clamp(cx + i as f64 - 1.0, raster.width)]);
            height += wx[i] * h;
            slope += dx[i] * h;
        }
        sum[0] += wy[j] * height;
        sum[1] += wy[j] * slope;
        sum[2] += dy[j] * height;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raster(f: impl Fn(f64, f64) -> f64) -> Raster {
        let (width, height) = (9, 7);
        let samples =
            (0..width * height).map(|k| f(f64::from(k % width), f64::from(k / width)) as f32).collect();
        Raster { width, height, samples }
    }

    #[test]
    fn interpolates_quadratics_exactly_inside() {
        // Catmull-Rom reproduces polynomials up to degree 2 away from the border.
        let f = |x: f64, y: f64| 3.0 + 2.0 * x - y + 0.5 * x * x + 0.25 * x * y;
        let r = raster(f);
        for (x, y) in [(2.0, 3.0), (2.3, 2.9), (4.5, 3.5), (5.99, 1.01)] {
            let [h, sx, sy] = height_and_slope(&r, x, y);
            assert!((h - f(x, y)).abs() < 1e-5);
            assert!((sx - (2.0 + x + 0.25 * y)).abs() < 1e-5);
            assert!((sy - (-1.0 + 0.25 * x)).abs() < 1e-5);
        }
    }

    #[test]
    fn is_continuous_across_cells() {
        let r = raster(|x, y| (x * 1.7).sin() * 10.0 + (y * 2.3).cos() * 5.0);
        for k in 0..6 {
            let x = f64::from(k);
            let (a, b) = (height_and_slope(&r, x - 1e-9, 2.5), height_and_slope(&r, x + 1e-9, 2.5));
            assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-6), "{a:?} {b:?}");
        }
    }
}
