//! `canopy compare`.

use std::path::PathBuf;

use canopy::measure::compare::{Comparison, Difference, Verdict, compare, differences};
use canopy::measure::results::BenchResult;
use canopy::{Error, Result};
use clap::builder::PossibleValuesParser;

use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy bench --json > a.json; canopy bench --json > b.json; canopy compare a.json b.json
  canopy compare before.json after.json --fail-above 3%           exit code 5 if a pass or the frame is
                                                                  significantly slower, and by more than 3 %
  canopy compare fast.json accurate.json --allow-different settings
  canopy compare a.json b.json --json
Compared are views with themselves: the least time of several rounds, on software drivers CPU time, else GPU time. What all
passes have in common from one run to the next is the machine and is listed apart; to compare whole frames better than
that, draw both settings in turn: canopy bench --against KNOB=VALUE.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Result before (of canopy bench --json or --output)
    a: PathBuf,
    /// Result after
    b: PathBuf,
    /// Fail with exit code 5 if anything is significantly slower by more than this, such as 3%
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    fail_above: Option<f64>,
    /// Compare although this differs; repeatable, or with commas between
    #[arg(long, value_name = "KIND", value_delimiter = ',', value_parser = PossibleValuesParser::new(Difference::KINDS))]
    allow_different: Vec<String>,
    #[command(flatten)]
    print: PrintOptions,
}

pub fn run(args: &Args) -> Result<()> {
    let (a, b) = (BenchResult::load(&args.a)?, BenchResult::load(&args.b)?);
    let refused: Vec<Difference> = differences(&a, &b)
        .into_iter()
        .filter(|d| !args.allow_different.iter().any(|k| k == d.kind))
        .collect();
    if let Some(first) = refused.first() {
        let lines: Vec<String> = refused.iter().map(|d| format!("  {}: {}", d.kind, d.what)).collect();
        return Err(Error::Usage(format!(
            "these results are of different things; --allow-different {} compares all the same\n{}",
            first.kind,
            lines.join("\n")
        )));
    }
    let found = compare(&a, &b, false)?;
    if args.print.json {
        output::json(&found)?;
    } else if !args.print.quiet {
        output::print(&text(&found))?;
    }
    let slower = args.fail_above.map(|part| found.slower_than(part)).unwrap_or_default();
    if slower.is_empty() {
        return Ok(());
    }
    let named: Vec<String> =
        slower.iter().map(|r| format!("{} by {:.1} %", r.name, 100.0 * (r.ratio - 1.0))).collect();
    Err(Error::Regression(format!("slower: {}", named.join(", "))))
}

/// "3%" or "3".
fn percent(text: &str) -> std::result::Result<f64, String> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(p) if (0.0..=10_000.0).contains(&p) => Ok(p / 100.0),
        _ => Err("write a percentage, such as 3%".into()),
    }
}

/// The table.
pub fn text(c: &Comparison) -> String {
    let headings = [c.quantity, "A", "B", "B / A", "95 % interval", "corrected p", "least change", "verdict"];
    let mut table = Table::new(1, &headings);
    let part = |ratio: f64| format!("{:+.1} %", 100.0 * (ratio - 1.0));
    for r in &c.rows {
        let verdict = match r.verdict {
            Verdict::NoDifference => "no difference",
            Verdict::Slower => "SLOWER",
            Verdict::Faster => "faster",
        };
        table.row([
            r.name.clone(),
            format!("{:.3}", r.a_ms),
            format!("{:.3}", r.b_ms),
            part(r.ratio),
            format!("{} to {}", part(r.interval[0]), part(r.interval[1])),
            format!("{:.4}", r.corrected_p),
            format!("{:.1} %", 100.0 * (r.least_ratio - 1.0)),
            verdict.into(),
        ]);
    }
    let mut text = table.text();
    for d in &c.differences {
        text += &format!("  different {}: {}\n", d.kind, d.what);
    }
    if let Some(pace) = c.pace_ratio.filter(|_| !c.in_turn) {
        text += &format!("  fixed work on the CPU took {} in B\n", part(pace));
    }
    text
}
