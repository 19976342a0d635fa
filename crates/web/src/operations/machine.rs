//! Machines: read, placed, forgotten.

use crate::bundle::Bundle;
use crate::given::Given;
use crate::placed::Placed;
use crate::reply::{Answer, numbers, rows, words};
use crate::state::State;
use serde_json::{Value, json};
use truepose_kernel::Status;
use truepose_kernel::machine::{COMPONENTS, FREEDOMS, indices_of};

/// Reads a bundle and keeps its machine.
pub fn machine(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = Bundle::read(&request.item("bundle")?)?;
    let machine = &bundle.machine;
    let commanded: Vec<&str> =
        indices_of(&machine.commanded).into_iter().map(|at| FREEDOMS[at]).collect();
    let components: Vec<&str> = bundle.components.iter().map(|&at| COMPONENTS[at]).collect();
    let (joints, struts) = (machine.drives.len(), machine.struts.len());
    let number = state.keep(bundle);
    Ok(json!({
        "machine": number,
        "commanded": commanded,
        "components": components,
        "joints": joints,
        "struts": struts,
    }))
}

/// Forgets a machine or a run.
pub fn free(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    state.free(request)?;
    Ok(json!({}))
}

/// Joints, placements, lengths and joint centres of poses; null where there are no joints.
pub fn place(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let mut placed = Placed::read(request, &bundle)?;
    let machine = &bundle.machine;
    let (joints, struts) = (machine.drives.len(), machine.struts.len());
    let mut centres = Vec::with_capacity(placed.count);
    for pose in 0..placed.count {
        let at = (placed.joints_at(pose), &machine.nominal, &placed.pose(pose));
        let unsolved = !placed.status[pose].is_solved();
        centres.push(centre_rows(&placed.centres(at.0, at.1, at.2), unsolved));
    }
    for (pose, status) in placed.status.iter().enumerate().filter(|(_, status)| !status.is_solved())
    {
        debug_assert!(*status != Status::Ok);
        placed.joints[pose * joints..(pose + 1) * joints].fill(f64::NAN);
        placed.lengths[pose * struts..(pose + 1) * struts].fill(f64::NAN);
    }
    Ok(json!({
        "status": words(&placed.status),
        "joints": rows(&placed.joints, placed.count, joints),
        "placements": rows(&placed.placements, placed.count, 7),
        "lengths": rows(&placed.lengths, placed.count, struts),
        "centres": centres,
    }))
}

/// Joint centres of the struts at one pose, null where it is none.
pub fn centre_rows(centres: &[[[f64; 3]; 2]], blank: bool) -> Value {
    let point = |point: &[f64; 3]| numbers(&if blank { [f64::NAN; 3] } else { *point });
    let strut = |ends: &[[f64; 3]; 2]| Value::Array(ends.iter().map(point).collect());
    Value::Array(centres.iter().map(strut).collect())
}
