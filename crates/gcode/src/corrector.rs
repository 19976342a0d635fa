//! A program read in batches of moves and rewritten with their corrected pieces.

use std::io::{Read, Write};
use std::ops::Range;

use crate::codes::Motion;
use crate::interpreter::{Action, Interpreter};
use crate::lexer::{LONGEST_LINE, Word};
use crate::lines::{Lines, Next};
use crate::moves::Move;
use crate::refusal::Error;
use crate::settings::{AXES, AxisSet, Position, Settings};
use crate::writer::Writer;
use crate::written_lines::Source;

pub use crate::writer::Digits;

/// Bytes of text that a batch holds at most, beside its last line.
const BATCH: usize = 1 << 20;

/// Bytes after which written text goes out.
const FLUSH: usize = 1 << 16;

/// One move waiting for its pieces, with the text before it.
struct Pending {
    before: Before,
    line: Range<usize>,
    words: Range<usize>,
    deletable: bool,
    motions: crate::interpreter::Motions,
}

/// Unchanged text, and its effect on the controller's state.
#[derive(Clone)]
struct Before {
    text: Range<usize>,
    motion: Option<Option<Motion>>,
    placed: AxisSet,
    at: Position,
}

impl Before {
    fn from(start: usize) -> Self {
        Before { text: start..start, motion: None, placed: AxisSet(0), at: [0.0; AXES] }
    }
}

/// Rewrites a program: everything in place and in order, moves corrected and divided.
///
/// [`read`](Self::read) a batch of moves, [`write`](Self::write) their pieces, until `read` finds
/// none; then [`finish`](Self::finish).
pub struct Corrector<R, W> {
    lines: Lines<R>,
    interpreter: Interpreter,
    output: W,
    text: Vec<u8>,
    words: Vec<Word>,
    pending: Vec<Pending>,
    before: Before,
    moves: Vec<Move>,
    writer: Writer,
    out: Vec<u8>,
    heading: Option<String>,
}

impl<R: Read, W: Write> Corrector<R, W> {
    /// A corrector of a program. Axes of `settings.axes` are corrected; the others are written only
    /// where the program writes them.
    pub fn new(input: R, output: W, settings: Settings, digits: Digits) -> Self {
        let writer = Writer::new(settings.start, settings.axes, digits);
        Corrector {
            lines: Lines::new(input),
            interpreter: Interpreter::new(settings),
            output,
            text: Vec::new(),
            words: Vec::new(),
            pending: Vec::new(),
            before: Before::from(0),
            moves: Vec::new(),
            writer,
            out: Vec::with_capacity(2 * FLUSH),
            heading: None,
        }
    }

    /// With this comment in a line of its own at the beginning, behind a %; ASCII without parentheses.
    #[must_use]
    pub fn with_heading(mut self, text: &str) -> Self {
        self.heading = Some(format!("({text})"));
        self
    }

    /// With this block, G64 with its P, in front of the pieces of a block that the program wants to end in an
    /// exact stop (G61, G61.1): only its last piece ends in one.
    #[must_use]
    pub fn with_path_mode(mut self, block: &str) -> Self {
        self.writer.blend_pieces(block);
        self
    }

    /// The next moves, at most so many; none behind the last. What was read before must have been
    /// written.
    ///
    /// # Errors
    ///
    /// The program cannot be interpreted exactly, or a file cannot be read or written.
    pub fn read(&mut self, most: usize) -> Result<&[Move], Error> {
        if !self.pending.is_empty() {
            return Err(Error::Call("the moves read before have not been written"));
        }
        self.moves.clear();
        while self.pending.len() < most.max(1)
            && self.text.len() < BATCH
            && !self.interpreter.ended()
        {
            if !self.take_line()? {
                break;
            }
            if self.pending.is_empty() && self.text.len() >= FLUSH {
                self.pass_on()?;
            }
        }
        Ok(&self.moves)
    }

    /// Writes the moves that were read: each as `counts` pieces, which end at `points` (machine
    /// coordinates; what stands in columns that are not corrected does not matter) and at these
    /// `shares` of the programmed path, rising to 1.
    ///
    /// # Errors
    ///
    /// A block cannot be written so, or the file cannot be written.
    pub fn write(
        &mut self,
        counts: &[usize],
        points: &[Position],
        shares: &[f64],
    ) -> Result<(), Error> {
        if counts.len() != self.pending.len() {
            return Err(Error::Call("a count for each of the moves that were read is needed"));
        }
        if counts.contains(&0) {
            return Err(Error::Call("a move has at least one piece"));
        }
        if points.len() != counts.iter().sum::<usize>() || shares.len() != points.len() {
            return Err(Error::Call("a point and a share for each piece are needed"));
        }
        let pending = std::mem::take(&mut self.pending);
        let mut first = 0;
        for (block, count) in pending.iter().zip(counts) {
            self.pass(&block.before);
            let pieces = first..first + count;
            first += count;
            let source = Source {
                line: &self.text[block.line.clone()],
                words: &self.words[block.words.clone()],
                deletable: block.deletable,
                motions: &block.motions,
            };
            self.writer
                .write(&source, &points[pieces.clone()], &shares[pieces], &mut self.out)
                .map_err(|fault| fault.at_line(block.motions.motion.line, source.line))?;
            if self.out.len() >= FLUSH {
                self.flush()?;
            }
        }
        let behind = self.before.clone();
        self.pass(&behind);
        self.pending = pending;
        self.pending.clear();
        self.text.clear();
        self.words.clear();
        self.before = Before::from(0);
        Ok(())
    }

    /// Writes the rest of the program, which moves nothing, and returns the output.
    ///
    /// # Errors
    ///
    /// There are moves that have not been written, or a file cannot be read or written.
    pub fn finish(mut self) -> Result<W, Error> {
        while self.pending.is_empty() && !self.interpreter.ended() && self.take_line()? {
            if self.text.len() >= FLUSH {
                self.pass_on()?;
            }
        }
        if !self.pending.is_empty() {
            return Err(Error::Call("there are moves that have not been written"));
        }
        self.pass_on()?;
        self.flush()?;
        loop {
            let rest = self.lines.rest()?;
            if rest.is_empty() {
                break;
            }
            self.output.write_all(rest)?;
        }
        self.output.flush()?;
        Ok(self.output)
    }

    /// Lines read.
    pub fn line(&self) -> u64 {
        self.interpreter.line()
    }

    /// Takes one line into the batch; returns whether there was one.
    fn take_line(&mut self) -> Result<bool, Error> {
        let range = match self.lines.next(LONGEST_LINE)? {
            Next::Line(range) => range,
            Next::TooLong(range) => return Err(self.interpreter.too_long(self.lines.bytes(range))),
            Next::End => return Ok(false),
        };
        let line = self.lines.bytes(range);
        let words = line.trim_ascii();
        let heading = if words.is_empty() { None } else { self.heading.take() };
        let behind = words.first() == Some(&b'%');
        let mut head = Vec::new();
        if let Some(heading) = heading {
            head.extend_from_slice(heading.as_bytes());
            head.extend_from_slice(if line.ends_with(b"\r\n") { b"\r\n" } else { b"\n" });
        }
        if !behind {
            self.text.extend_from_slice(&head);
            self.before.text.end = self.text.len();
        }
        let start = self.text.len();
        self.text.extend_from_slice(line);
        match self.interpreter.take(line)? {
            Action::Moves(motions) => {
                let (words, deletable) = self.interpreter.words();
                let first = self.words.len();
                self.words.extend_from_slice(words);
                let end = self.text.len();
                let before = std::mem::replace(&mut self.before, Before::from(end));
                self.moves.push(motions.motion.clone());
                self.pending.push(Pending {
                    before,
                    line: start..end,
                    words: first..self.words.len(),
                    deletable,
                    motions,
                });
            }
            Action::Nothing { motion } => {
                self.before.text.end = self.text.len();
                self.before.motion = motion.or(self.before.motion);
            }
            Action::Reference { axes, to } => {
                self.before.text.end = self.text.len();
                self.before.placed.0 |= axes.0;
                for axis in (0..AXES).filter(|axis| axes.contains(*axis)) {
                    self.before.at[axis] = to[axis];
                }
            }
        }
        if behind && !head.is_empty() {
            self.text.extend_from_slice(&head);
            self.before.text.end = self.text.len();
        }
        Ok(true)
    }

    /// Writes the text that waits in front of any move.
    fn pass_on(&mut self) -> Result<(), Error> {
        let before = std::mem::replace(&mut self.before, Before::from(0));
        self.pass(&before);
        self.text.clear();
        self.flush()
    }

    fn pass(&mut self, before: &Before) {
        self.out.extend_from_slice(&self.text[before.text.clone()]);
        self.writer.passed(before.motion, before.placed, &before.at);
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.output.write_all(&self.out)?;
        self.out.clear();
        Ok(())
    }
}
