//! Bytes of the lines that a block becomes.

use crate::block::Block;
use crate::interpreter::Motions;
use crate::lexer::{LONGEST_LINE, Word};
use crate::refusal::{Fault, LineResult};

/// The block to be written and its effect.
pub struct Source<'a> {
    pub line: &'a [u8],
    pub words: &'a [Word],
    pub deletable: bool,
    pub motions: &'a Motions,
}

/// A line that belongs to the block, and is left out with it.
pub fn own_line(source: &Source<'_>, text: &[u8], newline: &[u8], out: &mut Vec<u8>) {
    if source.deletable {
        out.push(b'/');
    }
    out.extend_from_slice(text);
    out.extend_from_slice(newline);
}

/// What acts before the move, as a block of its own: on some controls it would act behind the first piece.
pub fn preceding_line(source: &Source<'_>, spaced: bool, newline: &[u8], out: &mut Vec<u8>) {
    let begin = out.len();
    for word in source.words.iter().filter(|word| Block::precedes(word, source.words)) {
        if out.len() > begin {
            separate(spaced, out);
        } else if source.deletable {
            out.push(b'/');
        }
        let (at, end) = word.span();
        out.extend_from_slice(&source.line[at..end]);
    }
    if out.len() > begin {
        out.extend_from_slice(newline);
    }
}

pub fn separate(spaced: bool, out: &mut Vec<u8>) {
    if spaced {
        out.push(b' ');
    }
}

/// Takes the blanks in front of a word that is left out with it.
pub fn remove_blanks(begin: usize, out: &mut Vec<u8>) {
    while out.len() > begin && matches!(out.last(), Some(b' ' | b'\t')) {
        out.pop();
    }
}

pub fn without_end(line: &[u8]) -> &[u8] {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    line.strip_suffix(b"\r").unwrap_or(line)
}

pub fn check_lengths(written: &[u8]) -> LineResult<()> {
    if written.split(|byte| *byte == b'\n').all(|line| line.len() <= LONGEST_LINE) {
        return Ok(());
    }
    let message = format!("corrected, this line gets longer than {LONGEST_LINE} bytes");
    let fault = Fault::new("gcode-line-too-long", 0, 0, message);
    Err(fault.hint("put its comment on a line of its own"))
}
