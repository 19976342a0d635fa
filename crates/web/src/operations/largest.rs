//! How long an error may be, to first order about what is known: of all sources together, and of each alone.

use crate::bundle::{Bundle, Source};
use crate::condition::Condition;
use crate::given::Given;
use crate::placed::Placed;
use crate::reply::Answer;
use crate::run::effects;
use crate::state::State;
use serde_json::{Map, Value, json};
use truepose_kernel::Status;
use truepose_kernel::largest::{Domain, Largest, NUMBERS, largest_of};

/// The largest length of each quantity at a pose, with `sources` of each source too.
pub fn largest(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let placed = Placed::read_one(request, &bundle)?;
    let condition = Condition::read(request, &bundle)?;
    let swing = placed.half_widths(&condition);
    let (together, status) = longest(&placed, &condition, &swing, &bundle.sources);
    let mut reply = Map::new();
    if request.is_asked("sources")? {
        let mut by_source = Map::new();
        for source in &bundle.sources {
            let alone = std::slice::from_ref(source);
            let (alone, _) = longest(&placed, &condition, &swing, alone);
            by_source.insert(source.name.clone(), alone);
        }
        reply.insert("by_source".to_owned(), Value::Object(by_source));
    }
    reply.insert("largest".to_owned(), together);
    reply.insert("status".to_owned(), json!(status.name()));
    Ok(Value::Object(reply))
}

/// Lengths by quantity of some sources as if they were the only ones, null where there is no error.
fn longest(
    placed: &Placed<'_>,
    condition: &Condition,
    swing: &[f64],
    sources: &[Source],
) -> (Value, Status) {
    let bundle = placed.bundle;
    let known = placed.shifts(condition, sources);
    let (joints, sent) = placed.sent(condition, &known);
    let (centre, mut status) = placed.errors(&joints, &known, &sent);
    let own: Vec<f64> = bundle
        .columns
        .iter()
        .zip(swing)
        .map(|(column, &swing)| {
            let source = &bundle.unknowns[column.variable].source;
            if sources.iter().any(|one| one.name == *source) { swing } else { 0.0 }
        })
        .collect();
    let mut lengths = vec![f64::NAN; NUMBERS * bundle.quantities.len()];
    if status[0] == Status::Ok {
        let (moved, regular) = effects(placed, &joints, &known, &own);
        status[0] = regular;
        if regular == Status::Ok {
            let (components, domain) = (bundle.components.len(), domain(bundle));
            let quantities: Vec<Vec<usize>> =
                bundle.quantities.iter().map(|&part| bundle.places_of(part)).collect();
            let of = Largest {
                centre: &centre,
                effects: &turned(&moved, components),
                components,
                domain: &domain,
                quantities: &quantities,
            };
            largest_of(1, &of, &mut lengths);
        }
    }
    let named = bundle.quantity_names().zip(lengths.chunks(NUMBERS));
    let of = |(name, numbers): (&str, &[f64])| (name.to_owned(), Value::from(numbers[0]));
    (Value::Object(named.map(of).collect()), status[0])
}

/// Rows of components instead of rows of unknowns.
fn turned(effects: &[f64], components: usize) -> Vec<f64> {
    let column = |component| effects.iter().skip(component).step_by(components.max(1)).copied();
    (0..components).flat_map(column).collect()
}

/// Where the unknowns can lie.
fn domain(bundle: &Bundle) -> Domain {
    let ends = bundle.unknowns.iter().map(|unknown| unknown.ends);
    let (middle, half) = ends.map(|[low, high]| (0.5 * (low + high), 0.5 * (high - low))).unzip();
    Domain { middle, half, directions: bundle.directions.clone() }
}
