//! The view directions of a z-field (BN12 §5): where the stored views look from, and which three of them
//! surround a given direction.
//!
//! The views of a field with n rings are the integer pairs (i, j) with |i| + |j| ≤ n, 2n(n+1) + 1 of them.
//! With x = (i+j)/n and y = (j−i)/n, a view has the zenith angle 90°·max(|x|, |y|) and the azimuth
//! atan2(y, x): concentric squares, 90°/n apart, with 4k views on ring k. The layout is symmetric under
//! quarter turns about the vertical.

use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// An unending spread of directions over the upper hemisphere (additive recurrence of the plane's golden ratio, equal solid angles).
pub fn spread() -> impl Iterator<Item = DVec3> {
    (0u64..).map(|k| {
        let k = k as f64 + 0.5;
        let z = (k * 0.754_877_666_246_692_7).fract();
        let (s, c) = (std::f64::consts::TAU * (k * 0.569_840_290_998_053_2).fract()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * c, r * s, z)
    })
}

/// Number of views of a field with `n` rings: 2n(n+1) + 1.
pub const fn count(n: u32) -> u32 {
    2 * n * (n + 1) + 1
}

/// Texture layer of the view (i, j), |i| + |j| ≤ n: rows of constant i one after the other, j growing.
///
/// Row i holds 2(n − |i|) + 1 views, so it starts at (i+n)² for i ≤ 0 and at n² + i(2n+1) − i(i−1) above.
pub fn layer(n: u32, i: i32, j: i32) -> u32 {
    let n = n as i32;
    debug_assert!(i.abs() + j.abs() <= n, "({i}, {j}) is no view of {n} rings");
    let row = if i <= 0 { (i + n) * (i + n) } else { n * n + i * (2 * n + 1) - i * (i - 1) };
    (row + j + n - i.abs()) as u32
}

/// All views (i, j) of a field with `n` rings, in the order of their layers.
pub fn pairs(n: u32) -> impl Iterator<Item = (i32, i32)> {
    let n = n as i32;
    (-n..=n).flat_map(move |i| (i.abs() - n..=n - i.abs()).map(move |j| (i, j)))
}

/// Unit vector towards the viewer of the stored view (i, j).
pub fn direction(n: u32, i: i32, j: i32) -> DVec3 {
    let (x, y) = ((i + j) as f64 / n as f64, (j - i) as f64 / n as f64);
    spherical(FRAC_PI_2 * x.abs().max(y.abs()), y.atan2(x))
}

fn spherical(zenith: f64, azimuth: f64) -> DVec3 {
    let (st, ct) = zenith.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    DVec3::new(st * ca, st * sa, ct)
}

/// Zenith angle and azimuth. Well defined everywhere: atan2 keeps its precision where acos loses it, and
/// the azimuth of the vertical is 0.
pub fn angles(w: DVec3) -> (f64, f64) {
    (w.x.hypot(w.y).atan2(w.z), w.y.atan2(w.x))
}

/// The axes of an orthographic view, and the half extents of its image in the scaled tree's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// Unit vector to the right in the image.
    pub right: DVec3,
    /// Unit vector upwards in the image.
    pub up: DVec3,
    /// Unit vector towards the viewer.
    pub w: DVec3,
    /// Half height of the image: |p·up| ≤ |sin θ| + |cos θ| in the cylinder r ≤ 1, |z| ≤ 1. Half its width is 1.
    pub extent: f64,
}

impl Basis {
    /// The view towards which `w` points (need not be of unit length, nor in the upper hemisphere):
    /// right = (−sin a, cos a, 0), up = (−cos θ cos a, −cos θ sin a, sin θ).
    pub fn new(w: DVec3) -> Self {
        let (t, a) = angles(w);
        let ((st, ct), (sa, ca)) = (t.sin_cos(), a.sin_cos());
        Basis {
            right: DVec3::new(-sa, ca, 0.0),
            up: DVec3::new(-ct * ca, -ct * sa, st),
            w: DVec3::new(st * ca, st * sa, ct),
            extent: st + ct.abs(),
        }
    }
}

/// One of the three views around a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedView {
    /// i of the view.
    pub i: i32,
    /// j of the view.
    pub j: i32,
    /// Barycentric weight, in [0, 1].
    pub weight: f64,
}

/// The three views around a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// The views; weights sum to 1, and a view of weight 0 is still a valid one.
    pub views: [WeightedView; 3],
    /// The direction points down: the views are those around the opposite one, seen from behind.
    pub below: bool,
}

/// The three stored views around the direction `w` (any length but zero).
///
/// m = θ/90°, (x, y) = m (cos a, sin a)/max(|cos a|, |sin a|), fi = n(x−y)/2, fj = n(x+y)/2. Each unit cell
/// of (|fi|, |fj|) is cut along its falling diagonal, so that the cut follows the rings and none crosses the
/// horizon; weights are barycentric in the triangle.
pub fn lookup(n: u32, w: DVec3) -> Lookup {
    let below = w.z < 0.0;
    let (t, a) = angles(if below { -w } else { w });
    let (sa, ca) = a.sin_cos();
    let m = t / FRAC_PI_2 / ca.abs().max(sa.abs());
    let (x, y) = (m * ca, m * sa);
    let (fi, fj) = (n as f64 * (x - y) / 2.0, n as f64 * (x + y) / 2.0);
    let (si, sj) = (if fi < 0.0 { -1 } else { 1 }, if fj < 0.0 { -1 } else { 1 });
    let (a0, b0) = (fi.abs().floor(), fj.abs().floor());
    let (fa, fb) = (fi.abs() - a0, fj.abs() - b0);
    let (a0, b0) = (a0 as i32, b0 as i32);
    let corners = if fa + fb <= 1.0 {
        [(a0, b0, (1.0 - fa - fb).max(0.0)), (a0 + 1, b0, fa), (a0, b0 + 1, fb)]
    } else {
        [(a0 + 1, b0 + 1, (fa + fb - 1.0).max(0.0)), (a0, b0 + 1, 1.0 - fa), (a0 + 1, b0, 1.0 - fb)]
    };
    // Corners beyond the horizon have no weight but for rounding: they take the place of the heaviest.
    let valid = |&(a, b, _): &(i32, i32, f64)| a + b <= n as i32;
    let heaviest =
        corners.into_iter().filter(valid).fold((0, 0, -1.0), |best, c| if c.2 > best.2 { c } else { best });
    let sum: f64 = corners.iter().filter(|c| valid(c)).map(|c| c.2).sum();
    let views = corners.map(|c| {
        let (a, b, weight) =
            if valid(&c) { (c.0, c.1, (c.2 / sum).min(1.0)) } else { (heaviest.0, heaviest.1, 0.0) };
        WeightedView { i: si * a, j: sj * b, weight }
    });
    Lookup { views, below }
}
