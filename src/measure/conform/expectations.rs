//! What is known not to work, by driver and version: a text file, one case a line.
//!
//! ```text
//! [llvmpipe Mesa 22.3]                 # applies where the driver's own name contains this; [*] applies everywhere
//! skip   validation/gpu-assisted       # the layer of 1.3.239 aborts on push descriptors
//! fail   image/backlit                 # why
//! flake  determinism/threads-*         # names may end in *
//! ```

use std::path::Path;

use crate::{Error, Result};

/// What is expected of a case that does not simply pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expectation {
    /// It fails; when it passes, the line is out of date.
    Fail,
    /// It passes or fails from run to run.
    Flake,
    /// It must not be run.
    Skip,
}

#[derive(Clone, Debug)]
struct Line {
    driver: String,
    case: String,
    expectation: Expectation,
    reason: String,
}

/// An expectations file.
#[derive(Clone, Debug, Default)]
pub struct Expectations {
    lines: Vec<Line>,
}

impl Expectations {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`] if it is not there; [`Error::Input`] naming the line.
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        Self::parse(&text, path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self> {
        let mut lines = Vec::new();
        let mut driver: Option<String> = None;
        for (k, line) in text.lines().enumerate() {
            let (content, reason) = line.split_once('#').unwrap_or((line, ""));
            let (content, reason) = (content.trim(), reason.trim());
            let wrong =
                |what: &str, remedy: &str| Error::input(path, format!("line {}", k + 1), what, remedy);
            if content.is_empty() {
                continue;
            }
            if let Some(name) = content.strip_prefix('[').and_then(|c| c.strip_suffix(']')) {
                driver = Some(name.trim().to_string());
                continue;
            }
            let form = "write \"fail|flake|skip  case  # reason\" under a [driver]";
            let Some(driver) = &driver else {
                return Err(wrong("a case before any [driver]", form));
            };
            let words: Vec<&str> = content.split_whitespace().collect();
            let [word, case] = words[..] else {
                return Err(wrong("not an expectation and one case", form));
            };
            let expectation = match word {
                "fail" => Expectation::Fail,
                "flake" => Expectation::Flake,
                "skip" => Expectation::Skip,
                _ => return Err(wrong(&format!("\"{word}\" is no expectation"), form)),
            };
            if reason.is_empty() {
                return Err(wrong("an expectation without a reason", form));
            }
            let known = |name: &str| matches(case, name);
            if !super::cases().iter().any(|c| known(&c.name)) {
                return Err(wrong(&format!("no case \"{case}\""), "see canopy conform --list"));
            }
            lines.push(Line {
                driver: driver.clone(),
                case: case.into(),
                expectation,
                reason: reason.into(),
            });
        }
        Ok(Expectations { lines })
    }

    /// What is expected of a case on a driver, and why; the last line that applies counts.
    pub fn find(&self, driver: &str, case: &str) -> Option<(Expectation, &str)> {
        let applies = |l: &&Line| (l.driver == "*" || driver.contains(&l.driver)) && matches(&l.case, case);
        self.lines.iter().rev().find(applies).map(|l| (l.expectation, l.reason.as_str()))
    }
}

/// Whether a pattern, which may end in `*`, means a name.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => pattern == name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Expectations> {
        Expectations::parse(text, Path::new("expectations.txt"))
    }

    #[test]
    fn lines_apply_to_their_drivers_and_cases() {
        let e = parse(
            "# all\n[Mesa 22.3]\nfail image/grove # a\n[*]\nflake determinism/threads-* # b\nskip image/grove # c\n\
             [Mesa 25]\nfail determinism/threads-1 # d\n",
        )
        .unwrap();
        let (old, new) = ("llvmpipe Mesa 22.3.6", "llvmpipe Mesa 25.0.7");
        assert_eq!(e.find(old, "determinism/threads-1"), Some((Expectation::Flake, "b")));
        assert_eq!(e.find(new, "determinism/threads-1"), Some((Expectation::Fail, "d")));
        assert_eq!(e.find(old, "image/grove"), Some((Expectation::Skip, "c")), "the last line counts");
        assert_eq!(e.find(old, "frame/grove"), None);
    }

    #[test]
    fn wrong_lines_are_refused_by_number() {
        for (text, hint) in [
            ("fail image/grove # x\n", "[driver]"),
            ("[*]\nfial image/grove # x\n", "\"fial\""),
            ("[*]\nfail image/grove\n", "reason"),
            ("[*]\nfail image/no-such-scene # x\n", "no case"),
            ("[*]\nfail # x\n", "one case"),
        ] {
            let e = parse(text).unwrap_err().to_string();
            assert!(e.contains(hint) && e.contains("line "), "{text:?}: {e}");
        }
    }
}
