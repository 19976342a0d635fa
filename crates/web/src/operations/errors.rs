//! Exact errors of what is known, together and by source.

use super::machine::centre_rows;
use crate::condition::Condition;
use crate::given::Given;
use crate::placed::{Moved, Placed};
use crate::reply::{Answer, rows, words};
use crate::state::State;
use serde_json::{Map, Value, json};
use truepose_kernel::Status;
use truepose_kernel::batch;
use truepose_kernel::spatial::Pose;

/// Errors at poses, and what is asked for besides.
pub fn errors(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let placed = Placed::read(request, &bundle)?;
    let condition = Condition::read(request, &bundle)?;
    let (count, width) = (placed.count, bundle.components.len());
    let known = placed.shifts(&condition, &bundle.sources);
    let (mut joints, sent) = placed.sent(&condition, &known);
    let (errors, status) = placed.errors(&joints, &known, &sent);
    let mut reply = Map::new();
    if request.is_asked("sources")? {
        let mut by_source = Map::new();
        for source in &bundle.sources {
            // Each as if it were the only one: where the command is corrected, corrected for it alone.
            let own = placed.shifts(&condition, std::slice::from_ref(source));
            let (joints, sent) = placed.sent(&condition, &own);
            let (errors, _) = placed.errors(&joints, &own, &sent);
            by_source.insert(source.name.clone(), rows(&errors, count, width));
        }
        reply.insert("by_source".to_owned(), Value::Object(by_source));
    }
    if request.is_asked("shifts")? {
        let values = rows(&known.values, count, known.columns.len());
        reply.insert("shifts".to_owned(), json!({ "columns": known.columns, "values": values }));
    }
    if request.is_asked("centres_actual")? {
        let (placements, centres) = actual(&placed, &joints, &known, &status);
        reply.insert("actual_placements".to_owned(), rows(&placements, count, 7));
        reply.insert("actual_centres".to_owned(), Value::Array(centres));
    }
    let width_of_joints = bundle.machine.drives.len();
    for (joints, status) in joints.chunks_mut(width_of_joints.max(1)).zip(&sent) {
        if !status.is_solved() {
            joints.fill(f64::NAN);
        }
    }
    reply.insert("status".to_owned(), words(&status));
    reply.insert("joints".to_owned(), rows(&joints, count, width_of_joints));
    reply.insert("errors".to_owned(), rows(&errors, count, width));
    Ok(Value::Object(reply))
}

/// Placements and joint centres of the machine as it is, null where it has no pose.
fn actual(
    placed: &Placed<'_>,
    joints: &[f64],
    known: &Moved,
    status: &[Status],
) -> (Vec<f64>, Vec<Value>) {
    let machine = &placed.bundle.machine;
    let mut placements = vec![0.0; 7 * placed.count];
    let mut found = vec![Status::Ok; placed.count];
    let samples = placed.samples_at(joints, known.deviations());
    batch::forward_poses(machine, &samples, &mut placements, &mut found);
    let width = machine.drives.len();
    let mut centres = Vec::with_capacity(placed.count);
    for (at, row) in placements.chunks_mut(7).enumerate() {
        let blank = status[at] != Status::Ok || found[at] != Status::Ok;
        let mut p = machine.nominal.clone();
        for (&column, value) in known.columns.iter().zip(known.row(at)) {
            p[column] += value;
        }
        let joints = &joints[at * width..(at + 1) * width];
        centres.push(centre_rows(&placed.centres(joints, &p, &Pose::from_row(row)), blank));
        if blank {
            row.fill(f64::NAN);
        }
    }
    (placements, centres)
}
