//! The formulas of one machine as C, for controllers.
//!
//! Every function here runs the library's own generic code on [`Trace`] and prints what was recorded:
//! straight-line C99 without branches, loops or calls but those of `math.h`. What is no formula (Newton's
//! loop, pivoting, status) belongs to the program that is built from these.
//!
//! In C, `p` is the flat vector of parameters, `q` the joints, `at` the tool point, `r` the platform's axes
//! row by row, `u` a quaternion; outputs come last. All SI, rad.

use crate::element::guide::Placement;
use crate::kinematics::{
    Gradients, Limb, Limbs, closed_form, gradients, inverse, leanings, place_limbs, system,
};
use crate::linear::{CLOSURES, Matrix6, SIX, factor, factor_pivoting, solve_transposed};
use crate::machine::{Chain, Machine};
use crate::scalar::{Scalar, Tape, Trace};
use crate::spatial::{
    Pose, RotationMatrix, Vector, angle_rates, euler_angles, euler_axes, quaternion_from_euler,
    rotation_matrix,
};
use crate::statics::{ChainMatrix, PlacedChain};

/// One printed function.
pub struct Function {
    /// Its name, as [`functions`] lists them.
    pub name: &'static str,
    /// Its parameters, as C declares them.
    pub arguments: &'static str,
    /// Its statements.
    pub body: String,
    /// How many values it keeps, each at most eight bytes of stack.
    pub values: usize,
}

/// A function being recorded: its tape, and its outputs.
struct Recording<'t> {
    tape: &'t Tape,
    outputs: Vec<(String, Trace<'t>)>,
}

impl<'t> Recording<'t> {
    fn inputs<const N: usize>(&self, name: &str) -> [Trace<'t>; N] {
        std::array::from_fn(|i| self.tape.input(format!("{name}[{i}]")))
    }

    fn many(&self, name: &str, count: usize) -> Vec<Trace<'t>> {
        (0..count).map(|i| self.tape.input(format!("{name}[{i}]"))).collect()
    }

    fn matrix(&self, name: &str) -> RotationMatrix<Trace<'t>> {
        let all = self.inputs::<9>(name);
        [0, 1, 2].map(|i| [0, 1, 2].map(|k| all[3 * i + k]))
    }

    /// Gives rows as `row[i][k]`.
    fn give_rows(&mut self, rows: &[[Trace<'t>; SIX]]) {
        for (i, row) in rows.iter().enumerate() {
            let named = row.iter().enumerate();
            self.outputs.extend(named.map(|(k, &value)| (format!("row[{i}][{k}]"), value)));
        }
    }

    /// Gives the joints of every drive in closed form and their margins, by the names given, and returns
    /// the joints.
    fn give_reach(
        &mut self,
        machine: &Machine,
        p: &[Trace<'t>],
        position: Vector<Trace<'t>>,
        rotation: &RotationMatrix<Trace<'t>>,
        [joint, margin]: [&str; 2],
    ) -> Vec<Trace<'t>> {
        let reach =
            machine.drives.iter().map(|drive| closed_form(machine, drive, p, position, rotation));
        let (joints, margins): (Vec<_>, Vec<_>) = reach.map(|r| (r.joint, r.margin)).unzip();
        self.give(joint, joints.iter().copied());
        self.give(margin, margins);
        joints
    }

    fn give(&mut self, name: &str, values: impl IntoIterator<Item = Trace<'t>>) {
        let named = values.into_iter().enumerate();
        self.outputs.extend(named.map(|(i, value)| (format!("{name}[{i}]"), value)));
    }
}

/// Records one function and prints it.
fn function(
    name: &'static str,
    arguments: &'static str,
    record: impl for<'t> FnOnce(&mut Recording<'t>),
) -> Function {
    let tape = Tape::new();
    let mut recording = Recording { tape: &tape, outputs: Vec::new() };
    record(&mut recording);
    let (body, values) = tape.print_c(&recording.outputs);
    Function { name, arguments, body, values }
}

/// What moves rigid bodies, the same for every machine.
fn bodies() -> [Function; 6] {
    [
        function("attitude", "const double angle[3], double u[4]", |f| {
            let angles = f.inputs("angle");
            f.give("u", quaternion_from_euler(angles));
        }),
        function("axes", "const double u[4], double r[9]", |f| {
            let quaternion = f.inputs("u");
            f.give("r", rotation_matrix(quaternion).into_iter().flatten());
        }),
        function("angles", "const double r[9], double angle[3]", |f| {
            let matrix = f.matrix("r");
            f.give("angle", euler_angles(&matrix));
        }),
        function("angle_axes", "const double angle[3], double axis[9]", |f| {
            let angles = f.inputs("angle");
            f.give("axis", euler_axes(angles).into_iter().flatten());
        }),
        function(
            "angle_rates",
            "const double angle[3], const double velocity[3], double rate[3]",
            |f| {
                let (angles, velocity) = (f.inputs("angle"), f.inputs("velocity"));
                f.give("rate", angle_rates(angles, velocity));
            },
        ),
        function(
            "step",
            "const double at[3], const double u[4], const double twist[6], double to[3], \
             double turned[4]",
            |f| {
                let mut pose = Pose { position: f.inputs("at"), rotation: f.inputs("u") };
                pose.step(f.inputs("twist"));
                f.give("to", pose.position);
                f.give("turned", pose.rotation);
            },
        ),
    ]
}

/// `constant + slope * length of strut` of one parameter, SI.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Which parameter.
    pub parameter: usize,
    /// The same at every pose.
    pub constant: f64,
    /// Per metre of the present length of a strut, and which.
    pub slope: Option<(f64, usize)>,
}

/// What is known of a machine's parameters.
#[derive(Clone, Debug, Default)]
pub struct Shifts {
    /// Whatever the temperatures and the wrench.
    pub always: Vec<Term>,
    /// Per kelvin of each part.
    pub per_kelvin: Vec<Vec<Term>>,
    /// Per load: compliances.
    pub compliance: Vec<Term>,
    /// Of two parameters that give way under each other's load: the same at every pose.
    pub shared: Vec<(usize, usize, f64)>,
    /// Whether limbs give way, by what the machine says of them.
    pub limbs: bool,
}

impl Shifts {
    /// The limbs that give way.
    fn chains<'m>(&self, machine: &'m Machine) -> &'m [Chain] {
        if self.limbs { &machine.chains } else { &[] }
    }

    /// The parameters that give way, in the order of `load`.
    fn loaded(&self, machine: &Machine) -> Vec<usize> {
        let own = self.compliance.iter().map(|term| term.parameter);
        let shared = self.shared.iter().flat_map(|&(one, other, _)| [one, other]);
        let of_limbs = self.chains(machine).iter().flat_map(|chain| &chain.parameters);
        let mut parameters = Vec::new();
        for parameter in own.chain(shared).chain(of_limbs.copied()) {
            if !parameters.contains(&parameter) {
                parameters.push(parameter);
            }
        }
        parameters
    }

    /// The matrices of the limbs that give way, at a pose.
    fn limbs<'t>(
        &self,
        machine: &Machine,
        (p, q): (&[Trace<'t>], &[Trace<'t>]),
        at: Placement<'_, Trace<'t>>,
    ) -> Vec<ChainMatrix<Trace<'t>>> {
        let matrix = |chain| PlacedChain::new(machine, chain, p, q, at).compliance();
        self.chains(machine).iter().map(matrix).collect()
    }

    /// Parameters `p` shifted; `load` as [`Shifts::loaded`], `matrices` as [`Shifts::limbs`].
    fn apply<'t>(
        &self,
        machine: &Machine,
        (limbs, matrices): (&Limbs<Trace<'t>>, &[ChainMatrix<Trace<'t>>]),
        p: &[Trace<'t>],
        rise: &[Trace<'t>],
        load: &[Trace<'t>],
    ) -> Vec<Trace<'t>> {
        let loaded = self.loaded(machine);
        let one = p[0].lift(1.0);
        let mut shifted = p.to_vec();
        let mut add = |terms: &[Term], factor: &dyn Fn(&Term) -> Trace<'t>| {
            for term in terms {
                let mut value = one.lift(term.constant);
                if let Some((slope, strut)) = term.slope {
                    value = value + one.lift(slope) * limbs[strut].length;
                }
                shifted[term.parameter] = shifted[term.parameter] + factor(term) * value;
            }
        };
        add(&self.always, &|_| one);
        for (terms, &rise) in self.per_kelvin.iter().zip(rise) {
            add(terms, &|_| rise);
        }
        let at = |parameter: usize| loaded.iter().position(|&k| k == parameter).unwrap_or(0);
        add(&self.compliance, &|term| load[at(term.parameter)]);
        for &(first, second, value) in &self.shared {
            let value = one.lift(value);
            shifted[first] = shifted[first] + value * load[at(second)];
            shifted[second] = shifted[second] + value * load[at(first)];
        }
        for (chain, matrix) in self.chains(machine).iter().zip(matrices) {
            for (row, &moved) in matrix.iter().zip(&chain.parameters) {
                for (&value, &by) in row.iter().zip(&chain.parameters) {
                    shifted[moved] = shifted[moved] + value * load[at(by)];
                }
            }
        }
        shifted
    }
}

/// The functions of a machine.
///
/// | function | gives |
/// |---|---|
/// | `attitude`, `axes`, `angles` | quaternion of angles a, b, c; matrix of a quaternion; angles of a matrix |
/// | `angle_axes`, `angle_rates` | instantaneous axes of the three angles; their rates for an angular velocity |
/// | `step` | a pose moved by a twist |
/// | `closed_form` | each drive's joint, and a number that is not negative where its strut reaches |
/// | `place` | base-side centre, arm and length of every strut, seven numbers each |
/// | `squared` | rows and residuals of the squared closures of placed struts |
/// | `first_order` | rows, residuals and derivatives to the joints of the closures themselves |
/// | `load` | loads on what gives way, of the multipliers of the closures |
/// | `shifted` | the parameters with all that is known, from temperature rises and loads |
/// | `lean` | where joints have limits: how far struts lean beyond them |
/// | `compliance` | more closures than freedoms: how far closures open per force in closures |
/// | `compensated` | where the inverse is a closed form: nominal and compensated joints in one go, and by how much rounding errors may have grown |
pub fn functions(machine: &Machine, shifts: &Shifts) -> Vec<Function> {
    let (parameters, joints) = (machine.parameters.len(), machine.drives.len());
    let count = machine.closure_count();
    let loaded = shifts.loaded(machine);
    let mut all = Vec::from(bodies());
    all.push(function(
        "closed_form",
        "const double *p, const double at[3], const double r[9], double *q, double *margin",
        |f| {
            let (p, at, r) = (f.many("p", parameters), f.inputs("at"), f.matrix("r"));
            f.give_reach(machine, &p, at, &r, ["q", "margin"]);
        },
    ));
    all.push(function("place", "const double *p, const double *q, double *limb", |f| {
        let (p, q) = (f.many("p", parameters), f.many("q", joints));
        let limbs = placed(machine, &p, &q);
        for (i, limb) in limbs[..machine.struts.len()].iter().enumerate() {
            let values = [&limb.base[..], &limb.arm, &[limb.length]].concat();
            let named = values.into_iter().enumerate();
            f.outputs.extend(named.map(|(k, v)| (format!("limb[{}]", 7 * i + k), v)));
        }
    }));
    all.push(function(
        "squared",
        "const double *p, const double *limb, const double at[3], const double r[9], \
         double row[6][6], double residual[6]",
        |f| {
            let p = f.many("p", parameters);
            let mut limbs = [Limb::zero(p[0]); CLOSURES];
            for (i, limb) in limbs[..machine.struts.len()].iter_mut().enumerate() {
                let at = |k: usize| f.tape.input(format!("limb[{}]", 7 * i + k));
                let vector = |from: usize| [0, 1, 2].map(|k| at(from + k));
                *limb = Limb { base: vector(0), arm: vector(3), length: at(6) };
            }
            let (rotation, position) = (f.matrix("r"), f.inputs("at"));
            let (rows, residuals) = system::<_, true>(machine, &p, &limbs, &rotation, position);
            f.give_rows(&rows[..count]);
            f.give("residual", residuals[..count].iter().copied());
        },
    ));
    all.push(function(
        "first_order",
        "const double *p, const double *q, const double at[3], const double r[9], \
         double row[][6], double *residual, double *to_joint",
        |f| {
            let (p, q) = (f.many("p", parameters), f.many("q", joints));
            let gradients =
                gradients::<_, CLOSURES>(machine, &p, &q, f.inputs("at"), &f.matrix("r"));
            f.give_rows(&gradients.to_twist[..count]);
            f.give("residual", gradients.residuals[..count].iter().copied());
            f.give("to_joint", gradients.to_joint[..count].iter().copied());
        },
    ));
    all.push(function(
        "load",
        "const double *p, const double *q, const double at[3], const double r[9], \
         const double *multiplier, double *load",
        |f| {
            let (p, q) = (f.many("p", parameters), f.many("q", joints));
            let gradients =
                gradients::<_, CLOSURES>(machine, &p, &q, f.inputs("at"), &f.matrix("r"));
            let multipliers = f.many("multiplier", count);
            f.give("load", loads(machine, &loaded, &gradients, &multipliers));
        },
    ));
    // The matrix of a limb depends on the pose; without one the function knows none.
    let arguments = if shifts.chains(machine).is_empty() {
        "const double *p, const double *q, const double *rise, const double *load, double *to"
    } else {
        "const double *p, const double *q, const double at[3], const double r[9], \
         const double *rise, const double *load, double *to"
    };
    all.push(function("shifted", arguments, |f| {
        let (p, q) = (f.many("p", parameters), f.many("q", joints));
        let matrices = if shifts.chains(machine).is_empty() {
            Vec::new()
        } else {
            let (at, r) = (f.inputs("at"), f.matrix("r"));
            shifts.limbs(machine, (&p, &q), (&r, at))
        };
        let rise = f.many("rise", shifts.per_kelvin.len());
        let load = f.many("load", loaded.len());
        let limbs = placed(machine, &p, &q);
        f.give("to", shifts.apply(machine, (&limbs, &matrices), &p, &rise, &load));
    }));
    if machine.limited {
        all.push(function(
            "lean",
            "const double *p, const double *q, const double at[3], const double r[9], double *beyond",
            |f| {
                let (p, q) = (f.many("p", parameters), f.many("q", joints));
                let leanings = leanings(machine, &p, &q, &f.matrix("r"), f.inputs("at"));
                f.give("beyond", leanings.into_iter().map(|(_, _, beyond)| beyond));
            },
        ));
    }
    if machine.is_overconstrained() {
        all.push(compliance(machine));
    } else if machine.has_direct_inverse() && !loaded.is_empty() {
        all.push(compensated(machine, shifts));
    }
    all
}

/// How far the closures that carry open per force in them: what they themselves give way, and what the
/// parameters do that they read.
fn compliance(machine: &Machine) -> Function {
    let (parameters, joints) = (machine.parameters.len(), machine.drives.len());
    let carrying: Vec<usize> = machine.carrying().collect();
    function(
        "compliance",
        "const double *p, const double *q, const double at[3], const double r[9], \
         double *compliance",
        |f| {
            let (p, q) = (f.many("p", parameters), f.many("q", joints));
            let gradients =
                gradients::<_, CLOSURES>(machine, &p, &q, f.inputs("at"), &f.matrix("r"));
            let zero = f.tape.constant(0.0);
            let mut sums = [[zero; CLOSURES]; CLOSURES];
            for &(parameter, compliance) in &machine.parameter_compliance {
                let column = gradients.to_parameter(machine, parameter);
                for &i in &carrying {
                    let scaled = column[i] * zero.lift(compliance);
                    for &k in &carrying {
                        sums[i][k] = scaled.mul_add(column[k], sums[i][k]);
                    }
                }
            }
            for &i in &carrying {
                sums[i][i] = sums[i][i] + zero.lift(machine.closure_compliance[i]);
            }
            f.give(
                "compliance",
                carrying
                    .iter()
                    .flat_map(|&i| carrying.iter().map(move |&k| (i, k)))
                    .map(|(i, k)| sums[i][k]),
            );
        },
    )
}

/// Nominal and compensated joints of a machine whose inverse is a closed form, straight through: what the
/// two have in common is computed once, and the rows are eliminated in the order that serves at home.
fn compensated(machine: &Machine, shifts: &Shifts) -> Function {
    let home = inverse(machine, &machine.nominal, &machine.home);
    let r = rotation_matrix(machine.home.rotation);
    let at = machine.home.position;
    let at_home = gradients::<_, CLOSURES>(machine, &machine.nominal, &home.joints, at, &r);
    let order = factor_pivoting(&square(machine, &at_home, 0.0)).order;
    function(
        "compensated",
        "const double *p, const double at[3], const double r[9], const double *rise, \
         const double wrench[6], double *nominal, double *margin, double *q, double *left, \
         double *growth",
        |f| {
            let p = f.many("p", machine.parameters.len());
            let (at, r) = (f.inputs("at"), f.matrix("r"));
            let rise = f.many("rise", shifts.per_kelvin.len());
            let wrench: [Trace<'_>; SIX] = f.inputs("wrench");
            let nominal = f.give_reach(machine, &p, at, &r, ["nominal", "margin"]);
            let gradients = gradients::<_, CLOSURES>(machine, &p, &nominal, at, &r);
            let rows = square(machine, &gradients, p[0]);
            let mut factors = order.map(|row| rows[row]);
            factor(&mut factors);
            let placed_multipliers = solve_transposed(&factors, &wrench.map(|value| -value));
            let mut multipliers = placed_multipliers;
            for (k, row) in order.into_iter().enumerate() {
                multipliers[row] = placed_multipliers[k];
            }
            let load = loads(machine, &shifts.loaded(machine), &gradients, &multipliers);
            let matrices = shifts.limbs(machine, (&p, &nominal), (&r, at));
            let limbs = placed(machine, &p, &nominal);
            let shifted = shifts.apply(machine, (&limbs, &matrices), &p, &rise, &load);
            f.give_reach(machine, &shifted, at, &r, ["q", "left"]);
            let mut growth = f.tape.constant(0.0);
            for i in 1..SIX {
                for k in 0..i {
                    growth = factors[i][k].square_plus(growth);
                }
            }
            f.give("growth", [growth]);
        },
    )
}

/// The rows of as many closures as freedoms, with identity rows for what the frame holds.
fn square<S: Scalar>(machine: &Machine, gradients: &Gradients<S, CLOSURES>, of: S) -> Matrix6<S> {
    let mut rows = [[of.lift(0.0); SIX]; SIX];
    let count = machine.closure_count();
    rows[..count].copy_from_slice(&gradients.to_twist[..count]);
    for (number, &freedom) in machine.held.iter().enumerate() {
        rows[count + number][freedom] = of.lift(1.0);
    }
    rows
}

/// Loads on parameters by virtual work, of the multipliers of the closures.
fn loads<'t>(
    machine: &Machine,
    parameters: &[usize],
    gradients: &Gradients<Trace<'t>, CLOSURES>,
    multipliers: &[Trace<'t>],
) -> Vec<Trace<'t>> {
    let load = |&parameter: &usize| {
        let column = gradients.to_parameter(machine, parameter);
        let mut load = multipliers[0].lift(0.0);
        for (&multiplier, &derivative) in multipliers.iter().zip(&column) {
            load = load + multiplier * derivative;
        }
        load
    };
    parameters.iter().map(load).collect()
}

fn placed<S: Scalar>(machine: &Machine, p: &[S], q: &[S]) -> Limbs<S> {
    let mut limbs = [Limb::zero(p[0]); CLOSURES];
    place_limbs(machine, p, q, &mut limbs);
    limbs
}
