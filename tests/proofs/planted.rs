//! Planted faults: each is built into a copy of the sources, and `canopy conform` must name a case that it fails.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::folder;

struct Fault {
    name: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
    /// The case that must fail.
    case: &'static str,
}

const FAULTS: &[Fault] = &[
    Fault {
        name: "a barrier that makes no write available",
        file: "src/gpu/record/mod.rs",
        from: ".src_access_mask(vk::AccessFlags2::MEMORY_WRITE)",
        to: ".src_access_mask(vk::AccessFlags2::NONE)",
        case: "validation/synchronization",
    },
    Fault {
        name: "the sign of the hotspot flipped",
        file: "shaders/physics/light.glsl",
        from: "return 1.0 - a1 * (1.0 - exp",
        to: "return 1.0 + a1 * (1.0 - exp",
        case: "probe/hotspot",
    },
    Fault {
        name: "one row of the mask table wrong",
        file: "src/physics/masks.rs",
        from: "row[(bit / 32) as usize] |= mask << (bit % 32);",
        to: "row[(bit / 32) as usize] |= (if r == 3 && k == 2 { mask ^ 1 } else { mask }) << (bit % 32);",
        case: "probe/mask-columns",
    },
    Fault {
        name: "a cascade off by one",
        file: "shaders/physics/shadow.glsl",
        from: "return nearer < count ? nearer : MAX_CASCADES;",
        to: "return nearer + 1u < count ? nearer + 1u : MAX_CASCADES;",
        case: "image/grove",
    },
    Fault {
        name: "a stale tile",
        file: "src/forest/cache.rs",
        from: "Some(Slot { index: index as u32, fresh: true })",
        to: "Some(Slot { index: index as u32, fresh: self.evicted % 7 != 6 })",
        case: "determinism/return",
    },
    Fault {
        name: "the last tree of a tile lost",
        file: "shaders/frame/trees/tiles/see.glsl",
        from: "uint count = min(end - min(begin, end), PART)",
        to: "uint count = min(end - min(begin + 1u, end), PART)",
        case: "tiles/above",
    },
    Fault {
        name: "another row of the mask table in tiles",
        file: "shaders/frame/trees/tiles/sight.comp",
        from: "hash(t.identity ^ HASH_MASK) % MASK_ROWS",
        to: "(hash(t.identity ^ HASH_MASK) + 1u) % MASK_ROWS",
        case: "tiles/grove",
    },
    Fault {
        name: "trees of tiles back to front",
        file: "shaders/frame/trees/tiles/order_fill.comp",
        from: "order.items[slot] = k;",
        to: "order.items[count - 1u - slot] = k;",
        case: "tiles/grove",
    },
    Fault {
        name: "a tile done a bin of depth early",
        file: "shaders/frame/trees/tiles/see.glsl",
        from: "bin_depth(sight_bin(records, next.tree))",
        to: "bin_depth(sight_bin(records, next.tree) + 1u)",
        case: "determinism/shortcuts",
    },
    Fault {
        name: "an outline that lacks a pixel",
        file: "shaders/frame/trees/tiles/outline.glsl",
        from: "floor(within.y) + 1.0",
        to: "floor(within.y)",
        case: "determinism/shortcuts",
    },
];

impl Fault {
    /// Its file with the fault.
    fn planted(&self, sources: &Path) -> String {
        let text = std::fs::read_to_string(sources.join(self.file))
            .unwrap_or_else(|e| panic!("{}: {}: {e}", self.name, self.file));
        assert_eq!(text.matches(self.from).count(), 1, "{}: {} has moved on", self.name, self.file);
        text.replace(self.from, self.to)
    }
}

/// Every fault has its place in the sources, and the case that must catch it is one: what moves must take them along.
#[test]
fn faults_have_their_places() {
    let cases = canopy::measure::conform::cases();
    for fault in FAULTS {
        fault.planted(Path::new(env!("CARGO_MANIFEST_DIR")));
        assert!(cases.iter().any(|c| c.name == fault.case), "{}: no case {}", fault.name, fault.case);
    }
}

/// The sources, as git knows them, in a folder of their own.
fn copy() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let to = folder().join("planted");
    let listed = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output();
    let listed = String::from_utf8(listed.expect("git lists the sources").stdout).unwrap();
    for file in listed.lines().filter(|f| root.join(f).is_file()) {
        let place = to.join(file);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        // Only what changed, so that cargo builds only that.
        let bytes = std::fs::read(root.join(file)).unwrap();
        if std::fs::read(&place).ok().as_ref() != Some(&bytes) {
            std::fs::write(&place, bytes).unwrap();
        }
    }
    to
}

#[test]
#[ignore = "builds the program ten times"]
fn each_planted_fault_is_caught_by_a_named_case() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut missed = Vec::new();
    for fault in FAULTS {
        let sources = copy();
        let path = sources.join(fault.file);
        std::fs::write(&path, fault.planted(&sources)).unwrap();
        let target = folder().join("planted-target");
        let built = Command::new(env!("CARGO"))
            .args(["build", "--release", "--locked", "--bin", "canopy", "--quiet"])
            .current_dir(&sources)
            .env("CARGO_TARGET_DIR", &target)
            .env("SHADERC_LIB_DIR", root.join(".deps/shaderc"))
            .status();
        assert!(built.expect("cargo runs").success(), "{}: does not build", fault.name);
        let output = Command::new(target.join("release/canopy"))
            .args(["conform", fault.case])
            .current_dir(&sources)
            .output();
        let output = output.expect("the program runs");
        let text = String::from_utf8_lossy(&output.stdout);
        let reason: String = text
            .lines()
            .filter(|l| l.starts_with("fail:"))
            .map(|l| l.chars().take(160).collect::<String>())
            .collect();
        println!("{}: exit {:?}, {reason}", fault.name, output.status.code());
        if output.status.code() != Some(1) || !reason.contains(fault.case) {
            missed.push(fault.name);
        }
    }
    assert!(missed.is_empty(), "not caught: {missed:?}");
}
