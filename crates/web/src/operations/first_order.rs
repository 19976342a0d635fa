//! Quantities of first order: sensitivities, loads.

use crate::given::Given;
use crate::placed::{Placed, blank_bad, first_bad};
use crate::reply::{Answer, fault, rows, words};
use crate::state::State;
use serde_json::{Value, json};
use truepose_kernel::Status;
use truepose_kernel::batch::{self, Rows};

/// The most numbers of one reply.
const MOST_NUMBERS: usize = 1 << 24;

fn columns(request: &Given<'_>, placed: &Placed<'_>, each: usize) -> Answer<Vec<usize>> {
    let given = request.item("columns")?;
    let columns = given.all_below(placed.bundle.machine.nominal.len(), "parameter")?;
    let asked = columns.len().saturating_mul(each).saturating_mul(placed.count);
    if asked > MOST_NUMBERS {
        return fault("too-many-poses", given.place, format!("at most {MOST_NUMBERS} numbers"));
    }
    Ok(columns)
}

/// What a unit of each parameter does to the components of the error.
pub fn sensitivities(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let placed = Placed::read(request, &bundle)?;
    let (machine, m) = (&bundle.machine, bundle.components.len());
    let columns = columns(request, &placed, m)?;
    let k = columns.len();
    let mut slopes = vec![0.0; placed.count * m * k];
    let mut found = vec![Status::Ok; placed.count];
    if k > 0 {
        // By the road of bounds and samples, of a machine that deviates by nothing: a page's kernel has one.
        let quantity = batch::Sensitivity::new(machine, &columns);
        batch::moved_first_order(machine, &placed.samples(), &quantity, &mut slopes, &mut found);
    }
    let mut status = first_bad(&placed.status, &found);
    blank_bad(&mut slopes, m * k, &mut status);
    // Of each column its components: a row a column.
    let mut turned = Vec::with_capacity(slopes.len());
    for pose in slopes.chunks(m * k.max(1)) {
        for column in 0..k {
            turned.extend((0..m).map(|component| pose[component * k + column]));
        }
    }
    let effects: Vec<Value> =
        (0..placed.count).map(|pose| rows(&turned[pose * m * k..], k, m)).collect();
    Ok(json!({ "status": words(&status), "effects": effects }))
}

/// What each parameter carries under a wrench on the tool.
pub fn loads(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let placed = Placed::read(request, &bundle)?;
    let columns = columns(request, &placed, 1)?;
    let wrench: [f64; 6] = request.item("wrench")?.fixed()?;
    let (mut loads, found) = placed.loads(Rows::shared(&wrench), &columns);
    let mut status = first_bad(&placed.status, &found);
    blank_bad(&mut loads, columns.len(), &mut status);
    Ok(json!({ "status": words(&status), "loads": rows(&loads, placed.count, columns.len()) }))
}
