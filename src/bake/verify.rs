//! How well a z-field stands for its mesh: both seen from directions between the stored views.

use glam::DVec3;
use rayon::prelude::*;

use super::SpeciesBake;
use super::raster::{Raster, SUBSAMPLES, View};
use super::surface::Surface;
use crate::physics::views::{self, Basis};
use crate::physics::zfield::{self, Ray};
use crate::scene::Mesh;
use crate::{Error, Result};

/// Agreement of a z-field with its mesh from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewQuality {
    /// Towards the viewer, in scaled tree space.
    pub direction: [f64; 3],
    /// Intersection over union of the silhouettes (opacity at least one half).
    pub iou: f64,
    /// Mean opacity of the z-field over that of the mesh.
    pub coverage_ratio: f64,
    /// Median distance along the view ray between the two surfaces where both silhouettes are, m.
    pub median_depth_error: f64,
    /// Mean of that distance, m.
    pub mean_depth_error: f64,
}

/// Agreement over many directions.
#[derive(Clone, Debug, PartialEq)]
pub struct QualityReport {
    /// One entry a direction.
    pub views: Vec<ViewQuality>,
}

impl QualityReport {
    /// Smallest silhouette agreement.
    pub fn min_iou(&self) -> f64 {
        self.views.iter().map(|v| v.iou).fold(f64::INFINITY, f64::min)
    }

    /// Mean of a quantity over the directions.
    pub fn mean(&self, of: impl Fn(&ViewQuality) -> f64) -> f64 {
        self.views.iter().map(of).sum::<f64>() / self.views.len().max(1) as f64
    }
}

/// A gate for scripts: the worst silhouette agreement of `what`, between two that a message names, and what to raise for a better one.
///
/// # Errors
/// [`Error::Check`] if it is less than `least`.
pub fn demand(what: &str, between: &str, min_iou: f64, least: f64, remedy: &str) -> Result<()> {
    if min_iou >= least {
        return Ok(());
    }
    Err(Error::Check(format!(
        "{what}: from one direction the silhouettes of {between} agree to {min_iou:.4} only; {least} were asked for (raise {remedy})"
    )))
}

/// Compares the z-field with the mesh from `directions` directions, spread over the upper hemisphere and at
/// least a tenth (in weight) away from every edge of the triangles of stored views, for a viewer at infinity,
/// at the z-field's resolution, with `iterations` iterations of the view ray.
pub fn verify(mesh: &Mesh, bake: &SpeciesBake, directions: u32, iterations: u32) -> Result<QualityReport> {
    let surface = Surface::new(mesh)?;
    let views: Vec<_> = between(bake.views.n)
        .take(directions as usize)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map_init(
            || Raster::new(bake.views.resolution),
            |raster, w| view(&surface, bake, w, raster, iterations),
        )
        .collect();
    Ok(QualityReport { views })
}

/// [`views::spread`], less those too near to an edge of the view triangles.
fn between(n: u32) -> impl Iterator<Item = DVec3> {
    views::spread().filter(move |w| views::lookup(n, *w).views.iter().all(|v| v.weight > 0.1))
}

fn view(
    surface: &Surface,
    bake: &SpeciesBake,
    w: DVec3,
    raster: &mut Raster,
    iterations: u32,
) -> ViewQuality {
    let resolution = bake.views.resolution;
    let basis = Basis::new(w);
    let image = View::new(&basis, resolution);
    raster.draw(surface, &image);
    let lookup = views::lookup(bake.views.n, w);
    // Metres along the ray for a unit of scaled space along it.
    let metres = (basis.w * surface.frame.scale().as_dvec3()).length();
    let (mut both, mut either, mut truth_alpha, mut field_alpha) = (0u32, 0u32, 0.0, 0.0);
    let mut errors = Vec::new();
    for row in 0..resolution {
        for column in 0..resolution {
            let (mut count, mut sum) = (0u32, 0.0);
            for y in row * SUBSAMPLES..(row + 1) * SUBSAMPLES {
                for x in column * SUBSAMPLES..(column + 1) * SUBSAMPLES {
                    let d = raster.nearest[(y * raster.size + x) as usize];
                    if d.is_finite() {
                        count += 1;
                        sum += f64::from(d);
                    }
                }
            }
            let alpha = f64::from(count) / f64::from(SUBSAMPLES * SUBSAMPLES);
            let origin = image.point(resolution, column, row, 0.0).as_dvec3();
            let entry = zfield::intersect(&bake.views, 0, &lookup, &Ray { origin, to: basis.w }, iterations);
            truth_alpha += alpha;
            field_alpha += entry.alpha;
            let (truth, field) = (alpha >= 0.5, entry.alpha >= 0.5);
            either += u32::from(truth || field);
            if truth && field {
                both += 1;
                errors.push((entry.s - sum / f64::from(count)).abs() * metres);
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    ViewQuality {
        direction: w.to_array(),
        iou: if either == 0 { 1.0 } else { f64::from(both) / f64::from(either) },
        coverage_ratio: if truth_alpha > 0.0 { field_alpha / truth_alpha } else { 1.0 },
        median_depth_error: errors.get(errors.len() / 2).copied().unwrap_or(0.0),
        mean_depth_error: mean,
    }
}
