//! Words of one line.

use crate::number;
use crate::refusal::{Fault, LineResult};

/// Bytes that a line may have before its newline; LinuxCNC reads no longer ones.
pub const LONGEST_LINE: usize = 252;

/// A letter and its number.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// The letter, in upper case; `$` counts as one.
    pub letter: u8,
    /// Where the letter stands.
    pub at: u16,
    /// Where its number begins, and where both end.
    pub number: u16,
    pub end: u16,
    pub value: f64,
}

impl Word {
    pub fn span(&self) -> (usize, usize) {
        (usize::from(self.at), usize::from(self.end))
    }
}

/// What a line is, beside its words.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shape {
    /// It begins with `/`.
    pub deletable: bool,
    /// It is a single `%`.
    pub percent: bool,
    /// Nothing but blanks.
    pub blank: bool,
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r')
}

/// Puts the words of the line into `words`.
pub fn words_of(line: &[u8], words: &mut Vec<Word>) -> LineResult<Shape> {
    words.clear();
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    let mut shape = Shape { blank: true, ..Shape::default() };
    let mut at = 0;
    while at < line.len() {
        let byte = line[at];
        if is_blank(byte) {
            at += 1;
            continue;
        }
        let first = std::mem::replace(&mut shape.blank, false);
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'$' => {
                let letter = byte.to_ascii_uppercase();
                let word = match letter {
                    b'N' => line_number(line, at, words.is_empty() && at == first_place(line))?,
                    b'O' => return Err(flow(at)),
                    _ => word(line, at, letter)?,
                };
                at = usize::from(word.end);
                words.push(word);
            }
            b'(' => at = comment(line, at)?,
            b';' => {
                no_zero(line, at, line.len())?;
                at = line.len();
            }
            b'/' if first => {
                shape.deletable = true;
                at += 1;
            }
            b'%' if first && line[at + 1..].iter().all(|byte| is_blank(*byte)) => {
                shape.percent = true;
                at = line.len();
            }
            _ => return Err(bad_character(line, at)),
        }
    }
    Ok(shape)
}

/// Where a line number has to stand: in front of everything but blanks and a slash.
fn first_place(line: &[u8]) -> usize {
    let mut at = line.iter().take_while(|byte| is_blank(**byte)).count();
    if line.get(at) == Some(&b'/') {
        at += 1;
        at += line[at..].iter().take_while(|byte| is_blank(**byte)).count();
    }
    at
}

/// The place behind the comment that begins at `at`.
fn comment(line: &[u8], at: usize) -> LineResult<usize> {
    match line[at + 1..].iter().position(|byte| matches!(byte, b'(' | b')')) {
        Some(length) if line[at + 1 + length] == b')' => {
            let end = at + length + 2;
            no_zero(line, at, end)?;
            Ok(end)
        }
        Some(length) => {
            let inner = at + 1 + length;
            let fault = Fault::new("gcode-comment", inner, inner + 1, "a comment within a comment");
            Err(fault.expected("a ) first").hint("comments cannot be nested"))
        }
        None => Err(Fault::new("gcode-comment", at, line.len(), "the comment is not closed")
            .expected("a ) on the same line")),
    }
}

fn no_zero(line: &[u8], at: usize, end: usize) -> LineResult<()> {
    match memchr::memchr(0, &line[at..end]) {
        Some(place) => Err(bad_character(line, at + place)),
        None => Ok(()),
    }
}

fn line_number(line: &[u8], at: usize, first: bool) -> LineResult<Word> {
    if !first {
        let message = "a line number must be the first word of its line";
        return Err(Fault::new("gcode-bad-character", at, at + 1, message));
    }
    let (mut end, mut digits, mut points, mut after) = (at + 1, 0, 0, 0);
    let mut number = 0;
    for (place, byte) in line.iter().enumerate().skip(at + 1) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                after += points;
            }
            b'.' if points == 0 && digits > 0 => points = 1,
            byte if is_blank(*byte) => continue,
            b'.' | b'+' | b'-' => {
                let fault = Fault::new("gcode-bad-number", at, place + 1, "bad line number");
                return Err(fault.expected("digits after N"));
            }
            _ => break,
        }
        if number == 0 {
            number = place;
        }
        end = place + 1;
    }
    if digits == 0 || points > after {
        let fault = Fault::new("gcode-bad-number", at, end, "bad line number");
        return Err(fault.expected("digits after N"));
    }
    Ok(Word { letter: b'N', at: at as u16, number: number as u16, end: end as u16, value: 0.0 })
}

/// The word whose letter stands at `at`. Blanks may stand anywhere in it, as LinuxCNC allows.
fn word(line: &[u8], at: usize, letter: u8) -> LineResult<Word> {
    let mut start = at + 1;
    while start < line.len() && is_blank(line[start]) {
        start += 1;
    }
    let (mut end, mut broken, mut place) = (start, false, start);
    while place < line.len() {
        match line[place] {
            b'0'..=b'9' | b'.' | b'+' | b'-' => {
                broken |= end != place;
                end = place + 1;
            }
            byte if is_blank(byte) => {}
            _ => break,
        }
        place += 1;
    }
    if start == end {
        return Err(no_number(line, at, start));
    }
    let value = if broken {
        let mut joined = [0_u8; LONGEST_LINE];
        let mut count = 0;
        for byte in line[start..end].iter().filter(|byte| !is_blank(**byte)) {
            joined[count] = *byte;
            count += 1;
        }
        number::parse(&joined[..count])
    } else {
        number::parse(&line[start..end])
    };
    let Some(value) = value else {
        // "X-[...]" and "X-#1" are expressions; "X-" and "X1.2.3" are nothing.
        if matches!(line.get(place), Some(b'[' | b'#')) {
            return Err(no_number(line, at, place));
        }
        let fault = Fault::new("gcode-bad-number", start, end, "this is no number");
        return Err(fault.expected("a sign or none, digits, at most one decimal point"));
    };
    Ok(Word { letter, at: at as u16, number: start as u16, end: end as u16, value })
}

/// Why there is no number at `place`, after the letter at `at`.
fn no_number(line: &[u8], at: usize, place: usize) -> Box<Fault> {
    let shown = char::from(line[at].to_ascii_uppercase());
    let rest = &line[place.min(line.len())..];
    let computed = match rest.first() {
        Some(b'#' | b'[') => true,
        Some(byte) => byte.is_ascii_alphabetic() && is_function(rest),
        None => false,
    };
    if computed {
        return computes(line, place, &format!("the number of {shown} is computed"));
    }
    Fault::new("gcode-no-number", at, at + 1, format!("{shown} has no number"))
        .expected(format!("a number after {shown}"))
}

fn is_function(rest: &[u8]) -> bool {
    const NAMES: [&[u8]; 14] = [
        b"abs", b"acos", b"asin", b"atan", b"cos", b"exists", b"exp", b"fix", b"fup", b"ln",
        b"round", b"sin", b"sqrt", b"tan",
    ];
    NAMES.iter().any(|name| {
        rest.len() > name.len()
            && rest[..name.len()].eq_ignore_ascii_case(name)
            && rest[name.len()..].iter().find(|byte| !is_blank(**byte)) == Some(&b'[')
    })
}

fn computes(line: &[u8], at: usize, message: &str) -> Box<Fault> {
    Fault::new("gcode-parameters", at, line.len(), message)
        .expected("a plain number")
        .hint("parameters, expressions and functions are not evaluated: let the CAM system, or the controller's preview, write the program out in numbers")
}

fn flow(at: usize) -> Box<Fault> {
    Fault::new(
        "gcode-flow",
        at,
        at + 1,
        "O words (subprograms, loops, conditions) are not followed",
    )
    .hint("write the program out as plain blocks")
}

fn bad_character(line: &[u8], at: usize) -> Box<Fault> {
    let byte = line[at];
    let fault = |code, message: &str| Fault::new(code, at, at + 1, message);
    match byte {
        b'#' => computes(line, at, "parameters are not kept"),
        b'[' => computes(line, at, "expressions are not evaluated"),
        b'@' | b'^' => {
            fault("gcode-unsupported", "polar coordinates (@ and ^) cannot be corrected")
                .hint("write the end points with axis words")
        }
        b'*' => fault("gcode-bad-character", "checksums (*) are no part of RS-274/NGC")
            .hint("leave the checksums out: they would be wrong after a correction"),
        b'/' => fault("gcode-bad-character", "a / stands only at the very beginning of a line"),
        b'%' => fault("gcode-bad-character", "a % stands alone on its line")
            .hint("% is the first line, and another one the last"),
        b')' => fault("gcode-comment", "a ) that closes no comment"),
        0xEF if line[at..].starts_with(&[0xEF, 0xBB, 0xBF]) => fault(
            "gcode-not-text",
            "the file begins with a byte order mark, which controllers do not read",
        )
        .hint("save it as plain ASCII or as UTF-8 without a byte order mark"),
        0..=31 | 127..=255 => {
            let message = format!("byte 0x{byte:02X} is no part of a program");
            Fault::new("gcode-not-text", at, at + 1, message)
                .expected("ASCII text; other characters only in comments, zero bytes nowhere")
        }
        _ => fault("gcode-bad-character", "no word begins with this character"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Vec<(char, f64)> {
        let mut words = Vec::new();
        words_of(line.as_bytes(), &mut words).unwrap();
        words.iter().map(|word| (char::from(word.letter), word.value)).collect()
    }

    fn refused(line: &[u8]) -> (&'static str, usize) {
        let fault = words_of(line, &mut Vec::new()).unwrap_err();
        (fault.code, fault.at)
    }

    #[test]
    fn words_stand_in_any_case_and_with_blanks_anywhere() {
        let expected = vec![('N', 0.0), ('G', 1.0), ('X', -12.5), ('Y', 0.5)];
        for line in
            ["N10 G1 X-12.5 Y.5", "n10g01x-12.5y+0.5\r\n", " N 1 0\tG 1 X - 1 2 . 5 Y . 5 ; c (\n"]
        {
            assert_eq!(read(line), expected, "{line}");
        }
        assert_eq!(read("(a) G0 (b;c) X1 (d)"), vec![('G', 0.0), ('X', 1.0)]);
        assert_eq!(read("G0 X1 (\u{e9}) ;\u{fc}"), vec![('G', 0.0), ('X', 1.0)]);
        assert_eq!(read("N10.5 M3 $0"), vec![('N', 0.0), ('M', 3.0), ('$', 0.0)]);
    }

    #[test]
    fn what_is_no_word_is_refused_where_it_stands() {
        for (line, code, at) in [
            (&b"G0 X1 Y"[..], "gcode-no-number", 6),
            (b"G0 XY1", "gcode-no-number", 3),
            (b"G0 X(a)1", "gcode-no-number", 3),
            (b"G0 X1.2.3", "gcode-bad-number", 4),
            (b"G0 X--1", "gcode-bad-number", 4),
            (b"G0 X.", "gcode-bad-number", 4),
            (b"G0 X#1", "gcode-parameters", 4),
            (b"G0 X-#1", "gcode-parameters", 5),
            (b"G0 X[1]", "gcode-parameters", 4),
            (b"G0 Xsin[1]", "gcode-parameters", 4),
            (b"#1=2", "gcode-parameters", 0),
            (b"o100 sub", "gcode-flow", 0),
            (b"G0 N1", "gcode-bad-character", 3),
            (b"(c) N1", "gcode-bad-character", 4),
            (b"N1 N2", "gcode-bad-character", 3),
            (b"N", "gcode-bad-number", 0),
            (b"N-1", "gcode-bad-number", 0),
            (b"N10.", "gcode-bad-number", 0),
            (b"G0 /X1", "gcode-bad-character", 3),
            (b"//G0", "gcode-bad-character", 1),
            (b"G0 %", "gcode-bad-character", 3),
            (b"% c", "gcode-bad-character", 0),
            (b"G0 (a", "gcode-comment", 3),
            (b"G0 (a (b)", "gcode-comment", 6),
            (b"G0 )", "gcode-comment", 3),
            (b"G0 X1*71", "gcode-bad-character", 5),
            (b"G0 @1 ^2", "gcode-unsupported", 3),
            (b"G0 X1\0Y2", "gcode-not-text", 5),
            (b"G0 (\0)", "gcode-not-text", 4),
            (b"G0 \xA0X1", "gcode-not-text", 3),
            (b"\xEF\xBB\xBFG0", "gcode-not-text", 0),
        ] {
            assert_eq!(refused(line), (code, at), "{}", String::from_utf8_lossy(line));
        }
    }
}
