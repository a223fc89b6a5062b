//! The `canopy` program.
fn main() {}
