//! Tree positions from a CSV inventory: columns x, y and optionally scale and rotation, in any order.

use std::path::Path;

use super::TreePosition;
use crate::input::read_bytes;
use crate::settings::nearest;
use crate::{Error, Result};

const COLUMNS: [&str; 4] = ["x", "y", "scale", "rotation"];
const MAX_BYTES: u64 = 4 << 30;
const MAX_TREES: usize = 50_000_000;

/// Reads an inventory. `origin` is subtracted from x and y in double precision; what remains must lie on the
/// terrain, `0..=extent`. Empty scale or rotation cells are `None`.
///
/// Errors name the line and the column: unknown, missing or repeated columns, cells that are no finite number,
/// positions outside the terrain, scales that are not positive or exceed 100, rotations beyond ±360°.
pub fn load_positions(path: &Path, origin: [f64; 2], extent: [f64; 2]) -> Result<Vec<TreePosition>> {
    parse(path, &read_bytes(path, MAX_BYTES)?, origin, extent)
}

fn csv_error(path: &Path, error: &csv::Error) -> Error {
    let place = error.position().map_or(String::new(), |p| format!("line {}", p.line()));
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("this row has {len} cells; the header has {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "this row is not valid UTF-8".to_string(),
        _ => error.to_string(),
    };
    Error::input(path, place, what, "correct the row")
}

fn columns(path: &Path, header: &csv::StringRecord) -> Result<[Option<usize>; 4]> {
    let mut found = [None; 4];
    for (i, name) in header.iter().enumerate() {
        let Some(column) = COLUMNS.iter().position(|c| *c == name) else {
            let remedy = match nearest(name, COLUMNS) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "the columns are x, y, scale and rotation".to_string(),
            };
            return Err(Error::input(path, "line 1", format!("there is no column `{name}`"), remedy));
        };
        if found[column].replace(i).is_some() {
            return Err(Error::input(
                path,
                "line 1",
                format!("the column `{name}` is there twice"),
                "remove one",
            ));
        }
    }
    for (column, name) in found.iter().zip(&COLUMNS[..2]) {
        if column.is_none() {
            let remedy = "the first line names the columns: x,y[,scale,rotation]";
            return Err(Error::input(path, "line 1", format!("the column `{name}` is missing"), remedy));
        }
    }
    Ok(found)
}

fn parse(path: &Path, bytes: &[u8], origin: [f64; 2], extent: [f64; 2]) -> Result<Vec<TreePosition>> {
    // A byte-order mark, as spreadsheets write it, is no part of the first column's name.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let found = columns(path, reader.headers().map_err(|e| csv_error(path, &e))?)?;
    let mut trees = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(|e| csv_error(path, &e))? {
        let line = record.position().map_or(0, csv::Position::line);
        let place = |c: usize| format!("line {line}, column `{}`", COLUMNS[c]);
        let cell = |c: usize| -> Result<Option<f64>> {
            let Some(text) = found[c].and_then(|i| record.get(i)).filter(|t| !t.is_empty()) else {
                return Ok(None);
            };
            match text.parse::<f64>() {
                Ok(v) if v.is_finite() => Ok(Some(v)),
                _ => Err(Error::input(
                    path,
                    place(c),
                    format!("\"{text}\" is not a finite number"),
                    "write a number",
                )),
            }
        };
        let along = |c: usize| -> Result<f64> {
            let Some(v) = cell(c)? else {
                return Err(Error::input(path, place(c), "the cell is empty", "write a number of metres"));
            };
            let local = v - origin[c];
            if (0.0..=extent[c]).contains(&local) {
                return Ok(local);
            }
            let what = format!("{v} m is outside the terrain, {} to {} m", origin[c], origin[c] + extent[c]);
            let remedy =
                "remove the row, or set `origin` in [terrain] to the south-west corner in the file's system";
            Err(Error::input(path, place(c), what, remedy))
        };
        let within = |c: usize, low: f64, high: f64| -> Result<Option<f32>> {
            match cell(c)? {
                // The comparison is on the value as stored: 1e-50 is a positive double but a zero float.
                Some(v) if !(low..=high).contains(&v) || (c == 2 && v as f32 <= 0.0) => {
                    let what = format!("{v} is outside {low} to {high}");
                    Err(Error::input(path, place(c), what, "correct the value, or leave the cell empty"))
                }
                v => Ok(v.map(|v| v as f32)),
            }
        };
        let (x, y) = (along(0)?, along(1)?);
        trees.push(TreePosition {
            x,
            y,
            scale: within(2, 0.001, 100.0)?,
            rotation: within(3, -360.0, 360.0)?,
        });
        if trees.len() > MAX_TREES {
            let what = format!("more than {MAX_TREES} trees");
            return Err(Error::input(path, format!("line {line}"), what, "use a density map"));
        }
    }
    Ok(trees)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<TreePosition>> {
        parse(Path::new("t.csv"), text.as_bytes(), [100.0, 200.0], [50.0, 60.0])
    }

    #[test]
    fn columns_come_in_any_order() {
        let trees = read("\u{feff}rotation, y ,x,scale\n90,260,100,\n,200,150,1.5\n").unwrap();
        let a = TreePosition { x: 0.0, y: 60.0, scale: None, rotation: Some(90.0) };
        let b = TreePosition { x: 50.0, y: 0.0, scale: Some(1.5), rotation: None };
        assert_eq!(trees, [a, b]);
        assert!(read("x,y\n").unwrap().is_empty());
    }

    #[test]
    fn mistakes_are_located() {
        for (text, wanted) in [
            ("", "line 1"),
            ("x\n1\n", "`y` is missing"),
            ("x,y,x\n1,1,1\n", "twice"),
            ("x,y,scael\n", "`scale`?"),
            ("100,200\n100,200\n", "line 1"),
            ("x,y\n110,210\n110\n", "line 3: this row has 1 cells"),
            ("x,y\n110,210\n110,abc\n", "line 3, column `y`: \"abc\""),
            ("x,y\n110,NaN\n", "line 2, column `y`"),
            ("x,y\n110,\n", "line 2, column `y`: the cell is empty"),
            ("x,y\n99.9,210\n", "line 2, column `x`: 99.9 m is outside"),
            ("x,y\n110,260.1\n", "line 2, column `y`: 260.1 m is outside"),
            ("x,y,scale\n110,210,0\n", "line 2, column `scale`"),
            ("x,y,scale\n110,210,-1\n", "line 2, column `scale`"),
            ("x,y,rotation\n110,210,361\n", "line 2, column `rotation`"),
        ] {
            let e = read(text).unwrap_err().to_string();
            assert!(e.contains(wanted), "{text:?}: {e}");
        }
        assert!(parse(Path::new("t.csv"), b"x,y\n\xff,1\n", [0.0; 2], [9.0; 2]).is_err());
    }
}
