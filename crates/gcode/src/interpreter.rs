//! From lines to moves: the modal state of a program and what each block does to it.

use crate::arc;
use crate::block::{self, Block, LARGEST};
use crate::codes::{FeedMode, GCode, Motion, PathMode, Plane};
use crate::feed::Feed;
use crate::lexer::{self, Word};
use crate::moves::{Arc, Kind, Move};
use crate::refusal::{Error, Fault, LineResult};
use crate::settings::{
    AXES, AXIS_LETTERS, AxisSet, Position, Settings, UNKNOWN, Units, WorkOffset, in_turned_axes,
    is_rotary,
};

/// How the coordinates of a block's axis words are meant.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Millimetres in a unit of X Y Z U V W words.
    pub scale: f64,
    /// Added to absolute words, mm or degrees, in the axes of the coordinate system; zero under G53.
    pub offset: Position,
    /// By which these axes are turned about Z, rad.
    pub rotation: f64,
    pub incremental: bool,
    /// G53.
    pub machine: bool,
}

impl Frame {
    /// Millimetres, or degrees, in a unit of the axis' word.
    pub fn unit(&self, axis: usize) -> f64 {
        if is_rotary(axis) { 1.0 } else { self.scale }
    }
}

/// The effect of a line on the position, and what is needed to rewrite it.
#[derive(Clone, Debug)]
pub struct Motions {
    pub motion: Move,
    pub frame: Frame,
    /// Motion code that the move needs.
    pub code: Motion,
    pub feed: Feed,
    /// G28 or G30 follows the move: it takes the axes that the block names to these coordinates.
    pub reference: Option<Position>,
}

/// What a line is to the program.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "most lines move; an allocation for each costs more")]
pub enum Action {
    /// It moves nothing; the motion code that it leaves active, if it sets one.
    Nothing { motion: Option<Option<Motion>> },
    /// It moves.
    Moves(Motions),
    /// G28 or G30 from where the machine stands takes the axes to these coordinates.
    Reference { axes: AxisSet, to: Position },
}

/// A program's state between two lines.
pub struct Interpreter {
    settings: Settings,
    units: Option<Units>,
    plane: Plane,
    incremental: bool,
    absolute_centres: bool,
    system: usize,
    motion: Option<Motion>,
    feed: Feed,
    path_mode: Option<PathMode>,
    position: Position,
    reference: [Position; 2],
    /// Lines are inside of % ... %.
    percent: bool,
    begun: bool,
    ended: bool,
    line: u64,
    words: Vec<Word>,
    deletable: bool,
}

impl Interpreter {
    pub fn new(settings: Settings) -> Self {
        Interpreter {
            units: settings.units,
            plane: Plane::Xy,
            incremental: false,
            absolute_centres: false,
            system: settings.system,
            motion: None,
            feed: Feed { mode: FeedMode::PerMinute, rate: None, units: None },
            path_mode: None,
            position: settings.start,
            reference: settings.reference,
            percent: false,
            begun: false,
            ended: false,
            line: 0,
            words: Vec::with_capacity(lexer::LONGEST_LINE),
            deletable: false,
            settings,
        }
    }

    /// Whether the program's end has been read; what follows belongs to nobody.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Lines read.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The words of the last line, and whether it began with a slash.
    pub fn words(&self) -> (&[Word], bool) {
        (&self.words, self.deletable)
    }

    /// Takes the next line.
    pub fn take(&mut self, line: &[u8]) -> Result<Action, Error> {
        self.line += 1;
        let mut words = std::mem::take(&mut self.words);
        let result = self.read(line, &mut words);
        self.words = words;
        result.map_err(|fault| fault.at_line(self.line, line))
    }

    /// Refuses the next line, which is longer than a controller reads.
    pub fn too_long(&mut self, beginning: &[u8]) -> Error {
        self.line += 1;
        let limit = lexer::LONGEST_LINE;
        let text = &beginning[..beginning.len().min(limit + 1)];
        let fault = Fault::new("gcode-line-too-long", limit, limit, "the line is too long")
            .expected(format!("at most {limit} bytes before the end of the line"));
        fault.at_line(self.line, text)
    }

    fn read(&mut self, line: &[u8], words: &mut Vec<Word>) -> LineResult<Action> {
        const NOTHING: Action = Action::Nothing { motion: None };
        self.deletable = false;
        if self.settings.block_delete == Some(true)
            && line.iter().find(|byte| !matches!(byte, b' ' | b'\t' | b'\r')) == Some(&b'/')
        {
            words.clear();
            self.begun = true;
            return Ok(NOTHING);
        }
        let shape = lexer::words_of(line, words)?;
        if shape.blank {
            return Ok(NOTHING);
        }
        let first = !std::mem::replace(&mut self.begun, true);
        if shape.percent {
            if first {
                self.percent = true;
            } else if self.percent {
                self.ended = true;
            } else {
                let at = line.iter().position(|byte| *byte == b'%').unwrap_or(0);
                let message = "a % ends only a program that begins with one";
                return Err(Fault::new("gcode-bad-character", at, at + 1, message));
            }
            return Ok(NOTHING);
        }
        if shape.deletable && self.settings.block_delete.is_none() {
            let at = line.iter().position(|byte| *byte == b'/').unwrap_or(0);
            let message = "whether lines that begin with / count is the operator's choice";
            return Err(Fault::new("gcode-block-delete", at, at + 1, message).hint(
                "say by the setting for block delete whether they are left out (on) or run (off)",
            ));
        }
        self.deletable = shape.deletable;
        if words.is_empty() {
            return Ok(NOTHING);
        }
        let block = Block::new(words)?;
        self.execute(&block, words)
    }

    /// What a block does, in the order in which a controller does it.
    fn execute(&mut self, block: &Block, words: &[Word]) -> LineResult<Action> {
        self.set_feed(block, words)?;
        self.plane = block.plane.unwrap_or(self.plane);
        self.units = block.units.or(self.units);
        self.incremental = block.incremental.unwrap_or(self.incremental);
        self.absolute_centres = block.absolute_centres.unwrap_or(self.absolute_centres);
        if let Some(system) = block.offset {
            self.select(usize::from(system), words)?;
        }
        self.path_mode = block.path_mode.or(self.path_mode);
        self.ended |= block.ends;
        match block.once {
            Some(GCode::Dwell) => dwell(block, words)?,
            // The controller stores where it stands: corrected, and not by this program's word.
            Some(GCode::StoreReference(which)) => self.reference[usize::from(which)] = UNKNOWN,
            Some(GCode::Reference(which)) => return self.go_to_reference(block, words, which),
            _ => {}
        }
        let machine = block.once == Some(GCode::MachineCoordinates);
        if let Some(motion) = block.motion {
            self.motion = Some(motion);
        } else if block.no_motion {
            self.motion = None;
        }
        let set = (block.motion.is_some() || block.no_motion).then_some(self.motion);
        let circular = self.motion.is_some_and(Motion::is_arc);
        let moves = block.axes.0 != 0 || (circular && has_centre(block, words));
        if block.motion.is_some_and(Motion::is_arc) && !moves {
            return Err(block::missing(
                block.motion_word(words),
                "an arc needs an end or a centre",
            )
            .expected("axis words, and I J K or R"));
        }
        if moves && matches!(block.once, Some(GCode::StoreReference(_))) {
            let (at, end) = block.once_word(words).unwrap_or(&words[0]).span();
            let message = "G28.1 and G30.1 cannot be corrected beside a move";
            return Err(Fault::new("gcode-unsupported", at, end, message)
                .hint("write them in a line of their own"));
        }
        if !moves {
            if machine && block.motion.is_none() {
                let fault = block::missing(block.once_word(words), "G53 moves nothing here");
                return Err(fault.expected("G0 or G1, and axis words, in the same block"));
            }
            if block.motion == Some(Motion::Line) {
                self.check_feed(block, words)?;
            }
            self.refuse_centre(block, words)?;
            return Ok(Action::Nothing { motion: set });
        }
        let Some(code) = self.motion else {
            let word = block.first_axis(words).or(block.no_motion_word(words)).unwrap_or(&words[0]);
            let (at, end) = word.span();
            let message =
                format!("{} says where, but no motion is active", char::from(word.letter));
            return Err(Fault::new("gcode-no-motion", at, end, message)
                .expected("G0, G1, G2 or G3, in this block or before"));
        };
        if machine && (code.is_arc() || self.incremental) {
            let (at, end) = block.once_word(words).unwrap_or(&words[0]).span();
            let message = "G53 goes with G0 and G1 in G90 only";
            return Err(Fault::new("gcode-unsupported", at, end, message));
        }
        if code.is_arc() {
            self.move_on_arc(block, words, code)
        } else {
            self.refuse_centre(block, words)?;
            self.move_straight(block, words, code, machine)
        }
    }

    fn select(&mut self, system: usize, words: &[Word]) -> LineResult<()> {
        if self.settings.offsets[system].is_none() {
            let word = words.iter().find(|word| Block::selects_offset(word)).unwrap_or(&words[0]);
            let (at, end) = word.span();
            let message = "a work offset, and nothing has said what it is";
            return Err(Fault::new("gcode-no-offset", at, end, message)
                .expected("an offset that was given")
                .hint("give the offset that the controller has stored as a setting, or leave the code out"));
        }
        self.system = system;
        Ok(())
    }

    fn set_feed(&mut self, block: &Block, words: &[Word]) -> LineResult<()> {
        if let Some(mode) = block.feed_mode {
            self.feed = Feed { mode, rate: None, units: None };
        }
        if self.feed.mode == FeedMode::InverseTime {
            self.feed.rate = None;
        }
        if let Some(word) = block.word(words, b'F') {
            if word.value < 0.0 {
                return Err(block::negative(word, "a feed rate"));
            }
            block::in_range(word)?;
            // A block sets F before it changes units.
            self.feed.rate = Some(word.value);
            self.feed.units = self.units;
        }
        Ok(())
    }

    fn check_feed(&self, block: &Block, words: &[Word]) -> LineResult<()> {
        if self.feed.rate.is_some_and(|rate| rate > 0.0) {
            return Ok(());
        }
        let word = block.word(words, b'F').or(block.motion_word(words)).or(block.first_axis(words));
        let (at, end) = word.map_or((0, 0), Word::span);
        let fault = Fault::new("gcode-no-feed", at, end, "there is no feed rate for this move");
        Err(if self.feed.mode == FeedMode::InverseTime {
            fault.expected("F in every block that moves at feed, in G93")
        } else {
            fault.expected("F above zero, in this block or since the last of G93, G94, G95")
        })
    }

    fn frame(&self, block: &Block, words: &[Word], machine: bool) -> LineResult<Frame> {
        let lengths = [0, 1, 2, 6, 7, 8].map(|axis| AXIS_LETTERS[axis]);
        let length = lengths.iter().chain(b"IJKR").find_map(|letter| block.word(words, *letter));
        let scale = match (self.units, length) {
            (Some(units), _) => units.millimetres(),
            // Without a length words turn only, and their unit does not matter.
            (None, None) => f64::NAN,
            (None, Some(word)) => {
                let (at, end) = word.span();
                let message = "a length, and nothing has said in what units";
                return Err(Fault::new("gcode-no-units", at, end, message)
                    .expected("G20 (inch) or G21 (mm) before")
                    .hint("or give the units that the controller starts with as a setting"));
            }
        };
        let system = if machine { None } else { self.settings.offsets[self.system] };
        let WorkOffset { origin, rotation } = system.unwrap_or(WorkOffset::NONE);
        let offset = in_turned_axes(&origin, rotation);
        Ok(Frame { scale, offset, rotation, incremental: self.incremental, machine })
    }

    /// Where the block's axis words lead, in the axes of the coordinate system.
    fn target(&self, block: &Block, words: &[Word], frame: &Frame) -> LineResult<Position> {
        let mut target = in_turned_axes(&self.position, frame.rotation);
        for axis in 0..AXES {
            let Some(word) = block.axis(words, axis) else { continue };
            let value = word.value * frame.unit(axis);
            target[axis] =
                if frame.incremental { target[axis] + value } else { value + frame.offset[axis] };
            if target[axis].abs() >= LARGEST {
                let (at, end) = word.span();
                let message = "the position gets too large";
                return Err(Fault::new("gcode-number-range", at, end, message));
            }
        }
        Ok(target)
    }

    /// Refuses a move whose end, or whose path at feed, is not known on the axes to be corrected.
    fn check_known(
        &self,
        block: &Block,
        words: &[Word],
        target: &Position,
        whole_path: bool,
    ) -> LineResult<()> {
        let unknown = (0..AXES).find(|axis| {
            let needed = self.settings.axes.contains(*axis);
            needed && (target[*axis].is_nan() || (whole_path && self.position[*axis].is_nan()))
        });
        match unknown {
            None => Ok(()),
            Some(axis) => Err(self.unknown(block, words, axis, target[axis].is_nan())),
        }
    }

    fn unknown(&self, block: &Block, words: &[Word], axis: usize, end: bool) -> Box<Fault> {
        let word = block.axis(words, axis).or(block.first_axis(words)).or(block.motion_word(words));
        let (at, stop) = word.map_or((0, 0), Word::span);
        let letter = char::from(AXIS_LETTERS[axis]);
        let message = if end {
            format!("where {letter} ends is not known")
        } else {
            format!("where {letter} begins is not known, and this move is made at feed")
        };
        Fault::new("gcode-position-unknown", at, stop, message)
            .expected("a G0 to absolute coordinates of all axes before the first move at feed")
            .hint("or give the position in which the program starts (and that of G28 and G30) as a setting")
    }

    fn move_straight(
        &mut self,
        block: &Block,
        words: &[Word],
        code: Motion,
        machine: bool,
    ) -> LineResult<Action> {
        let kind = if code == Motion::Line { Kind::Line } else { Kind::Rapid };
        if kind == Kind::Line {
            self.check_feed(block, words)?;
        }
        let frame = self.frame(block, words, machine)?;
        let target = self.target(block, words, &frame)?;
        self.check_known(block, words, &target, kind == Kind::Line)?;
        let start = in_turned_axes(&self.position, frame.rotation);
        Ok(self.moved(Move::new(self.line, kind, start, target, None), frame, code, None))
    }

    /// `motion`: in the axes of the coordinate system.
    fn moved(
        &mut self,
        motion: Move,
        frame: Frame,
        code: Motion,
        reference: Option<Position>,
    ) -> Action {
        let stands =
            motion.arc.is_none() && (0..2).all(|axis| motion.start[axis] == motion.end[axis]);
        let mut motion = motion.in_turned_axes(-frame.rotation);
        // What does not move does not move by rounding either.
        motion.start = self.position;
        if stands {
            motion.end[..2].copy_from_slice(&self.position[..2]);
        }
        motion.speed = self.feed.speed(&motion, self.units);
        motion.path_mode = self.path_mode;
        self.position = motion.end;
        Action::Moves(Motions { motion, frame, code, feed: self.feed, reference })
    }

    fn go_to_reference(&mut self, block: &Block, words: &[Word], which: u8) -> LineResult<Action> {
        if let Some(word) = block.motion_word(words) {
            let (at, end) = word.span();
            let message = "G28 and G30 exclude a motion code in the same block";
            return Err(Fault::new("gcode-modal-group", at, end, message));
        }
        self.refuse_centre(block, words)?;
        if block.no_motion {
            self.motion = None;
        }
        let to = self.reference[usize::from(which)];
        if block.axes.0 == 0 {
            self.position = to;
            return Ok(Action::Reference { axes: AxisSet::ALL, to });
        }
        // G91 G28 Z0: from where the machine stands, wherever that is.
        let named = (0..AXES).filter(|axis| block.axes.contains(*axis));
        let stays = self.incremental
            && named
                .clone()
                .all(|axis| block.axis(words, axis).is_some_and(|word| word.value == 0.0));
        let action = if stays {
            Action::Reference { axes: block.axes, to }
        } else {
            let frame = self.frame(block, words, false)?;
            if frame.rotation != 0.0 {
                let (at, end) = block.once_word(words).unwrap_or(&words[0]).span();
                let message =
                    "G28 and G30 over a point of a turned coordinate system cannot be corrected";
                return Err(Fault::new("gcode-unsupported", at, end, message)
                    .hint("write a G0 to that point, and G91 G28 with zeros behind it"));
            }
            let end = self.target(block, words, &frame)?;
            self.check_known(block, words, &end, false)?;
            let start = self.position;
            let motion = Move::new(self.line, Kind::Rapid, start, end, None);
            self.moved(motion, frame, Motion::Rapid, Some(to))
        };
        for axis in named {
            self.position[axis] = to[axis];
        }
        Ok(action)
    }

    fn move_on_arc(&mut self, block: &Block, words: &[Word], code: Motion) -> LineResult<Action> {
        self.check_feed(block, words)?;
        let frame = self.frame(block, words, false)?;
        let target = self.target(block, words, &frame)?;
        self.check_known(block, words, &target, true)?;
        let plane = self.plane.axes();
        if frame.rotation != 0.0 && self.plane != Plane::Xy {
            let (at, end) =
                block.motion_word(words).or(block.first_axis(words)).map_or((0, 0), Word::span);
            let message =
                "an arc in another plane than that of X and Y, in a turned coordinate system";
            return Err(Fault::new("gcode-unsupported", at, end, message).hint("write it as lines"));
        }
        let start = in_turned_axes(&self.position, frame.rotation);
        for axis in plane {
            if self.position[axis].is_nan() || target[axis].is_nan() {
                return Err(self.unknown(block, words, axis, target[axis].is_nan()));
            }
        }
        let arc = self.arc(block, words, code, &frame, [&start, &target])?;
        let motion = Move::new(self.line, Kind::Arc, start, target, Some(arc));
        Ok(self.moved(motion, frame, code, None))
    }

    fn arc(
        &self,
        block: &Block,
        words: &[Word],
        code: Motion,
        frame: &Frame,
        [start, target]: [&Position; 2],
    ) -> LineResult<Arc> {
        let plane = self.plane.axes();
        let on_plane = |position: &Position| plane.map(|axis| position[axis]);
        for letter in *b"PR" {
            if let Some(word) = block.word(words, letter)
                && block.taken_elsewhere(letter)
            {
                return Err(block::shared(word));
            }
        }
        let arc = arc::Words {
            plane,
            start: on_plane(start),
            end: on_plane(target),
            clockwise: code == Motion::Clockwise,
            turns: turns(block, words)?,
            units: self.units.unwrap_or(Units::Millimetre),
        };
        for axis in (0..3).filter(|axis| !plane.contains(axis)) {
            if let Some(word) = block.word(words, b"IJK"[axis]) {
                let (at, end) = word.span();
                let message = format!(
                    "{} is no centre coordinate in the plane of {}",
                    char::from(word.letter),
                    self.plane.word()
                );
                return Err(Fault::new("gcode-unused-word", at, end, message));
            }
        }
        let centres = plane.map(|axis| block.word(words, b"IJK"[axis]));
        let radius = block.word(words, b'R');
        let place = centres[0].or(centres[1]).or(radius).or(block.motion_word(words));
        let place = place.or(block.first_axis(words)).map_or((0, 0), Word::span);
        let no_arc = |message: String| Fault::new("gcode-arc", place.0, place.1, message);
        let centre = match (radius, centres) {
            (Some(word), [None, None]) => {
                block::in_range(word)?;
                if !plane.iter().any(|axis| block.axes.contains(*axis)) {
                    let message = "an arc with R needs an end in its plane";
                    return Err(block::missing(Some(word), message));
                }
                arc.centre_of_radius(word.value * frame.scale).map_err(&no_arc)?
            }
            (Some(word), _) => {
                let (at, end) = word.span();
                let message = "an arc has a centre or a radius, not both";
                return Err(Fault::new("gcode-arc", at, end, message));
            }
            (None, [None, None]) => {
                let word = block.motion_word(words).or(block.first_axis(words));
                return Err(block::missing(word, "an arc needs its centre or its radius")
                    .expected("I J K, or R"));
            }
            (None, centres) => {
                let mut centre = [0.0; 2];
                for (index, word) in centres.into_iter().enumerate() {
                    let axis = plane[index];
                    centre[index] = match word {
                        Some(word) => {
                            block::in_range(word)?;
                            let from = if self.absolute_centres {
                                frame.offset[axis]
                            } else {
                                arc.start[index]
                            };
                            word.value * frame.scale + from
                        }
                        None if self.absolute_centres => {
                            let letter = char::from(b"IJK"[axis]);
                            let message = format!("in G90.1 an arc needs {letter} too");
                            return Err(block::missing(centres_word(centres), message));
                        }
                        None => arc.start[index],
                    };
                }
                centre
            }
        };
        arc.about(centre).map_err(no_arc)
    }

    /// Refuses words that only arcs take.
    fn refuse_centre(&self, block: &Block, words: &[Word]) -> LineResult<()> {
        for letter in *b"IJKPR" {
            if let Some(word) = block.word(words, letter)
                && !block.taken_elsewhere(letter)
            {
                return Err(block::unused(word));
            }
        }
        Ok(())
    }
}

fn centres_word(centres: [Option<&Word>; 2]) -> Option<&Word> {
    centres[0].or(centres[1])
}

fn has_centre(block: &Block, words: &[Word]) -> bool {
    b"IJK".iter().any(|letter| block.word(words, *letter).is_some())
        || (block.word(words, b'R').is_some() && !block.taken_elsewhere(b'R'))
}

fn dwell(block: &Block, words: &[Word]) -> LineResult<()> {
    match block.word(words, b'P') {
        None => Err(block::missing(block.once_word(words), "G4 needs a time, P")),
        Some(word) if word.value < 0.0 => Err(block::negative(word, "a time")),
        Some(_) => Ok(()),
    }
}

/// Most turns of one arc: a thread that is milled has some tens.
const MOST_TURNS: f64 = 1000.0;

fn turns(block: &Block, words: &[Word]) -> LineResult<i32> {
    let Some(word) = block.word(words, b'P') else { return Ok(1) };
    if word.value.fract() != 0.0 || !(1.0..=MOST_TURNS).contains(&word.value) {
        let (at, end) = word.span();
        let fault = Fault::new("gcode-bad-value", at, end, "this is no number of turns");
        return Err(fault.expected("a whole number from 1 to 1000"));
    }
    Ok(word.value as i32)
}
