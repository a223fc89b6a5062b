//! The built-in terrain: forested ridges, the same on every machine.
//!
//! A ridged multifractal (Musgrave, in Ebert et al., "Texturing and Modeling", 2003, ch. 16) of gradient noise on an
//! integer-hashed lattice: each octave is `(1 - a|n|)²`, weighted by the octave before, so that detail gathers on crests.

use crate::physics::raster::Raster;

/// Samples a side.
pub const SAMPLES: u32 = 401;
/// Metres between samples: 8 km a side.
pub const CELL_SIZE: f64 = 20.0;
/// Heights span 0 to this, m.
const RELIEF: f64 = 600.0;
/// Size of the largest ridges, m.
const WAVELENGTH: f64 = 1900.0;
const OCTAVES: u32 = 6;
/// How far crests are rounded, in units of the noise.
const CREST: f64 = 0.1;
/// Ratio of successive wavelengths; not 2, lest the lattices of the octaves coincide and show.
const LACUNARITY: f64 = 2.13;

/// Integer hash of a lattice point (Wellons' lowbias32 rounds).
fn hash(x: i32, y: i32, octave: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ octave.wrapping_mul(0xc2b2_ae3d);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// Gradient noise (Perlin 2002) in about -1 to 1.
fn noise(x: f64, y: f64, octave: u32) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let (u, v) = (x - i, y - j);
    let corner = |di: i32, dj: i32| {
        // Sixteen directions from the hash; angles would differ in the last bit between mathematics libraries.
        const DIRECTIONS: [[f64; 2]; 8] = [
            [1.0, 0.0],
            [0.924, 0.383],
            [0.707, 0.707],
            [0.383, 0.924],
            [0.0, 1.0],
            [-0.383, 0.924],
            [-0.707, 0.707],
            [-0.924, 0.383],
        ];
        let h = hash(i as i32 + di, j as i32 + dj, octave);
        let [a, b] = DIRECTIONS[(h & 7) as usize];
        let dot = a * (u - f64::from(di)) + b * (v - f64::from(dj));
        if h & 8 == 0 { dot } else { -dot }
    };
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (s, t) = (fade(u), fade(v));
    1.5 * mix(mix(corner(0, 0), corner(1, 0), s), mix(corner(0, 1), corner(1, 1), s), t)
}

/// Relative height at a place, m from the south-west corner.
fn ridged(x: f64, y: f64) -> f64 {
    let (mut sum, mut weight, mut amplitude, mut frequency) = (0.0, 1.0, 1.0, 1.0 / WAVELENGTH);
    // Ridges run south-west to north-east, as folded mountains do: the lattice is stretched along that diagonal.
    let (along, across) = (0.5 * (x + y) * 0.707, (x - y) * 0.707);
    // A slow warp bends the crests.
    let warp = 500.0 * noise(along / 2600.0, across / 2600.0, 100);
    for octave in 0..OCTAVES {
        let n = noise((along + warp) * frequency, (across + warp) * frequency, octave);
        // Noise seldom comes near ±1: steepened, the folds fall to level valley floors; rounded, crests are no knives.
        let fold = (n * n + CREST * CREST).sqrt() - CREST;
        let ridge = (1.0 - 1.4 * fold).max(0.0).powi(2) * weight;
        sum += ridge * amplitude;
        weight = (1.2 * ridge).clamp(0.0, 1.0);
        amplitude *= 0.3;
        frequency *= LACUNARITY;
    }
    sum
}

/// The terrain `builtin:ridge`: 8 km a side, heights exactly 0 to 600 m.
pub fn ridge() -> Raster {
    let place = |i: u32| f64::from(i) * CELL_SIZE;
    let raw: Vec<f64> =
        (0..SAMPLES).flat_map(|j| (0..SAMPLES).map(move |i| ridged(place(i), place(j)))).collect();
    let (low, high) = raw.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    let samples = raw.iter().map(|v| (RELIEF * (v - low) / (high - low)) as f32).collect();
    Raster { width: SAMPLES, height: SAMPLES, samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terrain_is_ridges_that_trees_can_stand_on() {
        let r = ridge();
        assert_eq!(r.samples.len(), (SAMPLES * SAMPLES) as usize);
        let span = r.samples.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        assert_eq!(span, (0.0, RELIEF as f32));
        let w = SAMPLES as usize;
        let mut slopes = Vec::new();
        for j in 0..w - 1 {
            for i in 0..w - 1 {
                let h = r.samples[j * w + i];
                let d = [r.samples[j * w + i + 1] - h, r.samples[(j + 1) * w + i] - h];
                slopes.push((d[0].hypot(d[1]) / CELL_SIZE as f32).atan().to_degrees());
            }
        }
        let mean = slopes.iter().sum::<f32>() / slopes.len() as f32;
        let steepest = slopes.iter().copied().fold(0.0, f32::max);
        assert!((8.0..25.0).contains(&mean) && steepest < 70.0, "mean {mean}, steepest {steepest}");
    }

    #[test]
    fn noise_is_continuous_across_the_lattice() {
        for k in 0..50 {
            let y = f64::from(k) * 0.37 - 9.0;
            assert!((noise(3.0 - 1e-9, y, 1) - noise(3.0 + 1e-9, y, 1)).abs() < 1e-6);
        }
    }
}
