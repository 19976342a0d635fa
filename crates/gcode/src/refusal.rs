//! Why a program is not taken: what, where, and what would be.

use std::fmt;

/// One thing in a program that cannot be interpreted exactly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// What kind of thing it is; one of [`Refusal::CODES`].
    pub code: &'static str,
    /// The same for people.
    pub message: String,
    /// Line of the program, from 1 on.
    pub line: u64,
    /// Character of the line, from 1 on.
    pub column: usize,
    /// What stands there.
    pub found: Option<String>,
    /// What would be taken instead.
    pub expected: Option<String>,
    /// What to do about it.
    pub hint: Option<String>,
}

impl Refusal {
    /// Every code with its meaning in one line.
    pub const CODES: &'static [(&'static str, &'static str)] = &[
        ("gcode-not-text", "a byte that no program has outside of comments"),
        ("gcode-line-too-long", "a line of a program longer than a controller reads"),
        ("gcode-bad-character", "a character that no word begins with"),
        ("gcode-comment", "a comment that is not closed, or one within another"),
        ("gcode-no-number", "a letter of a program without its number"),
        ("gcode-bad-number", "a number of a program that cannot be read"),
        ("gcode-number-range", "a number of a program too large to be kept exactly"),
        ("gcode-parameters", "a program that computes: parameters, expressions, functions"),
        ("gcode-flow", "a program with subprograms, loops or conditions"),
        ("gcode-block-delete", "a line that begins with /, and nobody says whether it counts"),
        ("gcode-word-twice", "a letter twice in one block"),
        ("gcode-modal-group", "two codes of one block that exclude each other"),
        ("gcode-too-many-codes", "more M codes in a block than a controller takes"),
        ("gcode-unknown-code", "a G or M code that is not known"),
        ("gcode-unsupported", "a G or M code that cannot be corrected exactly"),
        ("gcode-unused-word", "a word that nothing in its block uses"),
        ("gcode-shared-word", "a word that two codes of its block use"),
        ("gcode-missing-word", "a word that a code needs is not there"),
        ("gcode-bad-value", "a word with a number that its code cannot take"),
        ("gcode-no-offset", "a work offset that nobody has given"),
        ("gcode-no-units", "a length before G20 or G21 says what it is"),
        ("gcode-no-motion", "an axis word where no motion is active"),
        ("gcode-no-feed", "a move at feed before a feed rate is given"),
        ("gcode-position-unknown", "a move whose start or end is not known"),
        ("gcode-arc", "an arc that does not close, or is none"),
        ("gcode-division", "a block that cannot be divided or corrected as asked"),
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}: {}", self.line, self.column, self.code, self.message)?;
        for (label, part) in
            [("found", &self.found), ("expected", &self.expected), ("hint", &self.hint)]
        {
            if let Some(part) = part {
                write!(f, "; {label}: {part}")?;
            }
        }
        Ok(())
    }
}

/// A refusal whose line is not known yet: bytes from the line's start instead of a column.
#[derive(Debug)]
pub struct Fault {
    pub code: &'static str,
    pub message: String,
    pub at: usize,
    pub end: usize,
    pub expected: Option<String>,
    pub hint: Option<String>,
}

impl Fault {
    /// A fault about the bytes from `at` to `end` of the line.
    pub fn new(code: &'static str, at: usize, end: usize, message: impl Into<String>) -> Box<Self> {
        let fault = Fault { code, message: message.into(), at, end, expected: None, hint: None };
        Box::new(fault)
    }

    pub fn expected(mut self: Box<Self>, text: impl Into<String>) -> Box<Self> {
        self.expected = Some(text.into());
        self
    }

    pub fn hint(mut self: Box<Self>, text: impl Into<String>) -> Box<Self> {
        self.hint = Some(text.into());
        self
    }

    /// The refusal, for the line of this number and text.
    pub fn at_line(self, line: u64, text: &[u8]) -> Error {
        let (at, end) = (self.at.min(text.len()), self.end.min(text.len()));
        // A character counts by the byte that begins it, in UTF-8 and in one-byte encodings of ASCII text.
        let column = 1 + text[..at].iter().filter(|byte| (**byte & 0xC0) != 0x80).count();
        let found = (end > at).then(|| {
            let shown = String::from_utf8_lossy(&text[at..end]);
            shown.chars().take(60).flat_map(char::escape_debug).collect()
        });
        Error::Refusal(Box::new(Refusal {
            code: self.code,
            message: self.message,
            line,
            column,
            found,
            expected: self.expected,
            hint: self.hint,
        }))
    }
}

/// Result of what looks at one line.
pub type LineResult<T> = Result<T, Box<Fault>>;

/// What stops reading or writing.
#[derive(Debug)]
pub enum Error {
    /// The program cannot be interpreted exactly.
    Refusal(Box<Refusal>),
    /// The file cannot be read or written.
    Io(std::io::Error),
    /// The calls of a corrector came in an order, or with arrays, that fit nothing.
    Call(&'static str),
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Error::Io(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Refusal(refusal) => refusal.fmt(f),
            Error::Io(error) => error.fmt(f),
            Error::Call(message) => message.fmt(f),
        }
    }
}

impl std::error::Error for Error {}
