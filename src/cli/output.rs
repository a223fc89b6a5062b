//! Tables and JSON on the standard output. A reader that goes away early is no error.

use std::io::{ErrorKind, Write};
use std::path::Path;

use canopy::{Error, Result};

/// Prints text.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
    }
}

/// Prints one JSON object.
pub fn json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::io("standard output", std::io::Error::other(e)))?;
    print(&(text + "\n"))
}

/// Columns under headings: the first `left` to the left, the others, numbers, to the right.
pub struct Table {
    left: usize,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(left: usize, headings: &[&str]) -> Self {
        Table { left, rows: vec![headings.iter().map(|h| h.to_string()).collect()] }
    }

    /// Adds a row of as many cells as there are headings.
    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.cells(cells.into());
    }

    /// The same of a table whose columns are as many as the data have.
    pub fn cells(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// The table as text, indented.
    pub fn text(&self) -> String {
        let columns = self.rows[0].len();
        let width = |k: usize| self.rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
                let gap = " ".repeat(width - cell.chars().count());
                let cell = if k < self.left { cell.clone() + &gap } else { gap + cell };
                line += &format!("  {cell}");
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

/// Bytes for people.
pub fn bytes(n: u64) -> String {
    match n {
        0..10_240 => format!("{n} B"),
        10_240..10_485_760 => format!("{:.1} KiB", n as f64 / 1024.0),
        _ => format!("{:.1} MiB", n as f64 / 1_048_576.0),
    }
}

/// Refuses a path with another extension than `wanted`, and one that cannot be written: before a long run, not after.
pub fn check(path: &Path, wanted: &str) -> Result<()> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted)) {
        return Err(Error::Usage(format!("{} will be a {wanted} file: name it *.{wanted}", path.display())));
    }
    canopy::files::check_writable(path)
}
