//! Boxes around what an eye or the sun may see.

/// An axis-aligned box in world coordinates, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub low: [f64; 3],
    /// Largest corner.
    pub high: [f64; 3],
}

impl Bounds {
    /// Distance from a point; 0 inside.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        let d = [0, 1, 2].map(|k| (self.low[k] - p[k]).max(p[k] - self.high[k]).max(0.0));
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
    }

    /// Distance of its farthest corner from a point.
    pub fn farthest(&self, p: [f64; 3]) -> f64 {
        let d = [0, 1, 2].map(|k| (self.high[k] - p[k]).abs().max((self.low[k] - p[k]).abs()));
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
    }

    /// The same with so much more of height, m.
    pub fn raised(&self, by: f64) -> Bounds {
        let [x, y, z] = self.high;
        Bounds { high: [x, y, z + by], ..*self }
    }

    /// Whether any of it is on the inner side of every plane (n, d), n·p + d ≥ 0 inside, for points from `eye`.
    pub fn touches(&self, planes: &[[f64; 4]], eye: [f64; 3]) -> bool {
        planes.iter().all(|n| {
            let farthest = [0, 1, 2].map(|k| if n[k] > 0.0 { self.high[k] } else { self.low[k] } - eye[k]);
            n[0] * farthest[0] + n[1] * farthest[1] + n[2] * farthest[2] + n[3] >= 0.0
        })
    }
}
