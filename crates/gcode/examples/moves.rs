//! Prints the moves of programs, one a line: `moves [--corrected] [--units mm|in] FILE ...`.
//!
//! Each line is the program's line number, the kind, nine end coordinates, and for an arc its two
//! axes, centre and turns, in full precision. A refusal is a line `! line column code message`; after
//! each file comes a line `= FILE`. The start is the origin.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use truepose_gcode::{Error, Kind, Move, Reader, Settings, Units};

fn print(out: &mut impl Write, motion: &Move) -> io::Result<()> {
    let kind = match motion.kind {
        Kind::Rapid => "G0",
        Kind::Line => "G1",
        Kind::Arc => "ARC",
    };
    write!(out, "{} {kind}", motion.line)?;
    for coordinate in motion.end {
        write!(out, " {coordinate:?}")?;
    }
    if let Some(arc) = &motion.arc {
        let [u, v] = arc.plane;
        write!(out, " {u} {v} {:?} {:?} {}", arc.centre[0], arc.centre[1], arc.turns)?;
    }
    writeln!(out)
}

fn main() -> io::Result<()> {
    let mut settings =
        Settings { start: [0.0; 9], block_delete: Some(false), ..Settings::default() };
    let mut out = BufWriter::new(io::stdout().lock());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--units" => {
                settings.units = match words.next().as_deref() {
                    Some("in") => Some(Units::Inch),
                    _ => Some(Units::Millimetre),
                }
            }
            path => {
                let mut reader = Reader::new(File::open(path)?, settings.clone());
                loop {
                    match reader.next_move() {
                        Ok(Some(motion)) => print(&mut out, &motion)?,
                        Ok(None) => break,
                        Err(Error::Refusal(refusal)) => {
                            let message = refusal.message;
                            let (line, column) = (refusal.line, refusal.column);
                            writeln!(out, "! {line} {column} {} {message}", refusal.code)?;
                            break;
                        }
                        Err(error) => return Err(io::Error::other(error)),
                    }
                }
                writeln!(out, "= {path}")?;
            }
        }
    }
    out.flush()
}
