//! Which ground a far forest that is seen, or that shades, stands on; twin of `shaders/physics/lift.glsl`.
//!
//! The shader-map is drawn on the ground, but a sight line that ends on the ground at p passes over the trees between it and the viewer:
//! at height h, over p + h tan θ of the horizontal direction to the viewer. BN12 look the forest up at p. Trees then seem to lie on the
//! ground: an edge hides nothing of the gap behind it, and gaps narrower than what a sight line passes over are seen through.
//!
//! A ray's optical path is the integral of the crowns' extinction along it. Over crowns of even density from height m − b to m + b it is
//! that of an even forest times x̄/x, where x̄ is the mean of the thickness x over the ground under the ray between these heights: not exp(−x),
//! which is convex, is averaged, but x. For the view it is read at as many heights as there are texels of the coverage tile on the way, at most
//! four, and of coarser texels where four are not enough; for the sun's light on the ground once, of texels as wide as the way.

/// Heights at which a sight line's path through the crowns is read, at most.
pub const LIFT_MOST: f64 = 4.0;

/// How many are, on a way of so many texels.
pub fn lift_count(texels: f64) -> u32 {
    texels.ceil().clamp(1.0, LIFT_MOST) as u32
}

/// Height k of `count`, from −1 at the lower end of crowns to 1 at their upper.
pub fn lift_height(k: u32, count: u32) -> f64 {
    f64::from(2 * k + 1) / f64::from(count) - 1.0
}

/// From a point of ground of unit normal n along the unit vector w, until it is `height` m above the ground: m on the map. No more grazing
/// than a hundredth.
pub fn lifted(w: [f64; 3], n: [f64; 3], height: f64) -> [f64; 2] {
    let over = height * n[2] / (0..3).map(|k| n[k] * w[k]).sum::<f64>().max(0.01);
    [w[0] * over, w[1] * over]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_even_and_as_many_as_texels() {
        assert_eq!([0.0, 0.9, 1.1, 3.5, 99.0].map(lift_count), [1, 1, 2, 4, 4]);
        assert_eq!(lift_height(0, 1), 0.0);
        let heights: Vec<f64> = (0..4).map(|k| lift_height(k, 4)).collect();
        assert_eq!(heights, [-0.75, -0.25, 0.25, 0.75]);
    }

    #[test]
    fn a_ray_is_as_high_over_the_place_where_it_is_lifted() {
        let n = [0.3f64, -0.2, 1.0];
        let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
        let n = n.map(|c| c / length);
        let w = [0.6, 0.0, 0.8];
        let [x, y] = lifted(w, n, 7.0);
        // The ray is there at z, the ground at -(n.x x + n.y y) / n.z.
        let (z, ground) = (x / w[0] * w[2], -(n[0] * x + n[1] * y) / n[2]);
        assert!(y == 0.0 && (z - ground - 7.0).abs() < 1e-12);
        assert_eq!(lifted([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 9.0), [0.0, 0.0]);
    }
}
