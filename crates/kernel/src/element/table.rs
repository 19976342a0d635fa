//! What the rest of the software must know of an element: its keys, its parameters, how it is drawn.

/// What a number measures; the machine file's units follow from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// m.
    Length,
    /// rad.
    Angle,
    /// A vector of which only the direction counts.
    Direction,
    /// The drive's own joint coordinate: m or rad.
    Coordinate,
    /// No unit.
    Scale,
}

impl Dimension {
    /// The word that the machine file's model uses.
    pub fn name(self) -> &'static str {
        match self {
            Dimension::Length => "length",
            Dimension::Angle => "angle",
            Dimension::Direction => "direction",
            Dimension::Coordinate => "coordinate",
            Dimension::Scale => "scale",
        }
    }

    /// The SI unit of a parameter.
    pub fn unit(self) -> &'static str {
        match self {
            Dimension::Length | Dimension::Coordinate => "m",
            Dimension::Angle => "rad",
            Dimension::Direction | Dimension::Scale => "1",
        }
    }
}

/// One key of an element's table in the machine file.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The key.
    pub name: &'static str,
    /// 0: one number; 3: a vector.
    pub shape: usize,
    /// What it measures.
    pub dimension: Dimension,
    /// The value of every component where the key is missing; `None`: the key is required.
    pub default: Option<f64>,
    /// One line for the reader of the machine file.
    pub doc: &'static str,
}

impl Field {
    /// A required number.
    pub const fn number(name: &'static str, dimension: Dimension, doc: &'static str) -> Self {
        Field { name, shape: 0, dimension, default: None, doc }
    }

    /// A required point.
    pub const fn point(name: &'static str, doc: &'static str) -> Self {
        Field { name, shape: 3, dimension: Dimension::Length, default: None, doc }
    }

    /// A required direction.
    pub const fn direction(name: &'static str, doc: &'static str) -> Self {
        Field { name, shape: 3, dimension: Dimension::Direction, default: None, doc }
    }

    /// The same, of this value where the key is missing.
    pub const fn or(self, default: f64) -> Self {
        Field { default: Some(default), ..self }
    }
}

/// A number that the closure reads and that a deviation may move.
#[derive(Clone, Copy, Debug)]
pub struct ParameterField {
    /// The last part of the parameter's name, as in `origin.x`.
    pub name: &'static str,
    /// What it measures.
    pub dimension: Dimension,
}

pub const fn parameter(name: &'static str, dimension: Dimension) -> ParameterField {
    ParameterField { name, dimension }
}

/// The parameters of an element, in their order: `point "origin"` are its x, y and z, `tilt "axis"` the
/// angles u and v by which a direction is tilted, `(dimension) "name"` is one number.
macro_rules! parameters {
    (@ [$($done:expr,)*]) => { [$($done),*] };
    (@ [$($done:expr,)*] point $name:literal $($rest:tt)*) => {
        parameters!(@ [
            $($done,)*
            $crate::element::table::parameter(concat!($name, ".x"), $crate::element::Dimension::Length),
            $crate::element::table::parameter(concat!($name, ".y"), $crate::element::Dimension::Length),
            $crate::element::table::parameter(concat!($name, ".z"), $crate::element::Dimension::Length),
        ] $($rest)*)
    };
    (@ [$($done:expr,)*] tilt $name:literal $($rest:tt)*) => {
        parameters!(@ [
            $($done,)*
            $crate::element::table::parameter(concat!($name, ".u"), $crate::element::Dimension::Angle),
            $crate::element::table::parameter(concat!($name, ".v"), $crate::element::Dimension::Angle),
        ] $($rest)*)
    };
    (@ [$($done:expr,)*] ($dimension:expr) $name:literal $($rest:tt)*) => {
        parameters!(@ [$($done,)* $crate::element::table::parameter($name, $dimension),] $($rest)*)
    };
    ($kind:tt $($rest:tt)*) => { parameters!(@ [] $kind $($rest)*) };
}
pub(super) use parameters;

/// How an element is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// A straight guideway along the travel.
    Line,
    /// The circle on which the joint centre turns.
    Circle,
    /// Nothing beyond the strut itself.
    None,
}

impl Drawing {
    /// The word in the element table.
    pub fn name(self) -> &'static str {
        match self {
            Drawing::Line => "line",
            Drawing::Circle => "circle",
            Drawing::None => "none",
        }
    }
}

/// Everything the rest of the software needs to know of an element's kind.
#[derive(Clone, Copy, Debug)]
pub struct ElementTable {
    /// The word in the machine file.
    pub kind: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Whether it is the length of the strut that it carries, which then has none of its own.
    pub sets_length: bool,
    /// How it is drawn.
    pub drawing: Drawing,
    /// The keys it reads.
    pub fields: &'static [Field],
    /// The parameters it contributes.
    pub parameters: &'static [ParameterField],
    /// What its joint coordinate measures ([`Dimension::Length`] or [`Dimension::Angle`]).
    pub coordinate: Dimension,
}

impl ElementTable {
    /// What most elements have in common; each gives its own kind, doc, fields and parameters.
    pub const COMMON: ElementTable = ElementTable {
        kind: "",
        doc: "",
        sets_length: false,
        drawing: Drawing::None,
        fields: &[],
        parameters: &[],
        coordinate: Dimension::Length,
    };
}
