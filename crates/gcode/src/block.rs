//! The words of one line, each checked for being used once and by one code.

use crate::codes::{self, FeedMode, GCode, MCode, MOST_M_CODES, Motion, NotTaken, PathMode};
use crate::lexer::Word;
use crate::refusal::{Fault, LineResult};
use crate::settings::{AXES, AXIS_LETTERS, AxisSet, Units};

/// Largest size of an axis or centre word: above it decimals get lost in double precision.
pub const LARGEST: f64 = 1e9;

/// One line's words, sorted out.
pub struct Block {
    /// Index of the word of each letter, plus one; 0 where there is none. G, M, N are not in it.
    of_letter: [u8; 26],
    pub axes: AxisSet,
    /// Index of the G word of each group, plus one.
    of_group: [u8; GCode::GROUPS],
    pub motion: Option<Motion>,
    pub no_motion: bool,
    pub plane: Option<codes::Plane>,
    pub units: Option<Units>,
    pub incremental: Option<bool>,
    pub absolute_centres: Option<bool>,
    pub feed_mode: Option<FeedMode>,
    pub offset: Option<u8>,
    /// The code of group 0.
    pub once: Option<GCode>,
    pub path_mode: Option<PathMode>,
    surface_speed: bool,
    m_codes: [Option<(MCode, u8)>; MOST_M_CODES],
    pub ends: bool,
}

/// The group whose codes are for one block only.
const ONCE: usize = 0;
const MOTION: usize = 1;
const NO_MOTION: usize = 2;

impl Block {
    /// Sorts the words out.
    pub fn new(words: &[Word]) -> LineResult<Self> {
        let mut block = Block {
            of_letter: [0; 26],
            axes: AxisSet::default(),
            of_group: [0; GCode::GROUPS],
            motion: None,
            no_motion: false,
            plane: None,
            units: None,
            incremental: None,
            absolute_centres: None,
            feed_mode: None,
            offset: None,
            once: None,
            path_mode: None,
            surface_speed: false,
            m_codes: [None; MOST_M_CODES],
            ends: false,
        };
        let mut dollar = None;
        for (index, word) in words.iter().enumerate() {
            match word.letter {
                b'N' => {}
                b'G' => block.take_g(words, index)?,
                b'M' => block.take_m(words, index)?,
                b'$' if dollar.replace(word).is_none() => {}
                b'$' => return Err(twice(word)),
                letter => {
                    let place = &mut block.of_letter[usize::from(letter - b'A')];
                    if *place != 0 {
                        return Err(twice(word));
                    }
                    *place = index as u8 + 1;
                    if let Some(axis) = AXIS_LETTERS.iter().position(|axis| *axis == letter) {
                        in_range(word)?;
                        block.axes.insert(axis);
                    }
                }
            }
        }
        let plain = |word: &Word| matches!(word.letter, b'X' | b'Y' | b'Z' | b'N' | b'G' | b'F');
        if block.surface_speed || !words.iter().all(plain) {
            block.check_words(words, dollar)?;
        }
        Ok(block)
    }

    /// The word of the letter.
    pub fn word<'w>(&self, words: &'w [Word], letter: u8) -> Option<&'w Word> {
        match self.of_letter[usize::from(letter - b'A')] {
            0 => None,
            place => Some(&words[usize::from(place) - 1]),
        }
    }

    /// The word of the axis.
    pub fn axis<'w>(&self, words: &'w [Word], axis: usize) -> Option<&'w Word> {
        self.word(words, AXIS_LETTERS[axis])
    }

    /// The first word that is an axis word.
    pub fn first_axis<'w>(&self, words: &'w [Word]) -> Option<&'w Word> {
        (0..AXES).filter_map(|axis| self.axis(words, axis)).min_by_key(|word| word.at)
    }

    /// The word of the motion code, or of the one-block code.
    pub fn motion_word<'w>(&self, words: &'w [Word]) -> Option<&'w Word> {
        self.in_group(words, MOTION)
    }

    /// The word of the code that holds for this block only.
    pub fn once_word<'w>(&self, words: &'w [Word]) -> Option<&'w Word> {
        self.in_group(words, ONCE)
    }

    /// The word of G80.
    pub fn no_motion_word<'w>(&self, words: &'w [Word]) -> Option<&'w Word> {
        self.in_group(words, NO_MOTION)
    }

    fn in_group<'w>(&self, words: &'w [Word], group: usize) -> Option<&'w Word> {
        match self.of_group[group] {
            0 => None,
            place => Some(&words[usize::from(place) - 1]),
        }
    }

    /// Whether the word is an M code that stops or ends the program.
    pub fn stops(word: &Word) -> bool {
        word.letter == b'M' && codes::m_code(word.value).is_ok_and(|code| code.stops)
    }

    /// Whether the word goes in front of the pieces of a block that is divided: an M code that acts before
    /// the move, or a word that such a code takes.
    pub fn precedes(word: &Word, words: &[Word]) -> bool {
        let codes = words.iter().filter(|word| word.letter == b'M').filter_map(|word| {
            let code = codes::m_code(word.value).ok()?;
            code.precedes.then_some(code)
        });
        match word.letter {
            b'M' => codes::m_code(word.value).is_ok_and(|code| code.precedes),
            b'S' => codes.clone().any(|code| code.group == codes::SPINDLE),
            b'T' => codes.clone().any(|code| code.group == codes::TOOL),
            letter => codes.clone().any(|code| code.letters.contains(&letter)),
        }
    }

    /// Whether the word is one of G54 to G59.3.
    pub fn selects_offset(word: &Word) -> bool {
        word.letter == b'G' && matches!(codes::g_code(word.value), Ok(GCode::Offset(_)))
    }

    /// Whether the word is G61, G61.1 or G64.
    pub fn is_path_mode(word: &Word) -> bool {
        word.letter == b'G' && matches!(codes::g_code(word.value), Ok(GCode::Path(_)))
    }

    fn take_g(&mut self, words: &[Word], index: usize) -> LineResult<()> {
        let word = &words[index];
        let code = codes::g_code(word.value).map_err(|why| not_taken(word, why))?;
        let group = code.group();
        // G80 beside a motion code has no effect, and twice is the same as once.
        if self.of_group[group] != 0 && code != GCode::NoMotion {
            let other = &words[usize::from(self.of_group[group]) - 1];
            return Err(same_group(word, 'G', other.value));
        }
        self.of_group[group] = index as u8 + 1;
        match code {
            GCode::Motion(motion) => self.motion = Some(motion),
            GCode::NoMotion => self.no_motion = true,
            GCode::Plane(plane) => self.plane = Some(plane),
            GCode::Units(units) => self.units = Some(units),
            GCode::Incremental(mode) => self.incremental = Some(mode),
            GCode::AbsoluteCentres(mode) => self.absolute_centres = Some(mode),
            GCode::Feed(mode) => self.feed_mode = Some(mode),
            GCode::Offset(system) => self.offset = Some(system),
            GCode::Path(mode) => self.path_mode = Some(mode),
            GCode::Spindle { surface_speed } => self.surface_speed = surface_speed,
            GCode::NoCutterCompensation | GCode::NoToolLength | GCode::Retract => {}
            GCode::Dwell
            | GCode::Reference(_)
            | GCode::StoreReference(_)
            | GCode::MachineCoordinates => self.once = Some(code),
        }
        Ok(())
    }

    fn take_m(&mut self, words: &[Word], index: usize) -> LineResult<()> {
        let word = &words[index];
        let code = codes::m_code(word.value).map_err(|why| not_taken(word, why))?;
        for place in &mut self.m_codes {
            match place {
                None => {
                    *place = Some((code, index as u8));
                    self.ends |= code.ends;
                    return Ok(());
                }
                Some((other, at)) if other.group == code.group => {
                    return Err(same_group(word, 'M', words[usize::from(*at)].value));
                }
                Some(_) => {}
            }
        }
        let (at, end) = word.span();
        let message = format!("more than {MOST_M_CODES} M codes in one block");
        Err(Fault::new("gcode-too-many-codes", at, end, message))
    }

    /// Whether each of the letters that only some codes take has one code that takes it.
    fn check_words(&self, words: &[Word], dollar: Option<&Word>) -> LineResult<()> {
        for (code, index) in self.m_codes.iter().flatten() {
            let word = &words[usize::from(*index)];
            if !code.needs.is_empty()
                && !code.needs.iter().any(|letter| self.word(words, *letter).is_some())
            {
                let (at, end) = word.span();
                let needs: Vec<String> =
                    code.needs.iter().map(|letter| char::from(*letter).to_string()).collect();
                let message = format!("M{} needs a {} word", word.value, needs.join(" or "));
                return Err(Fault::new("gcode-missing-word", at, end, message));
            }
        }
        for letter in *b"DEHLPQR" {
            if let Some(word) = self.word(words, letter) {
                self.check_users(word, letter)?;
            }
        }
        if let Some(word) = dollar {
            let in_m = self.m_codes.iter().flatten().any(|(code, _)| code.letters.contains(&b'$'));
            if !in_m {
                return Err(unused(word));
            }
        }
        if let Some(word) = self.word(words, b'S')
            && word.value < 0.0
        {
            return Err(negative(word, "a spindle speed"));
        }
        if let Some(word) = self.word(words, b'T')
            && (word.value < 0.0 || word.value.fract() != 0.0)
        {
            let (at, end) = word.span();
            let fault = Fault::new("gcode-bad-value", at, end, "this is no tool number");
            return Err(fault.expected("a whole number from 0 on"));
        }
        if self.surface_speed && self.word(words, b'S').is_none() {
            return Err(missing(self.in_group(words, 10), "G96 needs a spindle speed, S"));
        }
        Ok(())
    }

    /// Refuses a word of D E H L P Q R that no code of the block, or more than one, takes. What arcs
    /// take is looked at where it is known that the block is one.
    fn check_users(&self, word: &Word, letter: u8) -> LineResult<()> {
        let mut users = self
            .m_codes
            .iter()
            .flatten()
            .filter(|(code, _)| code.letters.contains(&letter))
            .count();
        users += usize::from(letter == b'D' && self.surface_speed);
        users += usize::from(letter == b'P' && self.once == Some(GCode::Dwell));
        users += usize::from(matches!(letter, b'P' | b'Q') && self.blends());
        let arc = matches!(letter, b'P' | b'R') && self.motion.is_none_or(Motion::is_arc);
        match users {
            0 if !arc => Err(unused(word)),
            0 | 1 => Ok(()),
            _ => Err(shared(word)),
        }
    }

    /// G64.
    fn blends(&self) -> bool {
        self.path_mode == Some(PathMode::Blending)
    }

    /// Whether a code that is not an arc takes the letter.
    pub fn taken_elsewhere(&self, letter: u8) -> bool {
        self.m_codes.iter().flatten().any(|(code, _)| code.letters.contains(&letter))
            || (letter == b'P' && (self.once == Some(GCode::Dwell) || self.blends()))
    }
}

/// Refuses a number too large to be kept exactly.
pub fn in_range(word: &Word) -> LineResult<()> {
    if word.value.abs() < LARGEST {
        return Ok(());
    }
    let (at, end) = word.span();
    let fault = Fault::new("gcode-number-range", at, end, "this number is too large");
    Err(fault.expected("a size below 1000000000"))
}

fn not_taken(word: &Word, (code, message, hint): NotTaken) -> Box<Fault> {
    let (at, end) = word.span();
    let fault = Fault::new(code, at, end, message);
    if hint.is_empty() { fault } else { fault.hint(hint) }
}

fn same_group(word: &Word, letter: char, other: f64) -> Box<Fault> {
    let (at, end) = word.span();
    let message =
        format!("{letter}{} and {letter}{other} exclude each other in one block", word.value);
    Fault::new("gcode-modal-group", at, end, message).hint("write them in two lines")
}

fn twice(word: &Word) -> Box<Fault> {
    let (at, end) = word.span();
    let message = format!("{} stands twice in this block", char::from(word.letter));
    Fault::new("gcode-word-twice", at, end, message)
}

pub fn unused(word: &Word) -> Box<Fault> {
    let (at, end) = word.span();
    let message = format!("nothing in this block uses {}", char::from(word.letter));
    Fault::new("gcode-unused-word", at, end, message)
}

pub fn shared(word: &Word) -> Box<Fault> {
    let (at, end) = word.span();
    let message = format!("two codes of this block use {}", char::from(word.letter));
    Fault::new("gcode-shared-word", at, end, message).hint("write them in two lines")
}

pub fn negative(word: &Word, what: &str) -> Box<Fault> {
    let (at, end) = word.span();
    let fault = Fault::new("gcode-bad-value", at, end, format!("{what} cannot be negative"));
    fault.expected("zero or more")
}

pub fn missing(word: Option<&Word>, message: impl Into<String>) -> Box<Fault> {
    let (at, end) = word.map_or((0, 0), Word::span);
    Fault::new("gcode-missing-word", at, end, message)
}
