//! A limb as a chain of parts that give way: joints, guidances and beams, from the base to the platform.
//!
//! A chain adds no closure: it says what lies behind those of a strut, of guides, or of both, and how
//! stiff that is. [`crate::statics::chain_compliance`] makes a matrix of it.

use crate::linear::SIX;
use crate::spatial::Vector;

/// The most closures that a chain answers for: a strut and two guides, or the three of a tube.
pub const CHAIN_CLOSURES: usize = 3;

/// Between which two points a chain lies, from its base end to its platform end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// A strut's two joint centres.
    Strut(usize),
    /// A guide's point of the frame, and its point of the platform.
    Guide(usize),
}

/// In which axes a part gives way; unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axes {
    /// x along the limb from its base end, y across it, nearest to what [`Chain::side`] says.
    Limb,
    /// x and y of the base frame.
    Frame(Vector<f64>, Vector<f64>),
}

/// The direction across the limb that its y axis is nearest to; unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// Of the base frame.
    Frame(Vector<f64>),
    /// Of the platform.
    Platform(Vector<f64>),
}

/// Where a joint is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On the limb, where the part before it ends.
    InTurn,
    /// At the point that the strut's drive moves.
    Carriage,
}

/// What gives way.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A joint or a guidance: three displacements, m/N, and three turns, rad/(N m), in its axes.
    Joint {
        /// Where it is.
        place: Place,
        /// In which axes it gives way.
        axes: Axes,
        /// 0 is rigid; a direction in which the joint is free carries nothing and counts for nothing.
        compliance: [f64; SIX],
    },
    /// A prismatic beam along the limb.
    Beam {
        /// m; `None`: whatever the other beams leave of the limb.
        length: Option<f64>,
        /// What a metre of it gives way.
        section: Section,
    },
}

/// What a metre of a beam gives way, in the limb's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Section {
    /// 1 / (E A), 1/N.
    pub stretch: f64,
    /// Along y and z: 1 / (k G A), 1/N.
    pub shear: [f64; 2],
    /// 1 / (G J), 1/(N m^2).
    pub torsion: f64,
    /// About y and z: 1 / (E I), 1/(N m^2).
    pub bending: [f64; 2],
    /// Thermal expansion, 1/K.
    pub expansion: f64,
}

/// A limb, by indices into the machine.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Its name.
    pub name: String,
    /// Its ends.
    pub ends: Ends,
    /// Its closures, at most [`CHAIN_CLOSURES`].
    pub closures: Vec<usize>,
    /// For each of them the parameter that it gives way by: a strut's length, a guide's offset.
    pub parameters: Vec<usize>,
    /// Where its y axis is.
    pub side: Side,
    /// From the base to the platform.
    pub parts: Vec<Part>,
    /// Its mass, kg, spread evenly.
    pub mass: f64,
    /// Over which length, m, where its ends are a guide's: a tube goes on beyond the joint in which it slides.
    pub whole_length: f64,
    /// What the guidance of its carriage carries beside it, kg.
    pub carriage_mass: f64,
}

impl Chain {
    /// The places of its matrix, row by row of the upper triangle.
    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        let count = self.closures.len();
        (0..count).flat_map(move |i| (i..count).map(move |k| (i, k)))
    }
}
