//! `canopy conform`.

use std::path::PathBuf;

use canopy::bake::cache;
use canopy::measure::conform::{self, Options, Outcome, Suite, Verdict};
use canopy::progress::Progress;
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy conform                                     every case on the best device
  canopy conform image/ probe/hotspot                those whose names contain one of these
  canopy conform --list                              names only
  canopy conform --shard 2/8 --junit shard-2.xml     the second of eight parts, for a job array
  canopy conform image/ --bless                      write this driver's references, then look at them
  canopy conform --sheet failures.html               reference, picture and FLIP map of each failure

References are pictures in a folder for each driver, beside expectations.txt: what is known to fail, to flake or to be skipped, by
driver, with the reason. An unexpected pass fails, and so does a missing reference. On a driver without a folder pictures are held
against another driver's, loosely.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Cases whose names contain one of these; left out: all
    filters: Vec<String>,
    /// List the cases and run none
    #[arg(long)]
    list: bool,
    /// Run part k of n
    #[arg(long, value_name = "K/N", default_value = "1/1", value_parser = super::options::shard)]
    shard: (usize, usize),
    /// Folder of the references and of expectations.txt
    #[arg(long, value_name = "FOLDER", default_value = conform::default_references().as_os_str())]
    references: PathBuf,
    /// Write references instead of comparing with them
    #[arg(long)]
    bless: bool,
    /// JUnit XML to write
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
    /// Page of the failures to write
    #[arg(long, value_name = "FILE.html")]
    sheet: Option<PathBuf>,
    /// Device by UUID or part of its name; left out: the best that fits (see `canopy devices`)
    #[arg(long, value_name = "UUID|NAME")]
    device: Option<String>,
    /// Print the bits of a scene as a hash: for the cases that need a process of their own
    #[arg(long, value_name = "SCENE", hide = true)]
    digest: Option<String>,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct CaseReport<'a> {
    name: &'a str,
    verdict: Verdict,
    reason: &'a str,
    measured: &'a str,
    seconds: f64,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    driver: &'a str,
    cases: Vec<CaseReport<'a>>,
}

pub fn run(args: &Args) -> Result<()> {
    let cases = conform::select(&args.filters, args.shard);
    if args.list {
        return output::print(&cases.iter().map(|c| c.name.clone() + "\n").collect::<String>());
    }
    for (path, kind) in [(&args.junit, "xml"), (&args.sheet, "html")] {
        path.as_ref().map_or(Ok(()), |p| output::check(p, kind))?;
    }
    let program = std::env::current_exe().map_err(|e| Error::io("the program's own path", e))?;
    let options = Options {
        device: args.device.clone(),
        references: args.references.clone(),
        bless: args.bless,
        program,
        cache: cache::default_dir(),
    };
    if let Some(scene) = &args.digest {
        return output::print(&(conform::digest(&options, scene)? + "\n"));
    }
    if cases.is_empty() {
        return Err(Error::Usage("no case is left to run; canopy conform --list lists all".into()));
    }
    let suite = Suite::open(options)?;
    let progress = Progress::new("conformance", cases.len() as u64, args.print.quiet);
    let mut outcomes = Vec::new();
    for case in &cases {
        outcomes.push(suite.run(case)?);
        progress.step(1);
    }
    progress.finish();
    if let Some(path) = &args.junit {
        canopy::files::write_whole(path, conform::junit(suite.driver(), &outcomes)?.as_bytes())?;
    }
    if let Some(path) = &args.sheet {
        canopy::files::write_whole(path, conform::sheet(suite.driver(), &outcomes).as_bytes())?;
    }
    print(args, suite.driver(), &outcomes)?;
    let failed: Vec<&str> =
        outcomes.iter().filter(|o| o.verdict.is_failure()).map(|o| o.name.as_str()).collect();
    if failed.is_empty() {
        return Ok(());
    }
    Err(Error::Check(format!("{} of {} cases failed: {}", failed.len(), outcomes.len(), failed.join(", "))))
}

fn print(args: &Args, driver: &str, outcomes: &[Outcome]) -> Result<()> {
    if args.print.json {
        let cases = outcomes
            .iter()
            .map(|o| CaseReport {
                name: &o.name,
                verdict: o.verdict,
                reason: &o.reason,
                measured: &o.measured,
                seconds: o.time.as_secs_f64(),
            })
            .collect();
        return output::json(&Report { schema_version: SCHEMA_VERSION, command: "conform", driver, cases });
    }
    if args.print.quiet {
        return Ok(());
    }
    let mut table = Table::new(3, &["case", "verdict", "measured", "s"]);
    for o in outcomes {
        let seconds = format!("{:.1}", o.time.as_secs_f64());
        table.row([o.name.clone(), o.verdict.name().into(), o.measured.clone(), seconds]);
    }
    let mut text = format!("{driver}\n\n{}", table.text());
    for o in outcomes.iter().filter(|o| !o.reason.is_empty()) {
        text += &format!("\n{}: {}: {}\n", o.verdict.name(), o.name, o.reason);
    }
    output::print(&text)
}
