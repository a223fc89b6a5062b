//! What drawing a species as a mesh takes, of `canopy bake`.

use std::time::Instant;

use canopy::Result;
use canopy::bake::levels::{Agreement, LevelQuality, Seen};
use canopy::bake::{self, Source, SpeciesBake};
use canopy::scene::Mesh;
use canopy::settings::Settings;

use crate::cli::output::Table;

/// Directions from which levels of detail are compared, at least.
const LEAST_DIRECTIONS: u32 = 24;

/// What drawing a species as a mesh takes.
#[derive(serde::Serialize)]
pub struct AsMesh {
    directions: u32,
    envelopes: &'static str,
    levels: &'static str,
    seconds: f64,
    cards: usize,
    card_side_m: f64,
    /// Factors of how far cards are from the middle of all leaves, for u = 1, 1/2, 1/4 and so on.
    pull: Vec<f64>,
    /// Triangles and error, m, of each level of bark.
    bark: Vec<(usize, f64)>,
    /// With `--verify`.
    verify: Vec<LevelQuality>,
}

/// Makes what a mesh takes, or reads it, and compares its levels of detail if asked.
pub fn as_mesh(
    verify: Option<u32>,
    source: &Source,
    (mesh, bake): (&Mesh, &SpeciesBake),
    settings: &Settings,
) -> Result<AsMesh> {
    let start = Instant::now();
    let (envelopes, around) = source.load_envelopes(settings.leaf_directions)?;
    let (levels, from) = source.load_levels()?;
    let seconds = start.elapsed().as_secs_f64();
    let seen = Seen { mesh, bake, envelopes: &envelopes, levels: &levels };
    let directions = |n: u32| n.max(LEAST_DIRECTIONS) as usize;
    let verify = verify.map(|n| bake::levels::verify(&seen, directions(n), f64::from(settings.leaf_pixels)));
    Ok(AsMesh {
        directions: settings.leaf_directions,
        envelopes: around.name(),
        levels: from.name(),
        seconds,
        cards: levels.cards.count,
        card_side_m: levels.cards.side,
        pull: levels.pull.to_vec(),
        bark: levels.bark.iter().map(|b| (b.kept.len() + b.new.len(), b.error)).collect(),
        verify: verify.transpose()?.unwrap_or_default(),
    })
}

/// What a mesh takes, and its levels of detail.
pub fn text(m: &AsMesh) -> String {
    let mut table = Table::new(2, &["  as a mesh", ""]);
    table.row([
        "  cache: crowns around leaves".into(),
        format!("{}, {} directions", m.envelopes, m.directions),
    ]);
    table.row(["  cache: levels of detail".into(), m.levels.into()]);
    table.row(["  time".into(), format!("{:.2} s", m.seconds)]);
    table.row(["  cards of leaves".into(), format!("{} of {:.2} m", m.cards, m.card_side_m)]);
    for (k, (triangles, error)) in m.bark.iter().enumerate() {
        table.row([
            format!("  bark, level {k}"),
            format!("{triangles} triangles, within {:.1} cm", 100.0 * error),
        ]);
    }
    let text = table.text();
    if m.verify.is_empty() {
        return text;
    }
    let headings = [
        "leaves",
        "tree, px",
        "triangles",
        "pull",
        "bark",
        "coverage",
        "worst",
        "IoU mean",
        "min",
        "radiance",
        "worst",
    ];
    let mut table = Table::new(0, &headings);
    for q in &m.verify {
        let worst = |part: fn(&Agreement) -> f64| {
            let [low, high] = q.range.map(|a| part(&a));
            format!("{:.4}", if 1.0 - low > high - 1.0 { low } else { high })
        };
        table.row([
            format!("{}", q.share),
            format!("{:.0}", q.height_px),
            q.leaf_triangles.to_string(),
            format!("{:.3}", q.pull),
            format!("{}: {}", q.bark_level, q.bark_triangles),
            format!("{:.4}", q.mean.coverage),
            worst(|a| a.coverage),
            format!("{:.4}", q.mean.iou),
            format!("{:.4}", q.range[0].iou),
            format!("{:.4}", q.mean.radiance),
            worst(|a| a.radiance),
        ]);
    }
    text + "  levels of detail against the whole mesh\n" + &table.text()
}
