//! Progress of anything over a second: a bar on a terminal, plain lines elsewhere, nothing when quiet.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A line for whoever waits, on the standard error. Not `eprintln!`, which panics when no one listens any more.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Counts finished steps of one named job; safe to share between threads.
pub struct Progress {
    bar: Option<indicatif::ProgressBar>,
    plain: Option<&'static str>,
    done: AtomicU64,
    total: u64,
    decile: AtomicU64,
    start: Instant,
}

impl Progress {
    /// Starts a job of `total` steps. With `quiet` nothing is ever printed.
    pub fn new(label: &'static str, total: u64, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let bar = indicatif::ProgressBar::new(total).with_message(label);
            let style = "{msg:24} [{bar:40}] {pos}/{len} {eta}";
            if let Ok(style) = indicatif::ProgressStyle::with_template(style) {
                bar.set_style(style.progress_chars("=> "));
            }
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Progress {
            bar,
            plain: (!quiet && !terminal).then_some(label),
            done: AtomicU64::new(0),
            total,
            decile: AtomicU64::new(0),
            start: Instant::now(),
        }
    }

    /// Counts `steps` more steps as finished.
    pub fn step(&self, steps: u64) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        self.show(done, "");
    }

    /// Sets the number of finished steps, and says how it goes.
    pub fn set(&self, done: u64, note: &str) {
        self.done.store(done, Ordering::Relaxed);
        if let Some(bar) = &self.bar {
            bar.set_message(note.to_string());
        }
        self.show(done, note);
    }

    fn show(&self, done: u64, note: &str) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
        }
        // Plain lines: one a tenth of the job, and none for jobs that end within a second.
        if let Some(label) = self.plain {
            let decile = 10 * done / self.total.max(1);
            if self.start.elapsed() > Duration::from_secs(1)
                && self.decile.fetch_max(decile, Ordering::Relaxed) < decile
            {
                let comma = if note.is_empty() { "" } else { ", " };
                say(&format!("{label}: {} %{comma}{note}", decile * 10));
            }
        }
    }

    /// Ends the job and clears the bar.
    pub fn finish(self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
