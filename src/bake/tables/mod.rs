//! stub
use super::{CacheState, SpeciesBake};
use std::path::Path;
/// stub
#[derive(Clone, Debug, PartialEq)]
pub struct ForestSettings { pub angles: u32, pub densities: u32, pub rays: u32, pub pattern_density: f64, pub scale_range: [f32; 2], pub poisson: bool, pub hole_radius: f32, pub light_iterations: u32, pub view_iterations: u32 }
/// stub
#[derive(Clone, Debug, PartialEq)]
pub struct ForestTables { pub angles: u32, pub densities: u32, pub max_thickness: f32, pub area: f32, pub vertical_scale: f32, pub pair: Vec<[f32; 3]>, pub view: Vec<[f32; 4]>, pub ground: Vec<[f32; 2]> }
/// stub
pub fn load_or_measure(b: &SpeciesBake, f: &ForestSettings, _: Option<&Path>, _: bool) -> crate::Result<(ForestTables, CacheState)> {
    let (n, m) = (f.angles, f.densities);
    let [a, c] = f.scale_range;
    let area = b.area * (a * a + a * c + c * c) / 3.0;
    let max_thickness = f.pattern_density as f32 * area;
    let mut t = ForestTables { angles: n, densities: m, max_thickness, area, vertical_scale: 2.0 * b.crown_radius / (b.height - b.crown_base), pair: vec![], view: vec![], ground: vec![] };
    let max = 88f32.to_radians();
    for j in 0..m {
        let x = max_thickness * (j as f32 / (m - 1) as f32).powi(2);
        for v in 0..n {
            let tv = max * v as f32 / (n - 1) as f32;
            for l in 0..n {
                let k0 = (n - 1) / 2;
                let tl = if l <= k0 { tv - tv * ((k0 - l) as f32 / k0 as f32).powi(2) } else { tv + (max - tv) * ((l - k0) as f32 / (n - 1 - k0) as f32).powi(2) };
                for p in 0..n {
                    let phi = std::f32::consts::PI * (p as f32 / (n - 1) as f32).powi(2);
                    let xi = (tv.cos() * tl.cos() + tv.sin() * tl.sin() * phi.cos()).clamp(-1.0, 1.0).acos();
                    let w = 1.0 - 0.5 * (-3.0 * xi).exp();
                    t.pair.push([w, 0.3 + 0.6 * (-3.0 * xi).exp(), 0.02]);
                }
            }
            t.view.push([1.0, 0.5 / (1.0 + x), 0.02, 0.5 * (1.0 - (-x).exp())]);
        }
        t.ground.push([crate::physics::light::ground_visibility(f64::from(x)) as f32, 1.0 - (-x).exp()]);
    }
    Ok((t, CacheState::Baked))
}
