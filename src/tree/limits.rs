//! What numbers that are each in their range must keep to together, so that every species grows to a finite tree in
//! no time.

use super::keys::Fault;
use super::parameters::{Level, Parameters};

/// Most triangles of a tree, counted as if every branch bore all its twigs.
const MAX_TRIANGLES: f64 = 200_000.0;

/// Most degrees between two segments: a stem that folds back on itself has no outside.
const MAX_FOLD: f64 = 150.0;

/// The first limit that is passed.
pub(super) fn check(p: &Parameters) -> Result<(), Fault> {
    sizes(p)?;
    let [trunk, branches, twigs] = p.levels();
    fold("trunk.segments", &trunk, 0.0)?;
    fold("branches.segments", &branches, 0.0)?;
    fold("twigs.segments", &twigs, 180.0 * p.attraction_up.abs())?;
    triangles(p)
}

/// Stems have a length, and the trunk goes on beyond its bare part.
fn sizes(p: &Parameters) -> Result<(), Fault> {
    let sized = [
        ("scale", p.scale),
        ("trunk.length", p.trunk.length),
        ("branches.length", p.branches.length),
        ("twigs.length", p.twigs.length),
    ];
    for (key, [value, variation]) in sized {
        if variation > 0.9 * value {
            let what = format!("a variation of {variation} on {value} leaves next to nothing");
            return Err(Fault { key, what, remedy: format!("write one of at most {}", 0.9 * value) });
        }
    }
    let most = 0.95 * (p.trunk.length[0] - p.trunk.length[1]);
    if p.base_size > most {
        let what = format!("{} leaves no trunk for branches, whose length is trunk.length", p.base_size);
        return Err(Fault { key: "base_size", what, remedy: format!("write at most {most:.3}") });
    }
    Ok(())
}

/// Bends from one segment to the next stay below [`MAX_FOLD`].
fn fold(key: &'static str, level: &Level, attraction: f64) -> Result<(), Fault> {
    let curve = match level.curve_back {
        0.0 => level.curve.abs(),
        back => 2.0 * level.curve.abs().max(back.abs()),
    };
    let whole = curve + 2.0 * level.curve_variation.abs() + level.droop.abs() + attraction;
    // The last segment leads nowhere further: one alone may bend as it likes.
    if level.segments > 1 && whole / f64::from(level.segments) > MAX_FOLD {
        let what = format!("{} segments bend up to {whole} degrees together", level.segments);
        let remedy = format!("write at least {}, or lower curves or droop", (whole / MAX_FOLD).ceil());
        return Err(Fault { key, what, remedy });
    }
    Ok(())
}

fn triangles(p: &Parameters) -> Result<(), Fault> {
    let mut stems = 1.0;
    let mut triangles = 0.0;
    for level in p.levels() {
        stems *= level.count;
        triangles += stems * 2.0 * f64::from(level.segments) * f64::from(level.sides);
    }
    triangles += p.leaves.map_or(0.0, |l| stems * l.count * 2.0 * f64::from(l.cards));
    if triangles > MAX_TRIANGLES {
        let what = format!("{stems} twigs on all branches make up to {triangles} triangles");
        let remedy = format!("at most {MAX_TRIANGLES} are allowed: lower counts, segments or sides");
        return Err(Fault { key: "twigs.count", what, remedy });
    }
    Ok(())
}
