//! In which condition a machine is asked about, and how wide its bands and compliances are taken.

use crate::bundle::Bundle;
use crate::given::Given;
use crate::reply::Answer;
use std::collections::BTreeMap;

/// Temperatures and the wrench on the tool.
pub struct Condition {
    /// Of parts, above the reference, K.
    pub rise: BTreeMap<String, f64>,
    /// Force and moment on the tool, N and N m, base axes.
    pub wrench: [f64; 6],
    /// Of what gives way.
    pub compliance: f64,
    /// Of the half width of each unknown.
    pub half_width: Vec<f64>,
    /// Whether the drives are sent where the known deviations are compensated.
    pub corrected: bool,
}

impl Condition {
    /// Reads `condition`, `scale` and `command` of a request; each may be missing.
    pub fn read(request: &Given<'_>, bundle: &Bundle) -> Answer<Condition> {
        let mut rise = BTreeMap::new();
        let mut wrench = [0.0; 6];
        if let Some(given) = request.get("condition") {
            for (part, temperature) in given.entries_of("temperature")? {
                if !bundle.parts.iter().any(|known| known == part) {
                    return temperature.refuse("there is no such part");
                }
                let above = temperature.number()? - bundle.reference_temperature;
                rise.insert(part.to_owned(), above);
            }
            if let Some(given) = given.get("wrench") {
                wrench = given.fixed()?;
            }
        }
        let mut compliance = 1.0;
        let mut half_width = vec![1.0; bundle.unknowns.len()];
        if let Some(scale) = request.get("scale") {
            if let Some(given) = scale.get("compliance") {
                compliance = factor(&given)?;
            }
            for (group, given) in scale.entries_of("half_width")? {
                let scaled = factor(&given)?;
                let mut known = false;
                for (factor, unknown) in half_width.iter_mut().zip(&bundle.unknowns) {
                    if unknown.group == group {
                        (*factor, known) = (scaled, true);
                    }
                }
                if !known {
                    return given.refuse("there is no such group");
                }
            }
        }
        let corrected = match request.get("command") {
            None => false,
            Some(command) => match command.text()? {
                "nominal" => false,
                "corrected" => true,
                _ => return command.refuse("expected \"nominal\" or \"corrected\""),
            },
        };
        Ok(Condition { rise, wrench, compliance, half_width, corrected })
    }
}

fn factor(given: &Given<'_>) -> Answer<f64> {
    match given.number()? {
        factor if factor >= 0.0 => Ok(factor),
        _ => given.refuse("a scale is 0 or more"),
    }
}
