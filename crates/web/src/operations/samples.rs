//! Samples: a run, its parts, and what they say.

use crate::base64;
use crate::condition::Condition;
use crate::given::Given;
use crate::placed::Placed;
use crate::reply::{Answer, fault, numbers, rows};
use crate::run::Run;
use crate::state::State;
use serde_json::{Map, Value, json};
use truepose_kernel::machine::COMPONENTS;
use truepose_kernel::sampling::Tally;

/// The share of the samples in the ellipsoid.
const IN_ELLIPSOID: f64 = 0.95;
/// The most probabilities that are asked for at once.
const MOST_PROBABILITIES: usize = 10_000;
/// Of a share of the samples.
const ROUNDING: f64 = 1e-12;

/// Begins a run.
pub fn begin(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let bundle = state.machine(request)?;
    let placed = Placed::read_one(request, &bundle)?;
    let condition = Condition::read(request, &bundle)?;
    let seed = request.item("seed")?.whole()?;
    let run = Run::new(&bundle, &placed, &condition, seed)?;
    Ok(json!({ "run": state.keep_run(run) }))
}

/// Draws further samples.
pub fn more(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let (first, count) = (request.item("first")?.whole()?, request.item("count")?.whole()?);
    let run = state.run(request)?;
    run.draw(first, count)?;
    Ok(json!({ "count": run.count() }))
}

/// All that was drawn, for another run of the same samples.
pub fn take(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    Ok(json!({ "tally": base64::text(&state.run(request)?.to_bytes()) }))
}

/// Adds what another run has drawn.
pub fn merge(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let given = request.item("tally")?;
    let Some(bytes) = base64::bytes(given.text()?) else {
        return fault("bad-tally", given.place, "this is no text of bytes");
    };
    let run = state.run(request)?;
    run.merge(&bytes)?;
    Ok(json!({ "count": run.count() }))
}

/// What the samples say so far.
pub fn read(state: &mut State, request: &Given<'_>) -> Answer<Value> {
    let given = request.item("probabilities")?;
    let shares = given.numbers()?;
    if shares.len() > MOST_PROBABILITIES || !shares.iter().all(|p| (0.0..=1.0).contains(p)) {
        return given.refuse(format!("expected at most {MOST_PROBABILITIES} numbers from 0 to 1"));
    }
    let run = state.run(request)?;
    let (tally, bundle) = (run.whole(), run.bundle());
    let m = bundle.components.len();
    let named: Vec<&str> = bundle
        .components
        .iter()
        .map(|&at| COMPONENTS[at])
        .chain(bundle.quantity_names())
        .chain(run.shape().map(|_| "distance"))
        .collect();
    let columns = named.len();
    let mean: Vec<f64> = (0..columns).map(|column| tally.mean(column)).collect();
    let covariance: Vec<f64> = (0..m * m).map(|k| tally.covariance(k / m, k % m)).collect();
    let extremes: Vec<[f64; 2]> = (0..columns).map(|column| tally.extremes(column)).collect();
    let quantiles: Vec<Value> =
        (0..columns).map(|column| numbers(&of_all(&tally, column, column < m, &shares))).collect();
    let mut reply = Map::new();
    reply.insert("count".to_owned(), Value::from(tally.count()));
    reply.insert("failed".to_owned(), Value::from(tally.failed.iter().sum::<u64>()));
    reply.insert("columns".to_owned(), json!(named));
    reply.insert("mean".to_owned(), numbers(&mean));
    reply.insert("covariance".to_owned(), rows(&covariance, m, m));
    let ends = |end: usize| numbers(&extremes.iter().map(|ends| ends[end]).collect::<Vec<_>>());
    reply.insert("minimum".to_owned(), ends(0));
    reply.insert("maximum".to_owned(), ends(1));
    reply.insert("quantiles".to_owned(), Value::Array(quantiles));
    if let Some((centre, shape)) = run.shape() {
        let factor = of_all(&tally, columns - 1, false, &[IN_ELLIPSOID])[0];
        let shape = shape.as_flattened().iter().map(|value| value * factor * factor);
        let shape: Vec<f64> = shape.collect();
        let ellipse = json!({ "centre": numbers(&centre), "shape": rows(&shape, 3, 3) });
        reply.insert("ellipse".to_owned(), ellipse);
    }
    Ok(Value::Object(reply))
}

/// Quantiles of all samples, those without a result among them: of errors, which have a sign, half of what
/// failed lies below all others and half above; of sizes all lies above. NaN where those decide.
fn of_all(tally: &Tally, column: usize, signed: bool, shares: &[f64]) -> Vec<f64> {
    let failed = tally.failed.iter().sum::<u64>();
    let factor = (tally.count() + failed) as f64 / tally.count() as f64;
    let asked = shares
        .iter()
        .map(|share| if signed { share * factor - 0.5 * (factor - 1.0) } else { share * factor });
    let asked: Vec<f64> = asked.collect();
    let there = |share: &f64| (-ROUNDING..=1.0 + ROUNDING).contains(share);
    let inside: Vec<f64> =
        asked.iter().map(|share| if there(share) { share.clamp(0.0, 1.0) } else { 0.5 }).collect();
    let quantiles = tally.quantiles(column, &inside);
    let kept = asked.iter().zip(quantiles);
    kept.map(|(share, value)| if there(share) { value } else { f64::NAN }).collect()
}
