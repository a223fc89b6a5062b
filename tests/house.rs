//! How the sources are laid out: which folder may use which, and where Vulkan is.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Parts of the library from the top down: each uses only what stands below it. A scene says which ladder it wants, so that is below it.
const STOREYS: [&[&str]; 16] = [
    &["measure"],
    &["reference"],
    &["frame"],
    &["forest"],
    &["bake"],
    &["plan"],
    &["land"],
    &["camera"],
    &["scene"],
    &["tree"],
    &["ladder"],
    &["keys"],
    &["image", "files", "input", "settings"],
    &["gpu"],
    &["rays", "progress", "clock"],
    &["physics", "error"],
];

/// Every source file under a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

/// Its code without comments and without its unit tests, which may use what they like.
fn code(text: &str) -> String {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines().map(|l| l.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Parts of the library that code names.
fn used(code: &str) -> BTreeSet<&str> {
    let name = |rest: &str| rest.find(|c: char| !c.is_ascii_lowercase() && c != '_').unwrap_or(rest.len());
    let after = code.split("crate::").skip(1);
    after.map(|rest| &rest[..name(rest)]).filter(|n| !n.is_empty()).collect()
}

fn storey(part: &str) -> Option<usize> {
    STOREYS.iter().position(|s| s.contains(&part))
}

/// What a file of a part uses that does not stand below it.
fn upward(part: &str, code: &str) -> Vec<String> {
    let own = storey(part);
    let below = |other: &str| other == part || storey(other).zip(own).is_some_and(|(o, own)| o > own);
    let beside = |other: &str| storey(other).is_some() && storey(other) == own;
    used(code).into_iter().filter(|o| !below(o) && !beside(o)).map(String::from).collect()
}

#[test]
fn uses_run_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    for path in sources(&root) {
        let within = path.strip_prefix(&root).unwrap();
        let part = within.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        // The program uses the library from outside; the library names its parts.
        if ["cli", "main", "lib"].contains(&part) {
            continue;
        }
        assert!(storey(part).is_some(), "{}: a part that STOREYS does not have", within.display());
        let text = fs::read_to_string(&path).unwrap();
        wrong
            .extend(upward(part, &code(&text)).into_iter().map(|o| format!("{} uses {o}", within.display())));
    }
    assert!(wrong.is_empty(), "these use what does not stand below them:\n{}", wrong.join("\n"));
}

#[test]
fn an_upward_use_is_seen() {
    assert_eq!(upward("forest", "use crate::frame::shadows::Shadows;"), ["frame"]);
    assert_eq!(upward("physics", "fn f(z: &crate::bake::Baked) {}"), ["bake"]);
    assert!(upward("frame", "use crate::forest::seeds::SeedData;\nuse crate::{Error, Result};").is_empty());
    assert!(upward("forest", &code("// as crate::frame does\n#[cfg(test)]\nuse crate::frame;")).is_empty());
}

#[test]
fn vulkan_is_unsafe_in_one_place_and_says_why() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root) {
        let text = fs::read_to_string(&path).unwrap();
        let inside = path.starts_with(root.join("gpu"));
        let opens = |l: &str| l.contains("unsafe {") || l.contains("unsafe impl");
        let lines: Vec<&str> = text.lines().collect();
        for (k, line) in lines.iter().enumerate().filter(|(_, l)| opens(&code(l))) {
            assert!(inside, "{}:{}: unsafe outside src/gpu: {line}", path.display(), k + 1);
            let said = lines[k.saturating_sub(8)..=k].iter().any(|l| l.contains("SAFETY"));
            assert!(said, "{}:{}: unsafe without a SAFETY line", path.display(), k + 1);
        }
    }
}
