//! A machine as a page has it: the kernel's, and what is known and unknown of it as laws.

use crate::dead_zones::DeadZone;
use crate::given::Given;
use crate::laws::{Law, Term};
use crate::reply::{Answer, fault};
use crate::weight::Weight;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use truepose_kernel::machine::{Table, Value, indices_of, parts};
use truepose_kernel::sampling::{Copula, Shape, Variable, Variables};
use truepose_kernel::{Description, Machine};

/// The schema that is read.
const SCHEMA: u64 = 1;

/// A number of a description that is infinite.
const INFINITE: &str = "inf";

/// What a live source does to the machine.
pub struct Source {
    /// Its name.
    pub name: String,
    /// The known deviation at the reference temperature without a force.
    pub at_reference: Vec<Term>,
    /// What a kelvin of a part adds.
    pub per_kelvin: BTreeMap<String, Vec<Term>>,
    /// Whether it is what gives way under the wrench on the tool.
    pub under_wrench: bool,
    /// Whether it is what gives way under the machine's own weight.
    pub under_weight: bool,
}

/// What gives way, m/N or rad/(N m).
pub struct Compliance {
    /// Parameters under their own load.
    pub own: Vec<Term>,
    /// Two parameters under each other's.
    pub shared: Vec<(usize, usize, f64)>,
    /// Whether limbs say what they are made of.
    pub limbs: bool,
}

/// One thing that is not known.
pub struct Unknown {
    /// Of which source.
    pub source: String,
    /// What its half width is scaled with.
    pub group: String,
    /// Half its band in standard deviations.
    pub sigmas: f64,
    /// Its lowest and highest value.
    pub ends: [f64; 2],
}

/// What an unknown moves.
pub struct Column {
    /// Which parameter.
    pub parameter: usize,
    /// Which unknown.
    pub variable: usize,
    /// By how much where that is 1.
    pub half: Law,
    /// A play that a load may take up.
    pub play: Option<DeadZone>,
}

/// All of it.
pub struct Bundle {
    /// The machine.
    pub machine: Machine,
    /// Components of an error, as numbers of the six.
    pub components: Vec<usize>,
    /// Parts of an error that exist: 0 position, 1 orientation.
    pub quantities: Vec<usize>,
    /// K.
    pub reference_temperature: f64,
    /// The live ones.
    pub sources: Vec<Source>,
    /// What gives way.
    pub compliance: Compliance,
    /// What the machine weighs.
    pub weight: Option<Weight>,
    /// What is not known.
    pub unknowns: Vec<Unknown>,
    /// The same for random numbers; without one that cannot be drawn here.
    pub variables: Option<Variables>,
    /// What they move.
    pub columns: Vec<Column>,
    /// Unknowns that are together a unit vector.
    pub directions: Vec<Vec<usize>>,
    /// What has a temperature.
    pub parts: Vec<String>,
}

impl Bundle {
    /// Reads a bundle, everything of it checked.
    pub fn read(given: &Given<'_>) -> Answer<Bundle> {
        let schema = given.item("schema")?;
        if schema.whole()? != SCHEMA {
            let message = format!("it is of schema {}, expected {SCHEMA}", schema.value);
            return fault("unknown-schema", schema.place, message);
        }
        let description = given.item("description")?;
        let Value::Table(table) = plain(description.value) else {
            return description.refuse("expected a table");
        };
        let machine = Machine::new(&Description::read(&table)?)?;
        agree(given, &machine)?;
        let parts_given = given.list_of("parts")?;
        let names = parts_given.iter().map(|part| Ok(part.item("part")?.text()?.to_owned()));
        let names = names.collect::<Answer<Vec<String>>>()?;
        let (unknowns, shapes) = unknowns(given)?;
        let directions = given
            .list_of("directions")?
            .iter()
            .map(|members| direction(members, unknowns.len()))
            .collect::<Answer<Vec<_>>>()?;
        Ok(Bundle {
            components: indices_of(&machine.dof),
            quantities: parts(&machine.dof),
            reference_temperature: given.item("reference_temperature")?.number()?,
            sources: sources(given, &machine, &names)?,
            compliance: compliance(given, &machine)?,
            weight: Weight::read(given, &machine)?,
            columns: columns(given, &machine, unknowns.len())?,
            variables: variables(given, shapes, &directions)?,
            unknowns,
            directions,
            parts: names,
            machine,
        })
    }

    /// Names of the quantities.
    pub fn quantity_names(&self) -> impl Iterator<Item = &'static str> {
        self.quantities.iter().map(|&part| ["position", "orientation"][part])
    }

    /// Places among the components of a quantity's.
    pub fn places_of(&self, quantity: usize) -> Vec<usize> {
        let of = |&at: &usize| self.components[at] / 3 == quantity;
        (0..self.components.len()).filter(of).collect()
    }
}

/// JSON as the kernel's plain values.
fn plain(value: &Json) -> Value {
    match value {
        Json::Null => Value::Nothing,
        Json::Bool(flag) => Value::Flag(*flag),
        Json::Number(number) => Value::Number(number.as_f64().unwrap_or(f64::NAN)),
        Json::String(text) => Value::Text(text.clone()),
        Json::Array(list) => Value::List(list.iter().map(plain).collect()),
        Json::Object(table) => {
            let entries = table.iter().map(|(key, value)| {
                let value = plain(value);
                let may_be_infinite = key.ends_with("compliance");
                (key.clone(), if may_be_infinite { with_infinity(value) } else { value })
            });
            Value::Table(entries.collect::<Table>())
        }
    }
}

/// The same with the infinity that JSON has not, a text, as a number.
fn with_infinity(value: Value) -> Value {
    match value {
        Value::Text(text) if text == INFINITE => Value::Number(f64::INFINITY),
        Value::List(list) => Value::List(list.into_iter().map(with_infinity).collect()),
        other => other,
    }
}

/// Refuses laws that were made for parameters in another order.
fn agree(given: &Given<'_>, machine: &Machine) -> Answer<()> {
    let parameters = given.item("parameters")?;
    let listed = parameters.list()?;
    let same = listed.len() == machine.parameters.len()
        && listed.iter().zip(&machine.parameters).all(|(listed, parameter)| {
            listed.value.as_str().is_some_and(|name| name == parameter.name)
        });
    if same { Ok(()) } else { parameters.refuse("these are not the machine's parameters") }
}

fn sources(given: &Given<'_>, machine: &Machine, parts: &[String]) -> Answer<Vec<Source>> {
    let mut sources = Vec::new();
    for source in given.list_of("sources")? {
        if !source.item("live")?.flag()? {
            continue;
        }
        let mut per_kelvin = BTreeMap::new();
        for (part, terms) in source.entries_of("per_kelvin")? {
            if !parts.iter().any(|known| known == part) {
                return terms.refuse("there is no such part");
            }
            per_kelvin.insert(part.to_owned(), Term::list(&terms.list()?, machine)?);
        }
        sources.push(Source {
            name: source.item("name")?.text()?.to_owned(),
            at_reference: Term::list(&source.list_of("at_reference")?, machine)?,
            per_kelvin,
            under_wrench: source.is_asked("under_wrench")?,
            under_weight: source.is_asked("under_weight")?,
        });
    }
    Ok(sources)
}

fn compliance(given: &Given<'_>, machine: &Machine) -> Answer<Compliance> {
    let Some(given) = given.get("compliance") else {
        return Ok(Compliance { own: Vec::new(), shared: Vec::new(), limbs: false });
    };
    let shared = |pair: &Given<'_>| {
        let parts = pair.list()?;
        let [one, other, value] = parts.as_slice() else {
            return pair.refuse("expected two parameters and a compliance");
        };
        let count = machine.nominal.len();
        Ok((one.below(count, "parameter")?, other.below(count, "parameter")?, value.number()?))
    };
    Ok(Compliance {
        own: Term::list(&given.list_of("own")?, machine)?,
        shared: given.list_of("shared")?.iter().map(shared).collect::<Answer<_>>()?,
        limbs: given.is_asked("limbs")?,
    })
}

fn columns(given: &Given<'_>, machine: &Machine, unknowns: usize) -> Answer<Vec<Column>> {
    let column = |column: &Given<'_>| {
        Ok(Column {
            parameter: column.item("parameter")?.below(machine.nominal.len(), "parameter")?,
            variable: column.item("variable")?.below(unknowns, "variable")?,
            half: Law::read(&column.item("half")?, machine)?,
            play: DeadZone::read(column, machine)?,
        })
    };
    given.list_of("columns")?.iter().map(column).collect()
}

fn direction(members: &Given<'_>, unknowns: usize) -> Answer<Vec<usize>> {
    let members_of = members.all_below(unknowns, "variable")?;
    if !(2..=3).contains(&members_of.len()) {
        return members.refuse("a direction has two or three components");
    }
    Ok(members_of)
}

fn unknowns(given: &Given<'_>) -> Answer<(Vec<Unknown>, Vec<Variable>)> {
    let mut unknowns = Vec::new();
    let mut variables = Vec::new();
    for variable in given.list_of("variables")? {
        let distribution = variable.item("distribution")?;
        let (shape, sigmas, ends) = shape(&distribution)?;
        let group = variable.get("group").map_or(Ok(""), |group| group.text())?.to_owned();
        let source = variable.item("source")?.text()?.to_owned();
        unknowns.push(Unknown { source, group, sigmas, ends });
        variables.push(Variable {
            shape,
            stream: variable.item("stream")?.whole()?,
            number: variable.item("number")?.whole()?,
        });
    }
    Ok((unknowns, variables))
}

/// How a variable is distributed, half its band in standard deviations, and its ends.
fn shape(given: &Given<'_>) -> Answer<(Shape, f64, [f64; 2])> {
    let positive = |key: &str, usual: f64| -> Answer<f64> {
        let Some(number) = given.get(key) else { return Ok(usual) };
        match number.number()? {
            value if value > 0.0 => Ok(value),
            _ => number.refuse("expected a number above 0"),
        }
    };
    const BOTH: [f64; 2] = [-1.0, 1.0];
    match given.item("kind")?.text()? {
        "uniform" => Ok((Shape::Uniform, 3.0_f64.sqrt(), BOTH)),
        "triangular" => Ok((Shape::Triangular, 6.0_f64.sqrt(), BOTH)),
        "arcsine" => Ok((Shape::Arcsine, 2.0_f64.sqrt(), BOTH)),
        "two-point" => Ok((Shape::TwoPoint, 1.0, BOTH)),
        "normal" => {
            let sigmas = positive("sigmas", 3.0)?;
            Ok((Shape::Normal(1.0 / sigmas), sigmas, BOTH))
        }
        "student-t" => {
            let (sigmas, dof) = (positive("sigmas", 3.0)?, given.item("dof")?.number()?);
            if !(dof > 2.0) {
                return given.refuse("a standard deviation takes more than two degrees of freedom");
            }
            let scale = ((dof - 2.0) / dof).sqrt() / sigmas;
            Ok((Shape::StudentT { dof, scale }, sigmas, BOTH))
        }
        "discrete" => {
            let values = given.item("values")?.numbers()?;
            let mut sum = 0.0;
            let cumulative: Vec<f64> = given
                .item("probabilities")?
                .numbers()?
                .into_iter()
                .map(|share| {
                    sum += share;
                    sum
                })
                .collect();
            let rises = cumulative.windows(2).all(|pair| pair[0] <= pair[1]);
            if values.is_empty() || values.len() != cumulative.len() || !rises {
                return given.refuse("expected values and as many probabilities");
            }
            let ends = if values.len() > 1 { [values[0], values[values.len() - 1]] } else { BOTH };
            if !(ends[0] <= ends[1]) {
                return given.refuse("expected values in ascending order");
            }
            let sigmas = positive("sigmas", 3.0_f64.sqrt())?;
            Ok((Shape::Discrete { values, cumulative }, sigmas, ends))
        }
        other => given.refuse(format!("{other:?} is no distribution")),
    }
}

fn variables(
    given: &Given<'_>,
    shapes: Vec<Variable>,
    directions: &[Vec<usize>],
) -> Answer<Option<Variables>> {
    let count = shapes.len();
    let mut drawn = true;
    let copula = match given.get("copula") {
        None => None,
        Some(copula) => {
            let members = copula.item("members")?.all_below(count, "variable")?;
            let (factor, rows) = copula.item("factor")?.rows(members.len())?;
            if rows != members.len() {
                return copula.refuse("members and factor do not fit");
            }
            if directions.iter().flatten().any(|member| members.contains(member)) {
                return copula.refuse("the components of a direction correlate with nothing else");
            }
            // The kernel has no quantile function of Student's distribution.
            let students = |&member: &usize| matches!(shapes[member].shape, Shape::StudentT { .. });
            drawn = !members.iter().any(students);
            (!members.is_empty()).then_some(Copula { members, factor })
        }
    };
    Ok(drawn.then(|| Variables::new(shapes, copula, directions.to_vec())))
}
