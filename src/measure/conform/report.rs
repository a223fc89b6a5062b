//! What a run of the suite leaves: JUnit XML for machines, a sheet of pictures for eyes.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::{Outcome, Verdict};
use crate::{Error, Result};

/// The run as JUnit XML: a suite a kind of case.
///
/// # Errors
/// [`Error::Check`] if it cannot be written as XML.
pub fn junit(driver: &str, outcomes: &[Outcome]) -> Result<String> {
    let mut report = Report::new("canopy conform");
    let kind = |o: &Outcome| o.name.split('/').next().unwrap_or_default().to_string();
    let mut kinds: Vec<String> = outcomes.iter().map(kind).collect();
    kinds.dedup();
    for name in kinds {
        let mut suite = TestSuite::new(name.clone());
        suite.add_property(("driver", driver));
        for o in outcomes.iter().filter(|o| kind(o) == name) {
            let mut status = match o.verdict {
                Verdict::Pass | Verdict::Flake => TestCaseStatus::success(),
                Verdict::Skip | Verdict::ExpectedFail => TestCaseStatus::skipped(),
                Verdict::Fail | Verdict::UnexpectedPass => {
                    TestCaseStatus::non_success(NonSuccessKind::Failure)
                }
            };
            if !o.reason.is_empty() && o.verdict != Verdict::Flake {
                status.set_message(o.reason.clone());
            }
            let mut case = TestCase::new(o.name.clone(), status);
            case.set_classname(name.clone());
            case.set_time(o.time);
            if !o.measured.is_empty() {
                case.set_system_out(o.measured.clone());
            }
            suite.add_test_case(case);
        }
        report.add_test_suite(suite);
    }
    report.to_string().map_err(|e| Error::Check(format!("JUnit XML: {e}")))
}

/// A page that needs nothing else: for each failure its reason, and for pictures the reference, what was drawn, and where they
/// differ.
pub fn sheet(driver: &str, outcomes: &[Outcome]) -> String {
    let mut page = format!(
        "<!doctype html><meta charset=\"utf-8\"><title>canopy conform</title>\n<style>body{{font:15px sans-serif;margin:2em}}\
         img{{width:384px;image-rendering:pixelated}}td{{padding:.3em;vertical-align:top}}</style>\n\
         <h1>canopy conform</h1><p>{}</p>\n",
        escape(driver)
    );
    let failed: Vec<&Outcome> = outcomes.iter().filter(|o| o.verdict.is_failure()).collect();
    page += &format!("<p>{} cases, {} failures</p>\n", outcomes.len(), failed.len());
    for o in failed {
        page += &format!("<h2>{}</h2><p>{}</p>\n", escape(&o.name), escape(&o.reason));
        let Some(c) = &o.comparison else { continue };
        let whose = c.reference.as_ref().map_or("reference: none".into(), |r| format!("reference: {}", r.0));
        let cells = [
            (whose, c.reference.as_ref().map(|r| &r.1)),
            ("actual".into(), Some(&c.actual)),
            ("FLIP".into(), c.map.as_ref()),
        ];
        page += "<table><tr>";
        for (title, png) in cells {
            let image = png.map_or(String::new(), |png| {
                format!("<br><img src=\"data:image/png;base64,{}\" alt=\"\">", STANDARD.encode(png))
            });
            page += &format!("<td>{}{image}</td>", escape(&title));
        }
        page += "</tr></table>\n";
    }
    page
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::conform::Comparison;
    use std::time::Duration;

    fn outcome(name: &str, verdict: Verdict, reason: &str) -> Outcome {
        let comparison = Some(Comparison { reference: None, actual: vec![1, 2], map: None });
        let (name, reason) = (name.to_string(), reason.to_string());
        Outcome {
            name,
            verdict,
            reason,
            measured: "x < y".into(),
            time: Duration::from_millis(1500),
            comparison,
        }
    }

    #[test]
    fn reports_tell_failures_from_the_rest() {
        let all = [
            outcome("image/a", Verdict::Pass, ""),
            outcome("image/b", Verdict::Fail, "1 < 2"),
            outcome("probe/c", Verdict::Skip, "why"),
            outcome("probe/d", Verdict::ExpectedFail, "known"),
            outcome("probe/e", Verdict::UnexpectedPass, "stale"),
        ];
        let xml = junit("driver", &all).unwrap();
        assert!(xml.contains("tests=\"5\" skipped=\"2\" failures=\"2\""), "{xml}");
        assert!(xml.contains("1 &lt; 2") && xml.contains("time=\"1.500\""), "{xml}");
        let page = sheet("driver", &all);
        assert!(
            page.contains("5 cases, 2 failures") && page.contains("1 &lt; 2") && page.contains("base64,AQI=")
        );
        assert!(!page.contains("image/a"), "only failures are shown");
    }
}
