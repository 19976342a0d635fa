//! A scalar that records the operations of a formula and prints them as C.
//!
//! The controller's code thereby comes from the one closure, not from a second copy of it.

use super::Scalar;
use std::cell::RefCell;
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy)]
enum Operation {
    Input(usize),
    Constant(f64),
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

/// The operations recorded so far, in order.
#[derive(Default)]
pub struct Tape {
    operations: RefCell<Vec<Operation>>,
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

    /// The function's argument number `index`.
    pub fn input(&self, index: usize) -> Trace<'_> {
        self.record(Operation::Input(index))
    }

    fn record(&self, operation: Operation) -> Trace<'_> {
        let mut operations = self.operations.borrow_mut();
        operations.push(operation);
        Trace { tape: self, place: operations.len() - 1 }
    }

    /// A C99 function `void name(const double *x, double *y)` that computes `outputs`; what they do not
    /// need is left out.
    pub fn print_c(&self, name: &str, outputs: &[Trace<'_>]) -> String {
        let operations = self.operations.borrow();
        let mut needed = vec![false; operations.len()];
        for output in outputs {
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
        let mut code = format!("void {name}(const double *x, double *y)\n{{\n");
        for (place, operation) in operations.iter().enumerate().filter(|(at, _)| needed[*at]) {
            let expression = match *operation {
                Operation::Input(i) => format!("x[{i}]"),
                Operation::Constant(value) => literal(value),
                Operation::Add(a, b) => format!("v{a} + v{b}"),
                Operation::Subtract(a, b) => format!("v{a} - v{b}"),
                Operation::Multiply(a, b) => format!("v{a} * v{b}"),
                Operation::Divide(a, b) => format!("v{a} / v{b}"),
                Operation::Negate(a) => format!("-v{a}"),
                Operation::SquareRoot(a) => format!("sqrt(v{a})"),
                Operation::Sine(a) => format!("sin(v{a})"),
                Operation::Cosine(a) => format!("cos(v{a})"),
                Operation::Angle(y, x) => format!("atan2(v{y}, v{x})"),
                Operation::Select(c, a, b) => format!("v{c} >= 0.0 ? v{a} : v{b}"),
            };
            writeln!(code, "    const double v{place} = {expression};")
                .expect("writing to a String");
        }
        for (index, output) in outputs.iter().enumerate() {
            writeln!(code, "    y[{index}] = v{};", output.place).expect("writing to a String");
        }
        code.push_str("}\n");
        code
    }
}

/// A C literal that reads back as exactly `value`.
fn literal(value: f64) -> String {
    if value.is_nan() {
        "NAN".into()
    } else if value.is_infinite() {
        if value > 0.0 { "INFINITY".into() } else { "-INFINITY".into() }
    } else {
        format!("{value:?}")
    }
}

macro_rules! recorded {
    ($trait:ident, $method:ident, $operation:ident) => {
        impl<'t> $trait for Trace<'t> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.tape.record(Operation::$operation(self.place, other.place))
            }
        }
    };
}
recorded!(Add, add, Add);
recorded!(Sub, sub, Subtract);
recorded!(Mul, mul, Multiply);
recorded!(Div, div, Divide);

impl Neg for Trace<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        self.tape.record(Operation::Negate(self.place))
    }
}

impl Scalar for Trace<'_> {
    fn lift(self, value: f64) -> Self {
        self.tape.record(Operation::Constant(value))
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
        self.tape.record(Operation::SquareRoot(self.place))
    }
    fn sin_cos(self) -> (Self, Self) {
        let sine = self.tape.record(Operation::Sine(self.place));
        (sine, self.tape.record(Operation::Cosine(self.place)))
    }
    fn atan2(self, x: Self) -> Self {
        self.tape.record(Operation::Angle(self.place, x.place))
    }
    fn select(self, then: Self, otherwise: Self) -> Self {
        self.tape.record(Operation::Select(self.place, then.place, otherwise.place))
    }
}
