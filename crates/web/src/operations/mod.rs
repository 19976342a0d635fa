//! What a page may ask: one file a group, one line in [`OPERATIONS`] each.

mod bounds;
mod errors;
mod first_order;
mod largest;
mod machine;
mod samples;

use crate::given::{BAD_REQUEST, Given};
use crate::reply::{self, Answer, fault};
use crate::state::State;
use serde_json::Value;
use std::cell::RefCell;

/// Answers a request.
type Operation = fn(&mut State, &Given<'_>) -> Answer<Value>;

/// By the word in `op`.
const OPERATIONS: &[(&str, Operation)] = &[
    ("machine", machine::machine),
    ("place", machine::place),
    ("errors", errors::errors),
    ("sensitivities", first_order::sensitivities),
    ("loads", first_order::loads),
    ("largest", largest::largest),
    ("bounds", bounds::bounds),
    ("worst", bounds::worst),
    ("samples", samples::begin),
    ("more", samples::more),
    ("read", samples::read),
    ("take", samples::take),
    ("merge", samples::merge),
    ("free", machine::free),
];

thread_local! {
    static STATE: RefCell<State> = RefCell::new(State::default());
}

/// The reply to a request.
pub fn answer(request: &[u8]) -> Vec<u8> {
    reply::text(answered(request))
}

fn answered(request: &[u8]) -> Answer<Value> {
    let request: Value = match serde_json::from_slice(request) {
        Ok(request) => request,
        Err(error) => return fault(BAD_REQUEST, "request", format!("it is no JSON: {error}")),
    };
    let given = Given::root(&request, "request");
    let word = given.item("op")?;
    let name = word.text()?;
    match OPERATIONS.iter().find(|(known, _)| *known == name) {
        Some((_, operation)) => STATE.with(|state| match state.try_borrow_mut() {
            Ok(mut state) => operation(&mut state, &given),
            Err(_) => fault(BAD_REQUEST, "request", "another request is being answered"),
        }),
        None => word.refuse(format!("{name:?} is no operation")),
    }
}
