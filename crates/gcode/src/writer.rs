//! One block rewritten: in place where that is possible, else in several lines.

use crate::block::{Block, LARGEST};
use crate::codes::{FeedMode, Motion, PathMode};
use crate::interpreter::Motions;
use crate::lexer::Word;
use crate::moves::Kind;
use crate::number::Decimal;
use crate::refusal::{Fault, LineResult};
use crate::settings::{AXES, AXIS_LETTERS, AxisSet, Position, in_turned_axes, is_rotary};
use crate::written_lines::{
    Source, check_lengths, own_line, preceding_line, remove_blanks, separate, without_end,
};

/// Decimals that coordinates are written with, at most 9.
#[derive(Clone, Copy, Debug)]
pub struct Digits {
    /// Of lengths in millimetres.
    pub millimetre: u32,
    /// Of lengths in inches.
    pub inch: u32,
    /// Of angles in degrees.
    pub degree: u32,
}

impl Default for Digits {
    fn default() -> Self {
        Digits { millimetre: 6, inch: 7, degree: 6 }
    }
}

/// Decimals of feed rates.
const FEED_DIGITS: u32 = 9;

/// A difference beyond half the last decimal, and beyond the rounding of computing it, counts.
const HALF: f64 = 0.5 + 1e-6;

/// The state that the written program leaves a controller in.
pub struct Writer {
    position: Position,
    motion: Option<Motion>,
    corrected: AxisSet,
    digits: Digits,
    /// The block that stands in front of pieces between which the controller is not to stop.
    blending: Option<Vec<u8>>,
}

/// How one block becomes lines.
struct Plan {
    /// Axes that get numbers of ours in every piece where they change.
    replaced: AxisSet,
    /// Axes that the block itself names.
    named: AxisSet,
    /// The motion code that the pieces need.
    motion: Motion,
    /// G0 or G1 has to be put in front, because the written program is in another mode.
    restore: bool,
    /// G28 or G30 gets a line of its own behind the pieces.
    apart: bool,
    /// F of a whole path in one, per minute, where every piece gets its own F.
    time_rate: Option<f64>,
    /// G93 is put in front and G94 with this F behind.
    back_to: Option<f64>,
    /// More than one line is written.
    lines: bool,
    /// Pieces are blended, and this mode is put in front of the last.
    exact: Option<PathMode>,
    /// Words are set apart by blanks.
    spaced: bool,
}

impl Writer {
    pub fn new(start: Position, corrected: AxisSet, digits: Digits) -> Self {
        Writer { position: start, motion: None, corrected, digits, blending: None }
    }

    /// Pieces of a block that ends in an exact stop are blended as this block says, all but the last.
    pub fn blend_pieces(&mut self, block: &str) {
        self.blending = Some(block.as_bytes().to_vec());
    }

    /// Text went out untouched: it may have set a motion code or taken axes somewhere.
    pub fn passed(&mut self, motion: Option<Option<Motion>>, placed: AxisSet, at: &Position) {
        if let Some(motion) = motion {
            self.motion = motion;
        }
        for axis in (0..AXES).filter(|axis| placed.contains(*axis)) {
            self.position[axis] = at[axis];
        }
    }

    /// Writes the block as pieces that end at `points`, machine coordinates.
    pub fn write(
        &mut self,
        source: &Source<'_>,
        points: &[Position],
        shares: &[f64],
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        let rotation = source.motions.frame.rotation;
        if rotation == 0.0 {
            return self.write_in_axes(source, points, shares, out);
        }
        // In the axes in which the numbers are written, X and Y are each a word again.
        let mut motions = source.motions.clone();
        motions.motion = motions.motion.in_turned_axes(rotation);
        let turned: Vec<_> = points.iter().map(|point| in_turned_axes(point, rotation)).collect();
        self.position = in_turned_axes(&self.position, rotation);
        let source = Source { motions: &motions, ..*source };
        let result = self.write_in_axes(&source, &turned, shares, out);
        self.position = in_turned_axes(&self.position, -rotation);
        result
    }

    fn write_in_axes(
        &mut self,
        source: &Source<'_>,
        points: &[Position],
        shares: &[f64],
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        check_shares(source, shares)?;
        let plan = self.plan(source, points)?;
        let Some(plan) = plan else {
            out.extend_from_slice(source.line);
            self.follow(source, AxisSet(0));
            return Ok(());
        };
        let newline: &[u8] = match source.line {
            [.., b'\r', b'\n'] => b"\r\n",
            _ => b"\n",
        };
        let last = if source.line.ends_with(b"\n") { newline } else { b"" };
        let begin = out.len();
        if plan.lines {
            preceding_line(source, plan.spaced, newline, out);
        }
        if let (Some(block), Some(_)) = (&self.blending, plan.exact) {
            own_line(source, block, newline, out);
        }
        let mut before = 0.0;
        for (piece, (point, share)) in points.iter().zip(shares).enumerate() {
            let feed = plan.time_rate.map(|rate| rate / (share - before));
            before = *share;
            let target = self.target(source, &plan, point, *share);
            if piece == 0 {
                self.first_line(source, &plan, &target, feed, out)?;
            } else {
                out.extend_from_slice(newline);
                if let (Some(mode), true) = (plan.exact, piece + 1 == points.len()) {
                    own_line(source, mode.word(), newline, out);
                }
                self.further_line(source, &plan, &target, feed, out)?;
            }
        }
        if plan.apart {
            out.extend_from_slice(newline);
            self.reference_line(source, &plan, out)?;
        }
        if let Some(rate) = plan.back_to {
            out.extend_from_slice(newline);
            out.extend_from_slice(b"G94 F");
            feed_rate(source, rate)?.write(out);
        }
        if plan.lines {
            for word in source.words.iter().filter(|word| Block::stops(word)) {
                let (at, end) = word.span();
                separate(plan.spaced, out);
                out.extend_from_slice(&source.line[at..end]);
            }
        }
        check_lengths(&out[begin..])?;
        out.extend_from_slice(last);
        self.motion = if source.motions.reference.is_none() || plan.apart {
            Some(plan.motion)
        } else {
            self.motion
        };
        self.follow(source, plan.replaced);
        Ok(())
    }

    /// Where the controller stands after the block, on axes whose words were left as they were, and on
    /// those that G28 or G30 took away.
    fn follow(&mut self, source: &Source<'_>, replaced: AxisSet) {
        let Motions { motion, frame, reference, .. } = source.motions;
        let named = named_axes(source.words);
        for axis in (0..AXES).filter(|axis| named.contains(*axis)) {
            if let Some(reference) = reference {
                self.position[axis] = reference[axis];
            } else if !replaced.contains(axis) {
                self.position[axis] =
                    self.predicted(source, axis, frame.incremental, motion.end[axis]);
            }
        }
        if reference.is_none() && replaced.0 == 0 {
            self.motion = Some(source.motions.code);
        }
    }

    /// Where the axis' own word would take the controller.
    fn predicted(&self, source: &Source<'_>, axis: usize, incremental: bool, end: f64) -> f64 {
        if incremental {
            let value = word_of(source.words, AXIS_LETTERS[axis]).map_or(0.0, |word| word.value);
            self.position[axis] + value * source.motions.frame.unit(axis)
        } else {
            end
        }
    }

    /// How the block has to be changed; `None` where it can stay as it is.
    fn plan(&self, source: &Source<'_>, points: &[Position]) -> LineResult<Option<Plan>> {
        let Motions { motion, frame, code, feed, reference } = source.motions;
        let named = named_axes(source.words);
        let arc = motion.kind == Kind::Arc;
        let divided = points.len() > 1;
        let needed = if arc { Motion::Line } else { *code };
        let own = source.words.iter().any(is_motion);
        let restore = reference.is_none() && !own && self.motion != Some(needed);
        let mut replaced = AxisSet(self.corrected.0);
        let (mut moved, mut added) = (false, false);
        for axis in 0..AXES {
            if self.corrected.contains(axis) {
                let target = points[points.len() - 1][axis];
                let stays = if named.contains(axis) {
                    self.predicted(source, axis, frame.incremental, motion.end[axis])
                } else {
                    self.position[axis]
                };
                moved |= self.differs(source, axis, stays, target);
                added |= !named.contains(axis)
                    && points
                        .iter()
                        .any(|p| self.differs(source, axis, self.position[axis], p[axis]));
            } else if named.contains(axis) && (divided || arc) && !motion.start[axis].is_nan() {
                replaced.insert(axis);
            }
        }
        for axis in motion.arc.iter().flat_map(|arc| arc.plane) {
            replaced.insert(axis);
        }
        // Where the program moves nothing in X Y Z, but the correction does, F would be read as the
        // speed of that: then the time is written instead.
        let retimed = motion.kind == Kind::Line
            && feed.mode != FeedMode::InverseTime
            && motion.stands_in_space()
            && motion.length() > 0.0
            && (0..3).any(|axis| {
                replaced.contains(axis)
                    && points
                        .iter()
                        .any(|p| self.differs(source, axis, self.position[axis], p[axis]))
            });
        if !divided && !arc && !restore && !moved {
            return Ok(None);
        }
        let apart = reference.is_some() && (divided || added);
        let back_to = if retimed { Some(self.rate_in_minutes(source)?) } else { None };
        let time_rate = match (back_to, feed.mode, feed.rate) {
            (Some(rate), ..) => Some(rate / motion.length()),
            (None, FeedMode::InverseTime, Some(rate)) if divided && needed == Motion::Line => {
                Some(rate)
            }
            _ => None,
        };
        let anchor = source.words.iter().rfind(|word| AXIS_LETTERS.contains(&word.letter));
        let spaced = anchor.is_none_or(|word| {
            word.at == 0 || matches!(source.line[usize::from(word.at) - 1], b' ' | b'\t')
        });
        let lines = divided || apart || retimed;
        let plan = Plan {
            exact: motion
                .path_mode
                .filter(|mode| divided && mode.stops() && self.blending.is_some()),
            replaced,
            named,
            motion: needed,
            restore,
            apart,
            time_rate,
            back_to,
            lines,
            spaced,
        };
        Ok(Some(plan))
    }

    /// F of a move that turns only, as a number of its path's units a minute.
    fn rate_in_minutes(&self, source: &Source<'_>) -> LineResult<f64> {
        let feed = source.motions.feed;
        let cannot = |message: &str| {
            Err(fault_of(source, "gcode-division", message.to_owned())
                .hint("write F of this block in G93 (inverse time)"))
        };
        if feed.mode == FeedMode::PerRevolution {
            return cannot(
                "a move of other axes than X Y Z in G95, whose correction moves these too",
            );
        }
        let units = feed.units.map(crate::settings::Units::millimetres);
        if units != Some(source.motions.frame.scale) {
            return cannot("F of this move was given in other units than those that hold now");
        }
        Ok(feed.rate.unwrap_or(f64::NAN))
    }

    /// Whether the axis is to be written because its target is not where it would stand.
    fn differs(&self, source: &Source<'_>, axis: usize, stands: f64, target: f64) -> bool {
        !((target - stands).abs() <= HALF * self.step(source, axis))
    }

    /// The last decimal of the axis, mm or degrees.
    fn step(&self, source: &Source<'_>, axis: usize) -> f64 {
        let frame = &source.motions.frame;
        let unit = if is_rotary(axis) || !frame.scale.is_nan() { frame.unit(axis) } else { 1.0 };
        unit * 0.1_f64.powi(self.digits_of(source, axis) as i32)
    }

    fn digits_of(&self, source: &Source<'_>, axis: usize) -> u32 {
        if is_rotary(axis) {
            self.digits.degree
        } else if source.motions.frame.scale == 25.4 {
            self.digits.inch
        } else {
            self.digits.millimetre
        }
    }

    /// Where a piece ends: corrected axes at its point, others on the programmed path.
    fn target(&self, source: &Source<'_>, plan: &Plan, point: &Position, share: f64) -> Position {
        let mut target = source.motions.motion.point(share);
        for axis in (0..AXES).filter(|axis| self.corrected.contains(*axis)) {
            target[axis] = point[axis];
        }
        // An axis whose start is not known goes all its way in the first piece.
        for axis in (0..AXES).filter(|axis| !plan.replaced.contains(*axis)) {
            target[axis] = self.position[axis];
        }
        target
    }

    /// Writes the number that takes the axis to the target, and stands there then.
    fn number(
        &mut self,
        source: &Source<'_>,
        axis: usize,
        target: f64,
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        let frame = &source.motions.frame;
        if frame.scale.is_nan() && !is_rotary(axis) {
            let letter = char::from(AXIS_LETTERS[axis]);
            let message = format!(
                "the corrected {letter} of this block cannot be written: nothing has said in what units"
            );
            return Err(fault_of(source, "gcode-no-units", message).expected("G20 or G21 before"));
        }
        let unit = frame.unit(axis);
        let from = if frame.incremental { self.position[axis] } else { frame.offset[axis] };
        let value = (target - from) / unit;
        let decimal =
            Decimal::nearest(value.clamp(-LARGEST, LARGEST), self.digits_of(source, axis));
        let position = decimal.value() * unit + from;
        if !(value.abs() < LARGEST && position.abs() < LARGEST) {
            let letter = char::from(AXIS_LETTERS[axis]);
            let message =
                format!("the corrected {letter} of this block is no number, or too large");
            return Err(fault_of(source, "gcode-division", message));
        }
        decimal.write(out);
        self.position[axis] = position;
        Ok(())
    }

    /// The block itself with the first piece's numbers.
    fn first_line(
        &mut self,
        source: &Source<'_>,
        plan: &Plan,
        target: &Position,
        feed: Option<f64>,
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        let arc = source.motions.motion.kind == Kind::Arc;
        let body = without_end(source.line);
        let begin = out.len();
        let mut copied = 0;
        let is_centre = |word: &Word| arc && b"IJKR".contains(&word.letter);
        let is_axis = |word: &Word| AXIS_LETTERS.contains(&word.letter);
        let words = source.words;
        let front = words.iter().position(|word| is_axis(word) || is_centre(word)).unwrap_or(0);
        let anchor = words.iter().rposition(is_axis).unwrap_or(front);
        let has_feed = words.iter().any(|word| word.letter == b'F');
        for (index, word) in words.iter().enumerate() {
            let (at, end) = word.span();
            out.extend_from_slice(&body[copied..at]);
            copied = end;
            if index == front {
                let mut put = |code: &[u8]| {
                    out.extend_from_slice(code);
                    separate(plan.spaced, out);
                };
                if plan.back_to.is_some() {
                    put(b"G93");
                }
                if plan.restore {
                    put(plan.motion.word());
                }
            }
            let axis = AXIS_LETTERS.iter().position(|letter| *letter == word.letter);
            match (axis, word.letter) {
                (Some(axis), _) if plan.replaced.contains(axis) => {
                    out.extend_from_slice(&body[at..usize::from(word.number)]);
                    self.number(source, axis, target[axis], out)?;
                }
                (None, b'F') if feed.is_some() => {
                    out.extend_from_slice(&body[at..usize::from(word.number)]);
                    feed_rate(source, feed.unwrap_or(f64::NAN))?.write(out);
                }
                (None, b'G') if arc && is_motion(word) => out.extend_from_slice(b"G1"),
                (None, b'G') if plan.apart && matches!(word.value, 28.0 | 30.0) => {
                    out.extend_from_slice(b"G0");
                }
                (None, b'I' | b'J' | b'K' | b'R') if arc => remove_blanks(begin, out),
                // Turns, unless another code of the block takes the word: then it was refused.
                (None, b'P') if arc => remove_blanks(begin, out),
                (None, b'G') if plan.exact.is_some() && Block::is_path_mode(word) => {
                    remove_blanks(begin, out)
                }
                (None, b'M') if plan.lines && Block::stops(word) => remove_blanks(begin, out),
                (None, _) if plan.lines && Block::precedes(word, words) => {
                    remove_blanks(begin, out)
                }
                _ => out.extend_from_slice(&body[at..end]),
            }
            if index == anchor {
                let mut wanted = plan.named.0 & plan.replaced.0 != 0;
                for axis in (0..AXES).filter(|axis| plan.adds(*axis)) {
                    if self.differs(source, axis, self.position[axis], target[axis]) {
                        self.add_axis(source, plan, axis, target[axis], begin, out)?;
                        wanted = true;
                    }
                }
                if !wanted && let Some(axis) = (0..AXES).find(|axis| plan.adds(*axis)) {
                    self.add_axis(source, plan, axis, target[axis], begin, out)?;
                }
                if let (Some(feed), false) = (feed, has_feed) {
                    separate(plan.spaced, out);
                    out.push(b'F');
                    feed_rate(source, feed)?.write(out);
                }
            }
        }
        out.extend_from_slice(&body[copied..]);
        Ok(())
    }

    /// A word of an axis, apart from what has been written since `begin`.
    fn add_axis(
        &mut self,
        source: &Source<'_>,
        plan: &Plan,
        axis: usize,
        target: f64,
        begin: usize,
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        if out.len() > begin && !out.ends_with(b" ") {
            separate(plan.spaced, out);
        }
        out.push(AXIS_LETTERS[axis]);
        self.number(source, axis, target, out)
    }

    /// A line for a piece after the first: just where it goes.
    fn further_line(
        &mut self,
        source: &Source<'_>,
        plan: &Plan,
        target: &Position,
        feed: Option<f64>,
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        if source.deletable {
            out.push(b'/');
        }
        let begin = out.len();
        if source.motions.frame.machine {
            out.extend_from_slice(b"G53");
        }
        let mut any = false;
        for axis in (0..AXES).filter(|axis| plan.replaced.contains(*axis)) {
            if self.differs(source, axis, self.position[axis], target[axis]) {
                self.add_axis(source, plan, axis, target[axis], begin, out)?;
                any = true;
            }
        }
        if !any && let Some(axis) = (0..AXES).find(|axis| plan.replaced.contains(*axis)) {
            self.add_axis(source, plan, axis, target[axis], begin, out)?;
        }
        if let Some(feed) = feed {
            separate(plan.spaced, out);
            out.push(b'F');
            feed_rate(source, feed)?.write(out);
        }
        Ok(())
    }

    /// G28 or G30 from where the pieces have led.
    fn reference_line(
        &mut self,
        source: &Source<'_>,
        plan: &Plan,
        out: &mut Vec<u8>,
    ) -> LineResult<()> {
        if source.deletable {
            out.push(b'/');
        }
        let code = source
            .words
            .iter()
            .find(|word| word.letter == b'G' && matches!(word.value, 28.0 | 30.0));
        out.extend_from_slice(if code.is_some_and(|word| word.value == 30.0) {
            b"G30"
        } else {
            b"G28"
        });
        for axis in (0..AXES).filter(|axis| plan.named.contains(*axis)) {
            separate(plan.spaced, out);
            out.push(AXIS_LETTERS[axis]);
            let stands = self.position[axis];
            if source.motions.frame.incremental || stands.is_nan() {
                out.push(b'0');
            } else {
                self.number(source, axis, stands, out)?;
            }
        }
        Ok(())
    }
}

impl Plan {
    fn adds(&self, axis: usize) -> bool {
        self.replaced.contains(axis) && !self.named.contains(axis)
    }
}

fn named_axes(words: &[Word]) -> AxisSet {
    let mut named = AxisSet::default();
    for word in words {
        if let Some(axis) = AXIS_LETTERS.iter().position(|letter| *letter == word.letter) {
            named.insert(axis);
        }
    }
    named
}

fn word_of(words: &[Word], letter: u8) -> Option<&Word> {
    words.iter().find(|word| word.letter == letter)
}

fn is_motion(word: &Word) -> bool {
    word.letter == b'G' && matches!(word.value, 0.0 | 1.0 | 2.0 | 3.0)
}

fn fault_of(source: &Source<'_>, code: &'static str, message: String) -> Box<Fault> {
    let word = source.words.iter().find(|word| AXIS_LETTERS.contains(&word.letter));
    let (at, end) = word.or(source.words.first()).map_or((0, 0), Word::span);
    Fault::new(code, at, end, message)
}

fn feed_rate(source: &Source<'_>, rate: f64) -> LineResult<Decimal> {
    if rate > 0.0 && rate < LARGEST {
        return Ok(Decimal::nearest(rate, FEED_DIGITS));
    }
    let message =
        "a piece of this block is so short that its feed rate cannot be written".to_owned();
    Err(fault_of(source, "gcode-division", message))
}

fn check_shares(source: &Source<'_>, shares: &[f64]) -> LineResult<()> {
    let rising = shares.windows(2).all(|pair| pair[0] < pair[1]);
    if rising && shares.first().is_some_and(|first| *first > 0.0) && shares.last() == Some(&1.0) {
        return Ok(());
    }
    let message = "the shares of this block's pieces do not rise from above 0 to 1".to_owned();
    Err(fault_of(source, "gcode-division", message))
}
