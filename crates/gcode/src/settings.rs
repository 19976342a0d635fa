//! What a program does not say itself: where the machine stands, offsets, units.

/// Number of axes.
pub const AXES: usize = 9;

/// The axes' letters, in their order.
pub const AXIS_LETTERS: [u8; AXES] = *b"XYZABCUVW";

/// Coordinates of all axes: mm for X Y Z U V W, degrees for A B C; NaN where not known.
pub type Position = [f64; AXES];

/// A position of which nothing is known.
pub const UNKNOWN: Position = [f64::NAN; AXES];

/// Whether the axis turns.
pub fn is_rotary(axis: usize) -> bool {
    (3..6).contains(&axis)
}

/// A set of axes, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct AxisSet(pub u16);

impl AxisSet {
    /// All axes.
    pub const ALL: AxisSet = AxisSet((1 << AXES) - 1);

    /// The axes with these letters; `None` where one is no axis or comes twice.
    pub fn from_letters(letters: &str) -> Option<Self> {
        let mut set = AxisSet(0);
        for letter in letters.bytes() {
            let axis = AXIS_LETTERS.iter().position(|a| *a == letter.to_ascii_uppercase())?;
            if set.contains(axis) {
                return None;
            }
            set.insert(axis);
        }
        Some(set)
    }

    /// Whether the axis is in it.
    pub fn contains(self, axis: usize) -> bool {
        self.0 & (1 << axis) != 0
    }

    /// Adds the axis.
    pub fn insert(&mut self, axis: usize) {
        self.0 |= 1 << axis;
    }
}

/// Unit of lengths in a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// G21.
    Millimetre,
    /// G20.
    Inch,
}

impl Units {
    /// Millimetres in one.
    pub fn millimetres(self) -> f64 {
        match self {
            Units::Millimetre => 1.0,
            Units::Inch => 25.4,
        }
    }
}

/// Where a coordinate system stands in machine coordinates: what G54 to G59.3 stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkOffset {
    /// Of its zero.
    pub origin: Position,
    /// By which it is turned about Z, rad: X and Y of a program, then the origin.
    pub rotation: f64,
}

impl WorkOffset {
    /// Machine coordinates themselves.
    pub const NONE: WorkOffset = WorkOffset { origin: [0.0; AXES], rotation: 0.0 };
}

/// The position in axes that are turned about Z by so much: its X and Y there.
pub fn in_turned_axes(position: &Position, angle: f64) -> Position {
    let mut turned = *position;
    if angle != 0.0 {
        let (sin, cos) = angle.sin_cos();
        turned[0] = cos * position[0] + sin * position[1];
        turned[1] = cos * position[1] - sin * position[0];
    }
    turned
}

/// What holds before a program's first line, and what the controller has stored.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Units before G20 or G21; without them the first length is refused.
    pub units: Option<Units>,
    /// Where the machine stands.
    pub start: Position,
    /// Offsets of G54 ... G59, G59.1 ... G59.3, as far as known: a program that selects another is refused.
    pub offsets: [Option<WorkOffset>; 9],
    /// Which of them is active at first; where its offset is not known, machine coordinates hold.
    pub system: usize,
    /// Where G28 and G30 go, as far as known.
    pub reference: [Position; 2],
    /// Whether lines that begin with / are left out; without it they are refused.
    pub block_delete: Option<bool>,
    /// The axes that must be known wherever something moves: those that are to be corrected.
    pub axes: AxisSet,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            units: None,
            start: UNKNOWN,
            offsets: [None; 9],
            system: 0,
            reference: [UNKNOWN; 2],
            block_delete: None,
            axes: AxisSet(0b111),
        }
    }
}
