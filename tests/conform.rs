//! The conformance suite, a test a case: the same code as `canopy conform`, so that test runners can list, filter and part it.

#[path = "common/device.rs"]
#[allow(dead_code, unused_imports)] // Each test program uses its own part of this module.
mod device;

use std::path::Path;
use std::sync::Arc;

use canopy::measure::conform::{Options, Suite, cases, default_references};
use libtest_mimic::{Arguments, Failed, Trial};

fn main() {
    let options = Options {
        device: None,
        references: Path::new(env!("CARGO_MANIFEST_DIR")).join(default_references()),
        bless: false,
        program: env!("CARGO_BIN_EXE_canopy").into(),
        cache: Some(device::folder().join("bakes")),
    };
    let suite = Arc::new(Suite::open(options).map_err(|e| e.to_string()));
    let trial = |case: canopy::measure::conform::Case| {
        let suite = suite.clone();
        Trial::test(case.name.clone(), move || {
            let suite = suite.as_ref().as_ref()?;
            let outcome = suite.run(&case)?;
            println!("{}: {} {}", outcome.name, outcome.verdict.name(), outcome.measured);
            if outcome.verdict.is_failure() { Err(Failed::from(outcome.reason)) } else { Ok(()) }
        })
    };
    libtest_mimic::run(&Arguments::from_args(), cases().into_iter().map(trial).collect()).exit();
}
