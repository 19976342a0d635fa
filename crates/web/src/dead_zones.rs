//! Dead zones: within its play a part stands where the load has put it, or anywhere while that is small.

use crate::given::Given;
use crate::reply::Answer;
use truepose_kernel::Machine;

/// The play of a column, whose half width is half of it.
#[derive(Clone, Debug)]
pub struct DeadZone {
    /// Of which source.
    pub source: String,
    /// Load up to which it stays open, N or N m.
    pub threshold: f64,
    /// The same as a part of all that acts: below it a load is rounding.
    pub share: f64,
    /// Which strut's force it feels, and at which end: 0 base, 1 platform. None: the parameter's load.
    pub end: Option<(usize, usize)>,
}

impl DeadZone {
    /// Reads `play` of a column; None where it has none.
    pub fn read(column: &Given<'_>, machine: &Machine) -> Answer<Option<DeadZone>> {
        let Some(given) = column.get("play") else { return Ok(None) };
        let end = match given.get("end") {
            None => None,
            Some(end) => match end.list()?.as_slice() {
                [strut, end] => {
                    Some((strut.below(machine.struts.len(), "strut")?, end.below(2, "end")?))
                }
                _ => return end.refuse("expected a strut and its end, 0 or 1"),
            },
        };
        Ok(Some(DeadZone {
            source: given.item("source")?.text()?.to_owned(),
            threshold: given.item("threshold")?.number()?,
            share: given.item("share")?.number()?,
            end,
        }))
    }
}
