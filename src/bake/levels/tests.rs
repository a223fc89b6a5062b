use super::*;
use crate::bake::envelope::Parts;
use crate::physics::levels::{bark_level, pull};
use crate::scene::Mesh;
use crate::scene::model::load_named;

fn oak() -> (Mesh, Surface, Parts) {
    let path = format!("{}/tests/data/oak.glb", env!("CARGO_MANIFEST_DIR"));
    let mesh = load_named(std::path::Path::new(&path), None).unwrap();
    let surface = Surface::new(&mesh).unwrap();
    let parts = Parts::new(&mesh, &surface);
    (mesh, surface, parts)
}

#[test]
fn the_order_is_a_permutation_of_whole_cards_and_levels_are_the_same_on_any_number_of_threads() {
    let (mesh, surface, parts) = oak();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Levels::new(&mesh, &surface))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one, three);
    let cards = &one.cards;
    let mut sorted = cards.order.clone();
    sorted.sort_unstable();
    let leaves = (0..surface.faces.len() as u32).filter(|k| (parts.of[*k as usize] as usize) < parts.leaves);
    assert!(sorted.iter().copied().eq(leaves));
    // Shuffled: of cards of two crossed squares both stand together, and half of them are followed by one that the model has later.
    let mut middles: Vec<_> = cards.order.iter().map(|k| cards.middle[*k as usize]).collect();
    middles.dedup();
    assert_eq!(middles.len(), cards.count);
    let rising = cards.order.windows(2).filter(|w| w[1] > w[0] + 3).count() as f64 / cards.count as f64;
    assert!((rising - 0.5).abs() < 0.03, "{rising}");
    let ranks: Vec<f32> = cards.order.iter().map(|k| cards.rank[*k as usize]).collect();
    assert!(ranks.is_sorted() && ranks[0] > 0.0 && ranks[ranks.len() - 1] < 1.0);
    let halfway = ranks.partition_point(|r| *r < 0.5) as f64 / ranks.len() as f64;
    // Cards of an oak differ in area by a factor of three: the mean of 2,660 of them is within 2 %.
    assert!((halfway - 0.5).abs() < 0.02, "{halfway}");

    // Expected coverage: half of the cards, twice as large and pulled as measured, cover what all do.
    let (all, like) = one.surface(&surface, 1.0, 1.0, 0);
    assert_eq!((all.faces.len(), like.len()), (surface.faces.len(), surface.faces.len()));
    for share in [0.5f64, 0.35, 0.25, 0.125, 0.0625] {
        let metre = 6.0 * share.sqrt() / one.cards.side;
        let bark = bark_level(one.bark.iter().map(|b| b.error), metre, share);
        let ratio = coverage::of(&surface, &one.surface(&surface, share, pull(&one.pull, share), bark).0);
        // The secant ends within 0.3 %; between octaves the pull is a chord of a curve whose slope changes by a tenth: 0.4 % more.
        assert!((ratio - 1.0).abs() < 0.008, "{share}: {ratio}");
    }
    // Without it coverage would be wrong by far more than that.
    assert!(coverage::of(&surface, &one.surface(&surface, 0.125, 1.0, 0).0) > 1.05);
    // The last cards fade: their area, over that of the first, falls to nothing.
    let (some, like) = one.surface(&surface, 0.25, 1.0, 0);
    let area = |f: &Face| (f.p[1] - f.p[0]).cross(f.p[2] - f.p[0]).length();
    let leaves = like.iter().take_while(|k| (parts.of[**k as usize] as usize) < parts.leaves).count();
    let growth: Vec<f32> =
        (0..leaves).map(|k| area(&some.faces[k]) / area(&surface.faces[like[k] as usize])).collect();
    assert!(
        (growth[0] - 4.0).abs() < 1e-3 && growth[leaves - 1] < 0.05,
        "{} {}",
        growth[0],
        growth[leaves - 1]
    );
    assert!(growth.windows(2).all(|w| w[1] < w[0] + 1e-3));
    let (_, opaque) = bark::parted(&surface, &one.bark[0].kept);
    for (k, level) in one.bark.iter().enumerate().skip(1) {
        assert!(level.new.len() <= bark::most(opaque.len(), k), "{k}");
        assert!(bark::error(&surface, &opaque, &level.new) <= level.error, "{k}");
        assert!(level.error >= one.bark[k - 1].error, "{k}");
        // Twigs of an oak are thinner than that, and its trunk is not: half of the triangles are within 5 cm, a quarter within 10 cm.
        assert!(level.error < [0.05, 0.1, 0.15, 0.25, 0.25][k - 1], "{k}: {}", level.error);
    }
}
