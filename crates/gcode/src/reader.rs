//! The moves of a program, one after the other.

use std::io::Read;

use crate::interpreter::{Action, Interpreter};
use crate::lexer::LONGEST_LINE;
use crate::lines::{Lines, Next};
use crate::moves::Move;
use crate::refusal::Error;
use crate::settings::Settings;

/// Reads a program as it comes; memory does not grow with its size.
pub struct Reader<R> {
    lines: Lines<R>,
    interpreter: Interpreter,
}

impl<R: Read> Reader<R> {
    /// A reader of the program.
    pub fn new(input: R, settings: Settings) -> Self {
        Reader { lines: Lines::new(input), interpreter: Interpreter::new(settings) }
    }

    /// The next move; `None` behind the last.
    ///
    /// # Errors
    ///
    /// The program cannot be interpreted exactly, or the input cannot be read.
    pub fn next_move(&mut self) -> Result<Option<Move>, Error> {
        while !self.interpreter.ended() {
            let action = match self.lines.next(LONGEST_LINE)? {
                Next::Line(line) => self.interpreter.take(self.lines.bytes(line))?,
                Next::TooLong(line) => {
                    return Err(self.interpreter.too_long(self.lines.bytes(line)));
                }
                Next::End => return Ok(None),
            };
            if let Action::Moves(moves) = action {
                return Ok(Some(moves.motion));
            }
        }
        Ok(None)
    }

    /// Lines read.
    pub fn line(&self) -> u64 {
        self.interpreter.line()
    }
}
