//! A scalar that records the operations of a formula and prints them as C.
//!
//! The controller's code thereby comes from the one closure, not from a second copy of it. What is
//! computed twice is recorded once, and what constants alone decide is computed while recording, so
//! that a general formula prints as the short one that the machine at hand needs.

use super::Scalar;
use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Operation {
    /// An argument, by its number.
    Input(usize),
    /// A number, by its bits.
    Constant(u64),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Negate(usize),
    SquareRoot(usize),
    Sine(usize),
    Cosine(usize),
    Angle(usize, usize),
    Select(usize, usize, usize),
}

impl Operation {
    /// The places that it reads.
    fn reads(self) -> [Option<usize>; 3] {
        match self {
            Operation::Input(_) | Operation::Constant(_) => [None; 3],
            Operation::Negate(a)
            | Operation::SquareRoot(a)
            | Operation::Sine(a)
            | Operation::Cosine(a) => [Some(a), None, None],
            Operation::Add(a, b)
            | Operation::Subtract(a, b)
            | Operation::Multiply(a, b)
            | Operation::Divide(a, b)
            | Operation::Angle(a, b) => [Some(a), Some(b), None],
            Operation::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        }
    }
}

/// What is on a tape.
#[derive(Default)]
struct Recorded {
    operations: Vec<Operation>,
    number_of: HashMap<Operation, usize>,
    /// How each argument is written in C.
    inputs: Vec<String>,
}

/// The operations recorded so far, in order, each once.
#[derive(Default)]
pub struct Tape {
    recorded: RefCell<Recorded>,
}

/// One recorded value: a place on a [`Tape`].
#[derive(Clone, Copy)]
pub struct Trace<'t> {
    tape: &'t Tape,
    place: usize,
}

impl Tape {
    /// An empty tape.
    pub fn new() -> Self {
        Self::default()
    }

    /// The argument that is written `expression` in C, as `p[3]`.
    pub fn input(&self, expression: impl Into<String>) -> Trace<'_> {
        let number = {
            let inputs = &mut self.recorded.borrow_mut().inputs;
            inputs.push(expression.into());
            inputs.len() - 1
        };
        self.record(Operation::Input(number))
    }

    /// A number.
    pub fn constant(&self, value: f64) -> Trace<'_> {
        self.record(Operation::Constant(value.to_bits()))
    }

    fn record(&self, operation: Operation) -> Trace<'_> {
        let mut recorded = self.recorded.borrow_mut();
        let next = recorded.operations.len();
        let place = *recorded.number_of.entry(operation).or_insert(next);
        if place == next {
            recorded.operations.push(operation);
        }
        Trace { tape: self, place }
    }

    /// The body of a C99 function, one statement a line: `outputs` are the left-hand sides, as `y[0]`, and
    /// its value. What they do not need is left out. Also how many values it keeps.
    pub fn print_c(&self, outputs: &[(String, Trace<'_>)]) -> (String, usize) {
        let recorded = self.recorded.borrow();
        let operations = &recorded.operations;
        let mut needed = vec![false; operations.len()];
        for (_, output) in outputs {
            needed[output.place] = true;
        }
        // An operation reads earlier places only.
        for place in (0..operations.len()).rev() {
            if needed[place] {
                for read in operations[place].reads().into_iter().flatten() {
                    needed[read] = true;
                }
            }
        }
        let name = |place: usize| match operations[place] {
            Operation::Constant(bits) => literal(f64::from_bits(bits)),
            _ => format!("v{place}"),
        };
        let mut code = String::new();
        let mut count = 0;
        for (place, operation) in operations.iter().enumerate().filter(|(at, _)| needed[*at]) {
            let expression = match *operation {
                Operation::Constant(_) => continue,
                Operation::Input(i) => recorded.inputs[i].clone(),
                Operation::Add(a, b) => format!("{} + {}", name(a), name(b)),
                Operation::Subtract(a, b) => format!("{} - {}", name(a), name(b)),
                Operation::Multiply(a, b) => format!("{} * {}", name(a), name(b)),
                Operation::Divide(a, b) => format!("{} / {}", name(a), name(b)),
                Operation::Negate(a) => format!("-{}", name(a)),
                Operation::SquareRoot(a) => format!("sqrt({})", name(a)),
                Operation::Sine(a) => format!("sin({})", name(a)),
                Operation::Cosine(a) => format!("cos({})", name(a)),
                Operation::Angle(y, x) => format!("atan2({}, {})", name(y), name(x)),
                Operation::Select(c, a, b) => {
                    format!("{} >= 0.0 ? {} : {}", name(c), name(a), name(b))
                }
            };
            count += 1;
            writeln!(code, "    const double v{place} = {expression};")
                .expect("writing to a String");
        }
        for (target, output) in outputs {
            writeln!(code, "    {target} = {};", name(output.place)).expect("writing to a String");
        }
        (code, count)
    }
}

/// A C literal that reads back as exactly `value`; a negative one in brackets.
fn literal(value: f64) -> String {
    if value.is_nan() {
        "NAN".into()
    } else if value.is_infinite() {
        if value > 0.0 { "INFINITY".into() } else { "(-INFINITY)".into() }
    } else if value.is_sign_negative() {
        format!("({value:?})")
    } else {
        format!("{value:?}")
    }
}

impl<'t> Trace<'t> {
    /// The value, where it is a number.
    fn known(self) -> Option<f64> {
        match self.tape.recorded.borrow().operations[self.place] {
            Operation::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn is(self, value: f64) -> bool {
        self.known() == Some(value)
    }

    fn binary(
        self,
        other: Self,
        compute: fn(f64, f64) -> f64,
        operation: fn(usize, usize) -> Operation,
    ) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => self.tape.constant(compute(a, b)),
            _ => self.tape.record(operation(self.place, other.place)),
        }
    }

    fn unary(self, compute: fn(f64) -> f64, operation: fn(usize) -> Operation) -> Self {
        match self.known() {
            Some(a) => self.tape.constant(compute(a)),
            None => self.tape.record(operation(self.place)),
        }
    }

    /// What this is the negative of.
    fn negated(self) -> Option<Self> {
        match self.tape.recorded.borrow().operations[self.place] {
            Operation::Negate(place) => Some(Trace { tape: self.tape, place }),
            _ => None,
        }
    }
}

// Simplified is only what changes no finite result but the sign of a zero.
impl<'t> Add for Trace<'t> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        if self.is(0.0) {
            other
        } else if other.is(0.0) {
            self
        } else if let Some(taken) = other.negated() {
            Sub::sub(self, taken)
        } else {
            self.binary(other, |a, b| a + b, Operation::Add)
        }
    }
}

impl<'t> Sub for Trace<'t> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        if other.is(0.0) {
            self
        } else if self.is(0.0) {
            -other
        } else if let Some(added) = other.negated() {
            Add::add(self, added)
        } else {
            self.binary(other, |a, b| a - b, Operation::Subtract)
        }
    }
}

impl<'t> Mul for Trace<'t> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        for (one, two) in [(self, other), (other, self)] {
            if one.is(0.0) {
                return one.tape.constant(0.0);
            } else if one.is(1.0) {
                return two;
            } else if one.is(-1.0) {
                return -two;
            } else if let Some(positive) = one.negated() {
                return -(positive * two);
            }
        }
        // The factors in one order, so that a product met both ways is recorded once.
        let (a, b) = if self.place <= other.place { (self, other) } else { (other, self) };
        a.binary(b, |a, b| a * b, Operation::Multiply)
    }
}

impl<'t> Div for Trace<'t> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.is(1.0) {
            self
        } else if self.is(0.0) {
            self.tape.constant(0.0)
        } else {
            self.binary(other, |a, b| a / b, Operation::Divide)
        }
    }
}

impl Neg for Trace<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        self.negated().unwrap_or_else(|| self.unary(|a| -a, Operation::Negate))
    }
}

impl Scalar for Trace<'_> {
    fn lift(self, value: f64) -> Self {
        self.tape.constant(value)
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn square(self) -> Self {
        self * self
    }
    fn square_plus(self, term: Self) -> Self {
        self * self + term
    }
    fn sqrt(self) -> Self {
        self.unary(f64::sqrt, Operation::SquareRoot)
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.unary(f64::sin, Operation::Sine), self.unary(f64::cos, Operation::Cosine))
    }
    fn atan2(self, x: Self) -> Self {
        self.binary(x, f64::atan2, Operation::Angle)
    }
    fn select(self, then: Self, otherwise: Self) -> Self {
        if then.place == otherwise.place {
            return then;
        }
        match self.known() {
            Some(value) if value >= 0.0 => then,
            Some(_) => otherwise,
            None => self.tape.record(Operation::Select(self.place, then.place, otherwise.place)),
        }
    }
}
