//! How fast a program asks the tool to go.

use crate::codes::FeedMode;
use crate::moves::{Kind, Move};
use crate::settings::Units;

const SECONDS_OF_MINUTE: f64 = 60.0;

/// The feed at which a block moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feed {
    pub mode: FeedMode,
    /// F as it was given last, in the units then.
    pub rate: Option<f64>,
    /// Units when it was given.
    pub units: Option<Units>,
}

impl Feed {
    /// Along the move, in units of its length a second; `units` are those of the program now.
    pub fn speed(&self, motion: &Move, units: Option<Units>) -> f64 {
        if motion.kind == Kind::Rapid {
            return f64::INFINITY;
        }
        let rate = self.rate.unwrap_or(f64::NAN) / SECONDS_OF_MINUTE;
        match self.mode {
            FeedMode::InverseTime => rate * motion.length(),
            FeedMode::PerMinute if motion.turns_only() => rate,
            FeedMode::PerMinute => rate * self.units.or(units).map_or(f64::NAN, Units::millimetres),
            FeedMode::PerRevolution => f64::NAN,
        }
    }
}
