//! Optimum, rank, reach, roots of rounding, status, and what is refused.

use super::*;
use nalgebra::DMatrix;

type Function<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

/// A residual and its slope, row after row.
struct Functions<'a> {
    size: usize,
    residual: Function<'a>,
    slope: Function<'a>,
    normal: bool,
}

impl Problem for Functions<'_> {
    fn size(&self) -> usize {
        self.size
    }

    fn cost(&mut self, values: &[f64]) -> Option<f64> {
        Some(square_sum(&(self.residual)(values))).filter(|cost| cost.is_finite())
    }

    fn linearise(&mut self, values: &[f64], linear: &mut Linear) -> bool {
        let (residual, slope) = ((self.residual)(values), (self.slope)(values));
        if self.normal {
            let slope = DMatrix::from_row_slice(residual.len(), self.size, &slope);
            let gradient = slope.tr_mul(&nalgebra::DVector::from_column_slice(&residual));
            return linear.set_normal(&slope.tr_mul(&slope), gradient.as_slice(), residual.len());
        }
        linear.set_dense_rows(&slope, &residual)
    }
}

fn solved(residual: Function, slope: Function, start: &[f64], options: &Options) -> Solution {
    let mut problem = Functions { size: start.len(), residual, slope, normal: false };
    minimise(&mut problem, start, None, options).unwrap()
}

fn valley(x: &[f64]) -> Vec<f64> {
    vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
}

fn valley_slope(x: &[f64]) -> Vec<f64> {
    vec![-20.0 * x[0], 10.0, -1.0, 0.0]
}

/// Readings of a sum of two decays, which are not quite that.
fn decays(x: &[f64]) -> Vec<f64> {
    let reading = |t: f64| 2.0 * (-t).exp() + (-3.0 * t).exp() + 0.01 * (40.0 * t).sin();
    let times = (0..30).map(|k| f64::from(k) / 10.0);
    times.map(|t| x[0] * (-x[1] * t).exp() + x[2] * (-x[3] * t).exp() - reading(t)).collect()
}

fn decays_slope(x: &[f64]) -> Vec<f64> {
    let row = |k: i32| {
        let t = f64::from(k) / 10.0;
        let (a, b) = ((-x[1] * t).exp(), (-x[3] * t).exp());
        [a, -x[0] * t * a, b, -x[2] * t * b]
    };
    (0..30).flat_map(row).collect()
}

const START: [f64; 4] = [1.0, 0.5, 1.0, 4.0];

#[test]
fn a_curved_valley_ends_in_its_root() {
    let solution = solved(&valley, &valley_slope, &[-1.2, 1.0], &Options::default());
    assert!(solution.status.converged());
    assert!(solution.values.iter().all(|value| (value - 1.0).abs() < 1e-12));
    assert!(solution.cost < 1e-24);
    let again = solved(&valley, &valley_slope, &[1.0, 1.0], &Options::default());
    assert_eq!((again.status, again.evaluations), (Status::Gradient, 1));
}

#[test]
fn normal_equations_go_the_same_way() {
    let dense = solved(&decays, &decays_slope, &START, &Options::default());
    let mut problem = Functions { size: 4, residual: &decays, slope: &decays_slope, normal: true };
    let normal = minimise(&mut problem, &START, None, &Options::default()).unwrap();
    assert!(dense.status.converged() && normal.status.converged());
    assert!((dense.cost - normal.cost).abs() < 1e-12 * dense.cost);
    for (a, b) in dense.values.iter().zip(&normal.values) {
        assert!((a - b).abs() < 1e-9);
    }
}

#[test]
fn what_no_equation_sees_stays() {
    // Only the sum of the first two counts; the third is seen by nothing.
    let residual = |x: &[f64]| vec![x[0] + x[1] - 3.0, 2.0 * (x[0] + x[1]) - 6.0, 0.0];
    let slope = |_: &[f64]| vec![1.0, 1.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0];
    let solution = solved(&residual, &slope, &[0.0, 1.0, 7.0], &Options::default());
    assert!(solution.status.converged());
    assert_eq!(solution.values[2], 7.0);
    assert!((solution.values[0] - 1.0).abs() < 1e-12 && (solution.values[1] - 2.0).abs() < 1e-12);
}

#[test]
fn fewer_equations_than_unknowns_are_met() {
    let residual = |x: &[f64]| vec![x[0] * x[0] + x[1] - 2.0];
    let slope = |x: &[f64]| vec![2.0 * x[0], 1.0];
    let solution = solved(&residual, &slope, &[1.0, 5.0], &Options::default());
    assert!(solution.status.converged());
    assert!(solution.cost < 1e-24);
    let nothing = solved(&|_| vec![1.0], &|_| vec![], &[], &Options::default());
    assert_eq!((nothing.status, nothing.cost), (Status::Gradient, 1.0));
}

#[test]
fn a_model_that_ends_is_not_left() {
    let residual = |x: &[f64]| vec![(1.0 - x[0]).ln() + 4.0];
    let slope = |x: &[f64]| vec![-1.0 / (1.0 - x[0])];
    for first_radius in [1e-3, 1.0, 1e3, f64::INFINITY] {
        let options = Options { first_radius, ..Options::default() };
        let solution = solved(&residual, &slope, &[-50.0], &options);
        assert!(solution.status.converged());
        assert!((solution.values[0] - (1.0 - (-4.0_f64).exp())).abs() < 1e-12);
    }
}

#[test]
fn a_first_step_without_bounds_solves_what_is_linear() {
    let residual = |x: &[f64]| vec![x[0] - 1e6, 1e-3 * x[1] + x[0] - 5.0, x[1] - 1.0];
    let slope = |_: &[f64]| vec![1.0, 0.0, 1.0, 1e-3, 0.0, 1.0];
    let options = Options { first_radius: f64::INFINITY, ..Options::default() };
    let solution = solved(&residual, &slope, &[0.0, 0.0], &options);
    let bounded = solved(&residual, &slope, &[0.0, 0.0], &Options::default());
    assert!(solution.status.converged() && solution.iterations <= 3);
    assert!(bounded.iterations > solution.iterations);
    assert!((bounded.cost - solution.cost).abs() < 1e-12 * solution.cost);
}

#[test]
fn a_root_of_rounding_ends() {
    // Small differences of large numbers, unknowns that are nothing at the root.
    let long = |k: usize| 1e3 + 37.0 * k as f64;
    let length = move |k: usize, x: f64| ((long(k) + x) * (long(k) + x) + 1.0).sqrt();
    let residual = move |x: &[f64]| -> Vec<f64> {
        let moved = |k: usize| x[k % 3] * (1.0 + 0.1 * k as f64) + 0.3 * x[(k + 1) % 3];
        (0..24).map(|k| length(k, moved(k)) - length(k, 0.0)).collect()
    };
    let slope = move |x: &[f64]| -> Vec<f64> {
        let row = |k: usize| {
            let mut row = [0.0; 3];
            row[k % 3] += 1.0 + 0.1 * k as f64;
            row[(k + 1) % 3] += 0.3;
            let moved: f64 = row.iter().zip(x).map(|(a, b)| a * b).sum();
            row.map(|part| part * (long(k) + moved) / length(k, moved))
        };
        (0..24).flat_map(row).collect()
    };
    for start in [[1e-3, -2e-3, 5e-4], [3e-6, 1e-6, -2e-6], [0.5, 0.1, -0.2]] {
        let solution = solved(&residual, &slope, &start, &Options::default());
        assert!(solution.status.converged(), "{:?}", solution.status);
        assert!(solution.evaluations < 200, "{}", solution.evaluations);
        assert!(solution.values.iter().all(|value| value.abs() < 1e-12));
        let told = Options { rounding: 1e-24, ..Options::default() };
        assert!(solved(&residual, &slope, &start, &told).evaluations < 10);
    }
}

#[test]
fn a_wrong_slope_stalls() {
    let wrong = |x: &[f64]| valley_slope(x).into_iter().map(|value| -value).collect();
    let solution = solved(&valley, &wrong, &[-1.2, 1.0], &Options::default());
    assert_eq!(solution.status, Status::Stalled);
    let ends = |x: &[f64]| if x[0] == -1.2 { valley_slope(x) } else { vec![f64::NAN; 4] };
    let solution = solved(&valley, &ends, &[-1.2, 1.0], &Options::default());
    assert_eq!((solution.status, solution.values[0]), (Status::Stalled, -1.2));
}

#[test]
fn what_cannot_be_iterated_on_is_refused() {
    let refusal = |start: &[f64], scale: Option<&[f64]>, options: &Options| {
        let mut problem =
            Functions { size: 2, residual: &valley, slope: &valley_slope, normal: false };
        minimise(&mut problem, start, scale, options).map(|_| ()).unwrap_err()
    };
    let options = Options::default();
    assert_eq!(refusal(&[f64::NAN, 0.0], None, &options), Refusal::Start);
    assert_eq!(refusal(&[0.0], None, &options), Refusal::Scale);
    assert_eq!(refusal(&[0.0, 0.0], Some(&[1.0]), &options), Refusal::Scale);
    assert_eq!(refusal(&[0.0, 0.0], Some(&[1.0, 0.0]), &options), Refusal::Scale);
    let none = Options { first_radius: 0.0, ..options };
    assert_eq!(refusal(&[0.0, 0.0], None, &none), Refusal::Radius);
}

/// The decays with gradients alone, which may be wrong, and a count of whole linear models.
struct Counted {
    gradients: Option<f64>,
    models: usize,
}

impl Problem for Counted {
    fn size(&self) -> usize {
        4
    }

    fn cost(&mut self, values: &[f64]) -> Option<f64> {
        Some(square_sum(&decays(values)))
    }

    fn linearise(&mut self, values: &[f64], linear: &mut Linear) -> bool {
        self.models += 1;
        let slope = DMatrix::from_row_slice(30, 4, &decays_slope(values));
        let gradient = slope.tr_mul(&nalgebra::DVector::from_vec(decays(values)));
        linear.set_normal(&slope.tr_mul(&slope), gradient.as_slice(), 30)
    }

    fn gradient(&mut self, values: &[f64], gradient: &mut [f64]) -> bool {
        let Some(factor) = self.gradients else { return false };
        let slope = DMatrix::from_row_slice(30, 4, &decays_slope(values));
        let exact = slope.tr_mul(&nalgebra::DVector::from_vec(decays(values)));
        gradient.iter_mut().zip(exact.iter()).for_each(|(value, part)| *value = factor * part);
        true
    }

    fn linearises_last(&self) -> bool {
        false
    }
}

#[test]
fn chords_end_where_whole_models_do_and_ask_for_fewer() {
    let ended = |gradients: Option<f64>| {
        let mut problem = Counted { gradients, models: 0 };
        let solution = minimise(&mut problem, &START, None, &Options::default()).unwrap();
        assert!(solution.status.converged());
        (solution, problem.models)
    };
    let (whole, models) = ended(None);
    let (chords, fewer) = ended(Some(1.0));
    assert!(fewer < models, "{fewer} of {models}");
    // A gradient that is far off contracts nothing: whole models take over.
    let (wrong, _) = ended(Some(1e6));
    for solution in [&chords, &wrong] {
        assert!((solution.cost - whole.cost).abs() < 1e-12 * whole.cost);
        for (a, b) in solution.values.iter().zip(&whole.values) {
            assert!((a - b).abs() < 1e-9);
        }
    }
}
