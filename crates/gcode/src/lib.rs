//! RS-274/NGC programs as LinuxCNC 2.9 reads them.
//!
//! [`Reader`] gives the moves of a program, [`Corrector`] rewrites the program with corrected
//! and divided moves, everything else in place and untouched. Both stream: memory does not grow with
//! the file. What cannot be interpreted exactly is refused with line and column, never guessed.
//!
//! Lengths are millimetres and angles degrees, in machine coordinates (offsets applied), axes in the
//! order X Y Z A B C U V W. A coordinate that is not known is NaN.

mod arc;
mod block;
mod codes;
mod corrector;
mod feed;
mod interpreter;
mod lexer;
mod lines;
mod moves;
mod number;
mod reader;
mod refusal;
mod settings;
mod writer;
mod written_lines;

pub use codes::PathMode;
pub use corrector::{Corrector, Digits};
pub use lexer::LONGEST_LINE;
pub use moves::{Arc, Kind, Move};
pub use reader::Reader;
pub use refusal::{Error, Refusal};
pub use settings::{AXES, AXIS_LETTERS, AxisSet, Position, Settings, UNKNOWN, Units, WorkOffset};
