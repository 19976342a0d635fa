//! Which G and M codes there are, and what each does to the state of the program.

use crate::settings::Units;

/// The meaning of a G code. Numbers are multiplied by ten: 911 is G91.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GCode {
    Motion(Motion),
    /// G80.
    NoMotion,
    Plane(Plane),
    Units(Units),
    /// G90 (false) or G91 (true).
    Incremental(bool),
    /// G91.1 (false) or G90.1 (true).
    AbsoluteCentres(bool),
    Feed(FeedMode),
    /// G54 ... G59.3 as 0 ... 8.
    Offset(u8),
    Dwell,
    /// G28 (0) or G30 (1).
    Reference(u8),
    /// G28.1 (0) or G30.1 (1).
    StoreReference(u8),
    MachineCoordinates,
    Path(PathMode),
    /// G96 (takes D and S) or G97.
    Spindle {
        surface_speed: bool,
    },
    /// G40.
    NoCutterCompensation,
    /// G49.
    NoToolLength,
    /// G98, G99.
    Retract,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    Rapid,
    Line,
    Clockwise,
    Counterclockwise,
}

impl Motion {
    pub fn is_arc(self) -> bool {
        matches!(self, Motion::Clockwise | Motion::Counterclockwise)
    }

    pub fn word(self) -> &'static [u8] {
        match self {
            Motion::Rapid => b"G0",
            Motion::Line => b"G1",
            Motion::Clockwise => b"G2",
            Motion::Counterclockwise => b"G3",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    Xy,
    Zx,
    Yz,
}

impl Plane {
    /// Its axes, in the order that makes positive angles counterclockwise seen from the third axis.
    pub fn axes(self) -> [usize; 2] {
        match self {
            Plane::Xy => [0, 1],
            Plane::Zx => [2, 0],
            Plane::Yz => [1, 2],
        }
    }

    pub fn word(self) -> &'static str {
        match self {
            Plane::Xy => "G17",
            Plane::Zx => "G18",
            Plane::Yz => "G19",
        }
    }
}

/// How a controller goes from one block into the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathMode {
    /// G61: through the end of every block, which it cannot do at speed round a corner.
    ExactPath,
    /// G61.1: it stops at the end of every block.
    ExactStop,
    /// G64, which takes P and Q: it cuts corners.
    Blending,
}

impl PathMode {
    /// Whether the tool stands still at the end of a block.
    pub fn stops(self) -> bool {
        self != PathMode::Blending
    }

    pub(crate) fn word(self) -> &'static [u8] {
        match self {
            PathMode::ExactPath => b"G61",
            PathMode::ExactStop => b"G61.1",
            PathMode::Blending => b"G64",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedMode {
    /// G93.
    InverseTime,
    /// G94.
    PerMinute,
    /// G95.
    PerRevolution,
}

impl GCode {
    /// Number of groups of codes that exclude each other.
    pub const GROUPS: usize = 14;

    /// The group of codes of which a block may have one.
    pub fn group(self) -> usize {
        match self {
            GCode::Dwell
            | GCode::Reference(_)
            | GCode::StoreReference(_)
            | GCode::MachineCoordinates => 0,
            GCode::Motion(_) => 1,
            GCode::NoMotion => 2,
            GCode::Plane(_) => 3,
            GCode::Units(_) => 4,
            GCode::Incremental(_) => 5,
            GCode::AbsoluteCentres(_) => 6,
            GCode::Feed(_) => 7,
            GCode::Offset(_) => 8,
            GCode::Path(_) => 9,
            GCode::Spindle { .. } => 10,
            GCode::NoCutterCompensation => 11,
            GCode::NoToolLength => 12,
            GCode::Retract => 13,
        }
    }
}

/// Code, message and hint for a code that is not taken.
pub type NotTaken = (&'static str, &'static str, &'static str);

const UNKNOWN: NotTaken = ("gcode-unknown-code", "this G code is not known", "");

const fn unsupported(message: &'static str, hint: &'static str) -> NotTaken {
    ("gcode-unsupported", message, hint)
}

/// The G code of this number.
pub fn g_code(value: f64) -> Result<GCode, NotTaken> {
    let tenfold = value * 10.0;
    let number = tenfold.round();
    if (tenfold - number).abs() > 1e-9 || !(0.0..=9999.0).contains(&number) {
        return Err(UNKNOWN);
    }
    Ok(match number as u16 {
        0 => GCode::Motion(Motion::Rapid),
        10 => GCode::Motion(Motion::Line),
        20 => GCode::Motion(Motion::Clockwise),
        30 => GCode::Motion(Motion::Counterclockwise),
        40 => GCode::Dwell,
        170 => GCode::Plane(Plane::Xy),
        180 => GCode::Plane(Plane::Zx),
        190 => GCode::Plane(Plane::Yz),
        200 => GCode::Units(Units::Inch),
        210 => GCode::Units(Units::Millimetre),
        280 => GCode::Reference(0),
        281 => GCode::StoreReference(0),
        300 => GCode::Reference(1),
        301 => GCode::StoreReference(1),
        400 => GCode::NoCutterCompensation,
        490 => GCode::NoToolLength,
        530 => GCode::MachineCoordinates,
        number @ (540 | 550 | 560 | 570 | 580 | 590) => GCode::Offset((number / 10 - 54) as u8),
        number @ (591..=593) => GCode::Offset((number - 591 + 6) as u8),
        610 => GCode::Path(PathMode::ExactPath),
        611 => GCode::Path(PathMode::ExactStop),
        640 => GCode::Path(PathMode::Blending),
        800 => GCode::NoMotion,
        900 => GCode::Incremental(false),
        910 => GCode::Incremental(true),
        901 => GCode::AbsoluteCentres(true),
        911 => GCode::AbsoluteCentres(false),
        930 => GCode::Feed(FeedMode::InverseTime),
        940 => GCode::Feed(FeedMode::PerMinute),
        950 => GCode::Feed(FeedMode::PerRevolution),
        960 => GCode::Spindle { surface_speed: true },
        970 => GCode::Spindle { surface_speed: false },
        980 | 990 => GCode::Retract,
        50..=53 => {
            return Err(unsupported(
                "splines (G5, G5.1, G5.2, G5.3) cannot be corrected exactly",
                "let the CAM system write arcs or lines",
            ));
        }
        70 | 80 => {
            return Err(unsupported(
                "lathe modes (G7, G8) cannot be corrected",
                "leave G8 out, or write X as a radius without G7",
            ));
        }
        100 => {
            return Err(unsupported(
                "G10 changes offsets or the tool table while the program runs",
                "set the offsets beforehand and give them as settings",
            ));
        }
        171 | 181 | 191 => {
            return Err(unsupported(
                "arcs in the planes of U V W cannot be corrected",
                "use G17, G18 or G19",
            ));
        }
        330 | 331 => {
            return Err(unsupported(
                "moves synchronised with the spindle (G33, G33.1) cannot be divided exactly",
                "correct the rest of the program apart from them",
            ));
        }
        382..=385 => {
            return Err(unsupported(
                "probing (G38) ends where the probe touches, which no program says",
                "probe in a program of its own",
            ));
        }
        410..=422 => {
            return Err(unsupported(
                "cutter compensation (G41, G42) moves the path by the tool's radius",
                "let the CAM system compensate, and write G40",
            ));
        }
        430..=432 => {
            return Err(unsupported(
                "tool length compensation (G43) moves the path by an offset of the tool table",
                "give the tool's length in the machine file, or in the coordinate system's offset, and write G49",
            ));
        }
        520 | 920..=923 => {
            return Err(unsupported(
                "G52 and G92 shift the coordinate system while the program runs",
                "use one of G54 to G59.3 and give its offset as a setting",
            ));
        }
        700..=729 => {
            return Err(unsupported(
                "lathe cycles cannot be corrected",
                "write the cycle out as plain moves",
            ));
        }
        730 | 740 | 760 | 810..=890 => {
            return Err(unsupported(
                "canned cycles are not written out",
                "let the CAM system write the cycle out as plain moves (drilling without cycles)",
            ));
        }
        _ => return Err(UNKNOWN),
    })
}

/// What matters of an M code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MCode {
    /// Of which a block may have one.
    pub group: u8,
    /// The program stops or ends behind the block's move.
    pub stops: bool,
    /// It acts before the block's move: of a block that is divided it goes in front of all pieces.
    pub precedes: bool,
    /// The program ends.
    pub ends: bool,
    /// Letters that it may use.
    pub letters: &'static [u8],
    /// Letters of which it needs one.
    pub needs: &'static [u8],
}

/// Group of M6 and M61.
pub const TOOL: u8 = 6;

/// Group of M3, M4, M5 and M19.
pub const SPINDLE: u8 = 7;

/// Most M codes in one block.
pub const MOST_M_CODES: usize = 4;

/// The M code of this number.
pub fn m_code(value: f64) -> Result<MCode, NotTaken> {
    let code = |group, letters, needs| MCode {
        group,
        stops: false,
        ends: false,
        precedes: true,
        letters,
        needs,
    };
    if value.fract() != 0.0 || !(0.0..=199.0).contains(&value) {
        return Err(("gcode-unknown-code", "this M code is not known", ""));
    }
    Ok(match value as u8 {
        0 | 1 | 60 => MCode { stops: true, precedes: false, ..code(4, b"", b"") },
        2 | 30 => MCode { stops: true, ends: true, precedes: false, ..code(4, b"", b"") },
        3..=5 => code(SPINDLE, b"$", b""),
        6 => code(TOOL, b"", b""),
        7..=9 => code(8, b"", b""),
        19 => code(SPINDLE, b"RQP$", b"R"),
        48 | 49 => code(9, b"", b""),
        51 => code(9, b"P$", b""),
        50 | 52 | 53 => code(9, b"P", b""),
        61 => code(TOOL, b"Q", b"Q"),
        62 | 63 => MCode { precedes: false, ..code(5, b"P", b"P") },
        64 | 65 => code(5, b"P", b"P"),
        66 => code(5, b"PELQ", b"PE"),
        67 => MCode { precedes: false, ..code(5, b"EQ", b"E") },
        68 => code(5, b"EQ", b"E"),
        100..=199 => code(10, b"PQ", b""),
        70..=73 => {
            return Err(unsupported(
                "saving and restoring the modal state (M70 to M73) is not followed",
                "write the modal codes out where the state is restored",
            ));
        }
        98 | 99 => {
            return Err((
                "gcode-flow",
                "subprograms (M98, M99) are not followed",
                "write the program out as plain blocks",
            ));
        }
        _ => return Err(("gcode-unknown-code", "this M code is not known", "")),
    })
}
