//! How fast the machine is at the moment: the CPU time of fixed work. Clocks change, and threads that share a core slow each
//! other down, so the CPU time of the same frame differs by tens of per cent from one minute to the next.

use crate::clock::{process_cpu_ms_since, process_cpu_ns};

/// Table that the work looks up, words: as much as a core's first cache holds.
const TABLE: usize = 4096;
/// Steps of the work on a thread: a few milliseconds.
const STEPS: u32 = 400_000;

/// CPU time of the fixed work on all threads, ms; `None` where the system does not tell CPU times.
pub fn pace_ms() -> Option<f64> {
    let start = process_cpu_ns()?;
    rayon::broadcast(|context| std::hint::black_box(work(context.index() as u32)));
    process_cpu_ms_since(Some(start))
}

/// Multiplications, additions and look-ups that depend on one another, as in shading.
fn work(seed: u32) -> f32 {
    let table: Vec<f32> = (0..TABLE).map(|k| k as f32 / TABLE as f32).collect();
    let mut sums = [0.5f32; 8];
    let mut at = seed;
    for _ in 0..STEPS {
        at = at.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let texel = table[(at >> 20) as usize];
        for s in &mut sums {
            *s = *s * 0.75 + texel;
        }
    }
    sums.iter().sum()
}
