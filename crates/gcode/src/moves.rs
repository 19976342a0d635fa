//! Moves and the points of their paths.

use crate::codes::PathMode;
use crate::settings::{AXES, Position, in_turned_axes};

/// How a move is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// G0, or the way to the intermediate point of G28 and G30.
    Rapid = 0,
    /// G1.
    Line = 1,
    /// G2, G3: an arc or a helix, also where the other axes go along.
    Arc = 2,
}

/// The circular part of a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The two axes of the plane, in the order that makes positive angles counterclockwise.
    pub plane: [usize; 2],
    /// Centre, on those two axes, mm.
    pub centre: [f64; 2],
    /// Angle from start to end, rad, counterclockwise positive, all turns included.
    pub sweep: f64,
    /// Turns begun, negative clockwise.
    pub turns: i32,
    /// Distance of the start from the centre, mm.
    pub start_radius: f64,
    /// Distance of the end from the centre, mm; between them the radius changes with the angle.
    pub end_radius: f64,
}

/// One move of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Line of the program, from 1 on.
    pub line: u64,
    /// How it is made.
    pub kind: Kind,
    /// Where it begins.
    pub start: Position,
    /// Where it ends.
    pub end: Position,
    /// The circle that it follows.
    pub arc: Option<Arc>,
    /// At which F asks the tool to go, in units of [`length`](Self::length) a second: infinite for a
    /// rapid, NaN where the program does not say it (G95).
    pub speed: f64,
    /// How the controller goes on behind it, if the program has said so.
    pub path_mode: Option<PathMode>,
}

/// A length below which axes do not move, mm or degrees: rounding of sums of program words.
const STANDSTILL: f64 = 1e-9;

impl Move {
    /// A move of which nobody has said how fast it is and how it goes on.
    pub(crate) fn new(
        line: u64,
        kind: Kind,
        start: Position,
        end: Position,
        arc: Option<Arc>,
    ) -> Self {
        Move { line, kind, start, end, arc, speed: f64::NAN, path_mode: None }
    }

    /// The same in axes that are turned about Z by so much, rad; its arc, if any, in the plane of X and Y.
    pub(crate) fn in_turned_axes(&self, angle: f64) -> Self {
        if angle == 0.0 {
            return self.clone();
        }
        let mut turned = self.clone();
        turned.start = in_turned_axes(&self.start, angle);
        turned.end = in_turned_axes(&self.end, angle);
        if let Some(arc) = &mut turned.arc {
            let mut centre = [0.0; AXES];
            centre[..2].copy_from_slice(&arc.centre);
            arc.centre.copy_from_slice(&in_turned_axes(&centre, angle)[..2]);
        }
        turned
    }

    /// The point at a share of the path, 0 at its start and 1 at its end.
    pub fn point(&self, share: f64) -> Position {
        if share >= 1.0 {
            return self.end;
        }
        if share <= 0.0 {
            return self.start;
        }
        let mut point = [0.0; AXES];
        for (axis, coordinate) in point.iter_mut().enumerate() {
            let (start, end) = (self.start[axis], self.end[axis]);
            *coordinate = if start == end { start } else { start + (end - start) * share };
        }
        if let Some(arc) = &self.arc {
            let [u, v] = arc.plane;
            let (sin, cos) = (arc.sweep * share).sin_cos();
            let radius = arc.start_radius + (arc.end_radius - arc.start_radius) * share;
            let from = [self.start[u] - arc.centre[0], self.start[v] - arc.centre[1]];
            let scale = radius / arc.start_radius;
            point[u] = arc.centre[0] + scale * (cos * from[0] - sin * from[1]);
            point[v] = arc.centre[1] + scale * (sin * from[0] + cos * from[1]);
        }
        point
    }

    /// Length of the path: in mm over X Y Z; where these stand still in mm over U V W; where those do
    /// too in degrees over A B C. What is not known does not count. It is what F refers to.
    pub fn length(&self) -> f64 {
        if let Some(arc) = &self.arc {
            let in_plane = arc.sweep * (arc.start_radius + arc.end_radius) / 2.0;
            let radial = arc.end_radius - arc.start_radius;
            let mut square = in_plane * in_plane + radial * radial;
            for axis in (0..3).filter(|axis| !arc.plane.contains(axis)) {
                square += self.square(axis);
            }
            return square.sqrt();
        }
        for axes in [0..3, 6..9, 3..6] {
            let length = self.distance(axes);
            if length > STANDSTILL {
                return length;
            }
        }
        0.0
    }

    /// Whether its length is one of A B C alone, in degrees.
    pub(crate) fn turns_only(&self) -> bool {
        self.arc.is_none() && [0..3, 6..9].into_iter().all(|axes| self.distance(axes) <= STANDSTILL)
    }

    fn distance(&self, axes: std::ops::Range<usize>) -> f64 {
        axes.map(|axis| self.square(axis)).sum::<f64>().sqrt()
    }

    /// Whether none of X Y Z moves: F then refers to other axes.
    pub fn stands_in_space(&self) -> bool {
        self.arc.is_none()
            && (0..3).map(|axis| self.square(axis)).sum::<f64>() <= STANDSTILL.powi(2)
    }

    fn square(&self, axis: usize) -> f64 {
        let difference = self.end[axis] - self.start[axis];
        if difference.is_nan() { 0.0 } else { difference * difference }
    }
}
