//! The most that the error can be at one pose: proven, and found.

use crate::bundle::Bundle;
use crate::climb::Corners;
use crate::condition::Condition;
use crate::given::Given;
use crate::placed::{Moved, Placed};
use crate::reply::{Answer, fault, numbers};
use crate::run::effects;
use crate::state::State;
use serde_json::{Map, Value, json};
use truepose_kernel::Status;
use truepose_kernel::proof::{self, Deviating, Effort, Extent, Unproven};

/// Parts that the bands are divided into where nothing is proven of the whole.
const MOST_BOXES: usize = 100;
/// By which a band is made wider where its middle and its half are rounded.
const ROUNDING: f64 = 1e-14;

/// One pose, with all that is asked about it.
struct Asked<'a> {
    placed: Placed<'a>,
    known: Moved,
    joints: Vec<f64>,
    swing: Vec<f64>,
    errors: Vec<f64>,
    status: Status,
}

impl<'a> Asked<'a> {
    fn read(request: &Given<'_>, bundle: &'a Bundle) -> Answer<Asked<'a>> {
        let placed = Placed::read_one(request, bundle)?;
        let condition = Condition::read(request, bundle)?;
        let known = placed.shifts(&condition, &bundle.sources);
        let (joints, sent) = placed.sent(&condition, &known);
        let (errors, status) = placed.errors(&joints, &known, &sent);
        let swing = placed.half_widths(&condition);
        Ok(Asked { known, joints, swing, errors, status: status[0], placed })
    }
}

/// Bounds that are proven, over every value of the unknowns.
pub fn bounds(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let machine = &bundle.machine;
    if machine.is_overconstrained() {
        let message = "it has more closures than freedoms: its pose is no root to be enclosed";
        return fault("no-proof", "bundle.description", message);
    }
    let asked = Asked::read(request, &bundle)?;
    if asked.status != Status::Ok {
        return Ok(unproven(&bundle, asked.status.name()));
    }
    let (deviating, middle) = deviating(&bundle, &asked.swing);
    let known = asked.known.columns.iter().copied().zip(asked.known.row(0).iter().copied());
    let shift = merged(known.chain(middle));
    let extent =
        Extent::new(machine, &asked.joints, asked.placed.pose(0), shift.into_iter(), &deviating);
    let whole = proof::bound_in_boxes(&extent, &Effort::WHOLE).0;
    let divided = Effort { most_boxes: MOST_BOXES, ..Effort::WHOLE };
    match whole.or_else(|_| proof::bound_in_boxes(&extent, &divided).0) {
        Err(Unproven::NearSingular) => Ok(unproven(&bundle, "near_singular")),
        Err(Unproven::TooWide) => Ok(unproven(&bundle, "box_too_wide")),
        Ok(bound) => {
            let of = |values: &[f64; 6]| -> Vec<f64> {
                bundle.components.iter().map(|&at| values[at]).collect()
            };
            let sizes: Vec<f64> =
                bundle.quantities.iter().map(|&part| bound.magnitudes[part]).collect();
            Ok(json!({
                "status": "proven",
                "lower": numbers(&of(&bound.lower)),
                "upper": numbers(&of(&bound.upper)),
                "magnitude": named(&bundle, &sizes),
            }))
        }
    }
}

/// Each parameter once, with the sum of what moves it.
fn merged(moved: impl Iterator<Item = (usize, f64)>) -> Vec<(usize, f64)> {
    let mut sums: Vec<(usize, f64)> = Vec::new();
    for (parameter, value) in moved {
        match sums.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, sum)) => *sum += value,
            None => sums.push((parameter, value)),
        }
    }
    sums
}

/// The unknowns in [-1, 1] each about the middle of its ends, and what the middles move.
fn deviating(bundle: &Bundle, swing: &[f64]) -> (Deviating, Vec<(usize, f64)>) {
    let mut middles = Vec::new();
    let mut halves = Vec::with_capacity(swing.len());
    for (column, &swing) in bundle.columns.iter().zip(swing) {
        let [low, high] = bundle.unknowns[column.variable].ends;
        if [low, high] == [-1.0, 1.0] {
            halves.push(swing);
        } else {
            middles.push((column.parameter, swing * 0.5 * (low + high)));
            halves.push(swing * (0.5 * (high - low)) * (1.0 + ROUNDING));
        }
    }
    let deviating = Deviating {
        parameters: bundle.columns.iter().map(|column| column.parameter).collect(),
        variables: bundle.columns.iter().map(|column| column.variable).collect(),
        swing: halves,
        count: bundle.unknowns.len(),
        directions: bundle.directions.clone(),
    };
    (deviating, middles)
}

fn named(bundle: &Bundle, sizes: &[f64]) -> Value {
    let one = |(name, &size): (&str, &f64)| (name.to_owned(), Value::from(size));
    Value::Object(bundle.quantity_names().zip(sizes).map(one).collect::<Map<_, _>>())
}

fn unproven(bundle: &Bundle, why: &str) -> Value {
    let none = numbers(&vec![f64::NAN; bundle.components.len()]);
    let sizes = named(bundle, &vec![f64::NAN; bundle.quantities.len()]);
    json!({ "status": why, "lower": none, "upper": none, "magnitude": sizes })
}

/// The exact error of the worst machine found: of position, or of orientation where the tool only turns.
pub fn worst(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let asked = Asked::read(request, &bundle)?;
    let Asked { placed, known, joints, swing, errors, status } = &asked;
    let mut reply = Map::new();
    let mut told = *status;
    if told == Status::Ok {
        let (effects, regular) = effects(placed, joints, known, swing);
        let corners = Corners { placed, joints, known, swing };
        let mut sizes = Vec::new();
        told = regular;
        for (&quantity, name) in bundle.quantities.iter().zip(bundle.quantity_names()) {
            if told != Status::Ok {
                break;
            }
            match corners.worst(errors, &effects, &bundle.places_of(quantity)) {
                Err(bad) => told = bad,
                Ok(found) => {
                    if sizes.is_empty() {
                        reply.insert("errors".to_owned(), numbers(&found.errors));
                        reply.insert("variables".to_owned(), numbers(&found.variables));
                    }
                    sizes.push(found.size);
                    reply.insert(name.to_owned(), Value::from(found.size));
                }
            }
        }
    }
    if told != Status::Ok {
        reply.clear();
        for name in bundle.quantity_names() {
            reply.insert(name.to_owned(), Value::Null);
        }
        let none = |count: usize| numbers(&vec![f64::NAN; count]);
        reply.insert("errors".to_owned(), none(bundle.components.len()));
        reply.insert("variables".to_owned(), none(bundle.unknowns.len()));
    }
    reply.insert("status".to_owned(), Value::from(told.name()));
    Ok(Value::Object(reply))
}
