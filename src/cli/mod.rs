//! The command line: one file a command, and no logic that the library does not have.

mod accuracy;
mod bake;
mod bench;
mod cards;
mod compare;
mod conform;
mod devices;
mod difference;
mod leaves;
mod options;
mod output;
mod plan;
mod reference;
mod reflectance;
mod render;
mod shells;
mod sweep;
mod tree;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Version of every JSON object that the commands print; raised when a key changes its meaning or goes.
const SCHEMA_VERSION: u32 = 2;

const AFTER_HELP: &str = "\
Start here:
  canopy render -o ridge.png           draw the built-in scene
  canopy render my.toml --json         draw your own, with a report for a script
  canopy render --help                 what can be changed, and every knob

Exit codes: 0 done, 1 a check failed, 2 wrong usage or bad input, 3 no suitable device,
4 validation error, 5 regression found, 6 device lost or out of memory.";

/// Draws forests from a leaf to the horizon, headless, on any Vulkan 1.3 driver.
#[derive(Parser)]
#[command(name = "canopy", version, after_help = AFTER_HELP, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Draw one image of a scene: PNG, and linear EXR with named layers.
    Render(render::Args),
    /// Measure frame times along a camera path: table, JSON, CSV, trace.
    Bench(bench::Args),
    /// Compare two bench results: significance, not only a ratio; a gate with --fail-above.
    Compare(compare::Args),
    /// The trade of time for accuracy: every knob around every preset, Pareto front, report.
    Sweep(sweep::Args),
    /// Every metric of one linear image against another: error, bias, FLIP, structural similarity, ratio over distance.
    Difference(difference::Args),
    /// Radiance of a patch of the scene's forest against view angle, sun angle and distance, as CSV.
    Reflectance(reflectance::Args),
    /// Errors against path tracing for forests of many kinds, suns and slopes: which are worst, and which term of the model is wrong.
    Accuracy(accuracy::Args),
    /// Precompute a tree model ahead of time (otherwise done on first use), and measure how good it is.
    Bake(bake::Args),
    /// Light on leaves by their envelopes, with one bounce, against paths traced through the tree, term by term.
    Leaves(leaves::Args),
    /// Write a tree model as a cloud of textured cards (billboards), a model like any other, and measure how good it is.
    Cards(cards::Args),
    /// Precompute forest far away as stacks of slices (shell textures), and measure how well they hide the ground.
    Shells(shells::Args),
    /// Write a procedural tree as binary glTF.
    Tree(tree::Args),
    /// List what a scene requires, with reasons and bytes, without building any of it.
    Plan(plan::Args),
    /// Check a driver: small scenes and shader functions, each a named case with its reference.
    Conform(conform::Args),
    /// List the Vulkan devices and whether they fit.
    Devices(devices::Args),
}

/// Runs the program and returns its exit code.
pub fn run() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Render(args) => render::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Difference(args) => difference::run(&args),
        Command::Reflectance(args) => reflectance::run(&args),
        Command::Accuracy(args) => accuracy::run(&args),
        Command::Bake(args) => bake::run(&args),
        Command::Leaves(args) => leaves::run(&args),
        Command::Cards(args) => cards::run(&args),
        Command::Shells(args) => shells::run(&args),
        Command::Tree(args) => tree::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Conform(args) => conform::run(&args),
        Command::Devices(args) => devices::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            canopy::progress::say(&format!("error: {e}"));
            ExitCode::from(e.exit_code())
        }
    }
}
