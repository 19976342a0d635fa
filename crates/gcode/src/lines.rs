//! Lines of a file of any size, in a buffer of one size.

use std::io::{self, Read};

/// Bytes read at a time.
const BUFFER: usize = 1 << 17;

/// Lines with their ends, one after the other.
pub struct Lines<R> {
    input: R,
    buffer: Box<[u8]>,
    /// What is in the buffer and not yet given out.
    start: usize,
    end: usize,
    finished: bool,
}

/// What comes next in the file, as bytes of the buffer.
pub enum Next {
    /// A line with its end; the last one may have none.
    Line(std::ops::Range<usize>),
    /// The beginning of a line that is longer than the limit.
    TooLong(std::ops::Range<usize>),
    /// Nothing.
    End,
}

impl<R: Read> Lines<R> {
    pub fn new(input: R) -> Self {
        let buffer = vec![0; BUFFER].into_boxed_slice();
        Lines { input, buffer, start: 0, end: 0, finished: false }
    }

    /// The bytes of the last answer.
    pub fn bytes(&self, range: std::ops::Range<usize>) -> &[u8] {
        &self.buffer[range]
    }

    /// The next line of at most `longest` bytes without its newline.
    pub fn next(&mut self, longest: usize) -> io::Result<Next> {
        loop {
            let waiting = &self.buffer[self.start..self.end];
            let window = &waiting[..waiting.len().min(longest + 1)];
            if let Some(at) = memchr::memchr(b'\n', window) {
                let line = self.start..self.start + at + 1;
                self.start = line.end;
                return Ok(Next::Line(line));
            }
            if waiting.len() > longest {
                return Ok(Next::TooLong(self.start..self.start + longest + 1));
            }
            if self.finished {
                let line = self.start..self.end;
                self.start = self.end;
                return Ok(if line.is_empty() { Next::End } else { Next::Line(line) });
            }
            self.fill()?;
        }
    }

    /// Whatever comes next, line or not; empty at the end.
    pub fn rest(&mut self) -> io::Result<&[u8]> {
        if self.start == self.end && !self.finished {
            self.fill()?;
        }
        let rest = self.start..self.end;
        self.start = self.end;
        Ok(&self.buffer[rest])
    }

    /// Moves the unread bytes to the front and reads more behind them.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        loop {
            match self.input.read(&mut self.buffer[self.end..]) {
                Ok(count) => {
                    self.end += count;
                    self.finished = count == 0;
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}
