use super::*;
use crate::physics::hash::Stream;

/// A unit vector, uniform over the sphere.
fn random(stream: &mut Stream) -> [f64; 3] {
    let z = 2.0 * stream.unit() - 1.0;
    let (azimuth, r) = (2.0 * PI * stream.unit(), (1.0 - z * z).sqrt());
    [r * azimuth.cos(), r * azimuth.sin(), z]
}

#[test]
fn rules_integrate_polynomials() {
    // Means over the sphere: x² 1/3; x⁴ 1/5; x²y² 1/15; x⁶ 1/7; x⁴y² 1/35.
    let mean = |d: &Directions, f: &dyn Fn([f64; 3]) -> f64| -> f64 {
        d.to.iter().zip(&d.weights).map(|(w, weight)| weight * f(*w)).sum()
    };
    for count in Directions::COUNTS {
        let d = Directions::new(count).unwrap();
        assert_eq!(d.len(), count);
        assert!((mean(&d, &|_| 1.0) - 1.0).abs() < 1e-15);
        assert!(mean(&d, &|w| w[0] * w[1] * w[2] + w[1]).abs() < 1e-15, "odd");
        assert!((mean(&d, &|w| w[2] * w[2]) - 1.0 / 3.0).abs() < 1e-15);
        if count >= 14 {
            assert!((mean(&d, &|w| w[0].powi(4)) - 0.2).abs() < 1e-15);
            assert!((mean(&d, &|w| (w[0] * w[1]).powi(2)) - 1.0 / 15.0).abs() < 1e-15);
        }
        if count == 26 {
            assert!((mean(&d, &|w| w[0].powi(6)) - 1.0 / 7.0).abs() < 1e-15);
            assert!((mean(&d, &|w| w[0].powi(4) * w[1] * w[1]) - 1.0 / 35.0).abs() < 1e-15);
        }
        assert!(d.to.iter().enumerate().all(|(k, w)| d.nearest(*w) == k));
    }
    // The paper's first four, and the others by symmetry (eq. 26).
    let (d, x) = (Directions::new(8).unwrap(), 1.0 / 3f64.sqrt());
    assert_eq!(d.to[0], [-x, -x, -x]);
    assert_eq!(d.to[1], [x, -x, -x]);
    assert!((4..8).all(|j| d.to[j] == d.to[7 - j].map(|c| -c)));
    assert!(Directions::new(9).is_none());
}

#[test]
fn mean_cosines_are_those_of_uniform_normals() {
    let (mut stream, n) = (Stream::new(1), 200_000);
    for angle in [0.0, 0.3, 1.2, 2.0, 3.0, PI] {
        let (w, l) = ([1.0, 0.0, 0.0], [f64::cos(angle), 0.0, f64::sin(angle)]);
        let (mut same, mut other) = (0.0, 0.0);
        for _ in 0..n {
            let normal = random(&mut stream);
            // The viewer is back along the ray, −w; leaves have two sides, and one of them is counted.
            let (viewer, light) = (-dot(normal, w), dot(normal, l));
            same += viewer.max(0.0) * light.max(0.0);
            other += (-viewer).max(0.0) * light.max(0.0);
        }
        // Standard error below 0.3/√n.
        let bound = 5.0 * 0.3 / f64::from(n).sqrt();
        assert!((same / f64::from(n) - reflected_cosines(angle)).abs() < bound, "{angle}");
        assert!((other / f64::from(n) - transmitted_cosines(angle)).abs() < bound, "{angle}");
    }
    // The series meets the form: its next term is 1e-8 of it there.
    let at = |x: f64| (x.sin() - x * x.cos()) / (6.0 * PI);
    assert!((reflected_cosines(0.009_999) / at(0.009_999) - 1.0).abs() < 1e-8);
    assert!(reflected_cosines(1e-6) > 0.0 && reflected_cosines(0.0) == 0.0);
}

#[test]
fn what_neighbours_pass_on_is_the_integral() {
    // Simpson's rule, split where the sun comes to be in front.
    let simpson = |from: f64, to: f64, f: &dyn Fn(f64) -> f64| {
        let n = 2000;
        let h = (to - from) / f64::from(n);
        let weight = |k: i32| if k == 0 || k == n { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
        h / 3.0 * (0..=n).map(|k| weight(k) * f(from + h * f64::from(k))).sum::<f64>()
    };
    for thickness in [0.0f64, 1e-12, 0.3, 2.0, 40.0] {
        for path in [0.0f64, 1e-12, 0.5, 3.0, 40.0] {
            for nearer in [-0.7f64, -1e-12, 0.0, 0.4, 0.7, 1.0] {
                let f = |s: f64| (-s - (path - nearer * s).max(0.0)).exp();
                let split = if nearer > 0.0 { thickness.min(path / nearer) } else { thickness };
                let sum = simpson(0.0, split, &f) + simpson(split, thickness, &f);
                let value = gathered(thickness, path, nearer);
                assert!((value - sum).abs() < 1e-7, "{thickness} {path} {nearer}: {value} {sum}");
                // No more than the sun itself would give.
                assert!((0.0..=1.0 + 1e-12).contains(&value));
            }
        }
    }
    assert!(gathered(1e9, 1e9, 0.5).is_finite() && gathered(0.0, 0.0, -1.0) == 0.0);
}

#[test]
fn an_open_leaf_under_an_even_sky_sends_what_it_scatters() {
    // Radiance everywhere: each side gathers π of it from its own half and from the other.
    let (leaf, mut stream) = (Leaf { reflectance: [0.1, 0.2], transmittance: [0.05, 0.07] }, Stream::new(2));
    for count in Directions::COUNTS {
        let d = Directions::new(count).unwrap();
        for _ in 0..100 {
            let g = Gather::new(&d, random(&mut stream));
            assert!((g.radiance(leaf, 0, |_| 2.0) - 2.0 * (0.1 + 0.07)).abs() < 1e-12);
            assert!((g.radiance(leaf, 1, |_| 2.0) - 2.0 * (0.2 + 0.05)).abs() < 1e-12);
        }
    }
}

#[test]
fn scattering_takes_the_sides() {
    let leaf = Leaf { reflectance: [0.1, 0.2], transmittance: [0.05, 0.07] };
    let (up, down) = ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    let of = |viewer, light| PI * scattering(leaf, up, viewer, light);
    let found = [of(up, up), of(up, down), of(down, up), of(down, down)];
    assert!(found.iter().zip([0.1, 0.07, 0.05, 0.2]).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
    assert_eq!(of(up, [1.0, 0.0, 0.0]), 0.0, "light along the leaf");
}

/// What of single scattering at the middle of a ball of leaves of radius t the model has, per direction of the sky: BBP08 take all
/// that lies in a pyramid for its middle line, and the ball's surface for planes.
#[test]
fn the_middle_of_a_ball_gets_most_of_its_bounce() {
    let leaf = Leaf::uniform(0.2, 0.1);
    let sun = [0.48, 0.6, 0.64];
    for (radius, low, high) in [(0.5, 0.85, 1.0), (1.0, 0.8, 1.0), (2.0, 0.75, 1.0), (4.0, 0.65, 1.0)] {
        // Mean radiance from all around; exact, by the way from each place to the sun through the ball.
        let (n, steps) = (400, 400);
        let mut exact = 0.0;
        for i in 0..n {
            let c = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let source = 2.0 / PI * (0.4 * reflected_cosines(c.acos()) + 0.2 * transmitted_cosines(c.acos()));
            for k in 0..steps {
                let s = (f64::from(k) + 0.5) / f64::from(steps) * radius;
                let out = -s * c + (radius * radius - s * s * (1.0 - c * c)).sqrt();
                exact += source * (-s - out).exp() * radius / f64::from(steps) / f64::from(n);
            }
        }
        for count in Directions::COUNTS {
            let d = Directions::new(count).unwrap();
            let (s, envelope) = (Sun::new(&d, leaf, sun), vec![radius; count]);
            let model: f64 = (0..count).map(|k| d.weights[k] * s.bounce(&envelope, k)).sum();
            assert!((low..=high).contains(&(model / exact)), "{radius} {count}: {}", model / exact);
        }
    }
}
