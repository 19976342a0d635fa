//! What is answered: numbers as JSON, or what is wrong with a request.

use serde_json::{Map, Value, json};
use truepose_kernel::{MachineError, Status};

/// What is wrong with a request or a bundle.
#[derive(Debug)]
pub struct Fault {
    /// A stable word.
    pub code: &'static str,
    /// One sentence.
    pub message: String,
    /// Where, as `bundle.sources[2].per_kelvin`.
    pub place: String,
}

/// A result, or what is wrong.
pub type Answer<T> = Result<T, Fault>;

/// A fault as a result.
pub fn fault<T>(
    code: &'static str,
    place: impl Into<String>,
    message: impl Into<String>,
) -> Answer<T> {
    Err(Fault { code, message: message.into(), place: place.into() })
}

impl From<MachineError> for Fault {
    fn from(error: MachineError) -> Self {
        Fault { code: error.code, message: error.message, place: error.place }
    }
}

/// The reply as text.
pub fn text(answer: Answer<Value>) -> Vec<u8> {
    let (key, value) = match answer {
        Ok(value) => ("ok", value),
        Err(Fault { code, message, place }) => {
            ("error", json!({ "code": code, "message": message, "place": place }))
        }
    };
    let reply = Value::Object(Map::from_iter([(key.to_owned(), value)]));
    serde_json::to_vec(&reply).unwrap_or_default()
}

/// A list of numbers; what is no finite number is null.
pub fn numbers(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|&value| Value::from(value)).collect())
}

/// Rows of so many numbers.
pub fn rows(values: &[f64], count: usize, width: usize) -> Value {
    let row = |at: usize| numbers(&values[at * width..(at + 1) * width]);
    Value::Array((0..count).map(row).collect())
}

/// The words of statuses.
pub fn words(status: &[Status]) -> Value {
    Value::Array(status.iter().map(|status| Value::from(status.name())).collect())
}
