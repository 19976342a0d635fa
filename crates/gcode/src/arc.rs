//! Arcs from their words: centre or radius form, any plane, helices, several turns.

use std::f64::consts::TAU;

use crate::moves::Arc;
use crate::settings::Units;

/// What LinuxCNC tolerates, found by trying it: in inch programs other lengths than in millimetre
/// ones, not the same lengths converted.
struct Tolerances {
    /// Below this a radius is none; an R may be too short by as much, mm.
    radius: f64,
    /// Radii at start and end may differ by this, mm ...
    spiral: f64,
}

/// ... or by this share of the larger one, ...
const SPIRAL_SHARE: f64 = 0.001;

/// ... but never by more than this many times `spiral`.
const SPIRAL_MOST: f64 = 100.0;

/// An end within this angle of the start makes a full turn, rad.
const FULL_TURN: f64 = 1e-6;

/// A chord within this share of the diameter makes a half turn.
const HALF_TURN: f64 = 1e-12;

fn tolerances(units: Units) -> Tolerances {
    let spiral = 2.0 * std::f64::consts::SQRT_2;
    match units {
        Units::Millimetre => Tolerances { radius: 0.001_27, spiral: 0.01 * spiral },
        Units::Inch => Tolerances { radius: 0.000_05 * 25.4, spiral: 0.001 * spiral * 25.4 },
    }
}

/// What the words of an arc say: all on the two axes of its plane, mm.
pub struct Words {
    pub plane: [usize; 2],
    pub start: [f64; 2],
    pub end: [f64; 2],
    pub clockwise: bool,
    pub turns: i32,
    pub units: Units,
}

impl Words {
    /// The arc about a centre, or why there is none.
    pub fn about(&self, centre: [f64; 2]) -> Result<Arc, String> {
        let tolerances = tolerances(self.units);
        let from = [self.start[0] - centre[0], self.start[1] - centre[1]];
        let to = [self.end[0] - centre[0], self.end[1] - centre[1]];
        let (start_radius, end_radius) = (from[0].hypot(from[1]), to[0].hypot(to[1]));
        if !(start_radius >= tolerances.radius && end_radius >= tolerances.radius) {
            return Err(format!(
                "an arc of no radius: {start_radius:.6} mm at its start, {end_radius:.6} mm at its end"
            ));
        }
        let difference = (start_radius - end_radius).abs();
        let share = difference / start_radius.max(end_radius);
        if difference > SPIRAL_MOST * tolerances.spiral
            || (difference > tolerances.spiral && share > SPIRAL_SHARE)
        {
            return Err(format!(
                "the arc does not close: its radius is {start_radius:.6} mm at the start and {end_radius:.6} mm at the end"
            ));
        }
        let mut angle =
            (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
        if self.clockwise {
            angle = -angle;
        }
        if angle < FULL_TURN {
            angle += TAU;
        }
        angle += TAU * f64::from(self.turns - 1);
        let sign = if self.clockwise { -1 } else { 1 };
        Ok(Arc {
            plane: self.plane,
            centre,
            sweep: angle * f64::from(sign),
            turns: self.turns * sign,
            start_radius,
            end_radius,
        })
    }

    /// The centre of the arc of this radius; a negative one takes the longer way round.
    pub fn centre_of_radius(&self, radius: f64) -> Result<[f64; 2], String> {
        let chord = [self.end[0] - self.start[0], self.end[1] - self.start[1]];
        if chord == [0.0, 0.0] {
            return Err("an arc with R that ends where it starts".to_owned());
        }
        let half = chord[0].hypot(chord[1]) / 2.0;
        let size = radius.abs();
        if half > size + tolerances(self.units).radius {
            return Err(format!(
                "the arc's radius is too small: R is {size:.6} mm and half the way to its end {half:.6} mm"
            ));
        }
        let middle = [(self.start[0] + self.end[0]) / 2.0, (self.start[1] + self.end[1]) / 2.0];
        if half / size > 1.0 - HALF_TURN {
            return Ok(middle);
        }
        // The centre stands beside the chord: to its right for the shorter clockwise arc.
        let away = ((size - half) * (size + half)).sqrt() / (2.0 * half);
        let side = if self.clockwise == (radius > 0.0) { away } else { -away };
        Ok([middle[0] + side * chord[1], middle[1] - side * chord[0]])
    }
}
