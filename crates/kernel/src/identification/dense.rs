//! The dense algebra of least squares: a linear model compressed to a triangle, and its singular values.
//!
//! G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed. (2013): 5.2.2 Householder's triangle, 5.3.2 the normal
//! equations, 8.6.3 Jacobi's rotations from one side.

use crate::dispatch::{Work, dispatch};
use crate::scalar::Real;
use nalgebra::{DMatrix, DVector};

/// A triangle with unit columns is trusted where the norm of its inverse is below this: half of all digits.
const SOUND: f64 = 1e8;
/// The same where the triangle is that of the normal equations, whose digits go with the square of it.
const SOUND_NORMAL: f64 = 1e5;
/// The least pivot of the normal equations with unit diagonal, which sets how many of 16 digits remain.
const LEAST_PIVOT: f64 = 1e-8;
/// Sweeps of Jacobi's rotations; six to ten do, the rest is safety.
const SWEEPS: usize = 60;
const LANES: usize = 8;

/// |residual + slope s|^2 about a point, as a function of the step s (n,), compressed to an upper triangle.
#[derive(Clone, Debug)]
pub struct Linear {
    /// (n, n) upper triangle R of slope = Q R.
    pub factor: DMatrix<f64>,
    /// (n,) Q^T residual.
    pub turned: DVector<f64>,
    /// (n,) norms of the slope's columns.
    pub columns: DVector<f64>,
    /// (n,) slope^T residual.
    pub gradient: DVector<f64>,
    /// How many equations there are: rounding grows with them.
    pub rows: usize,
    /// Whether R is so far from singular that a back substitution gives the step.
    pub trusted: bool,
    /// Whether R is that of normal equations, and so far from singular that they serve for another gradient.
    pub(super) of_normal: bool,
}

impl Linear {
    /// A model of `size` unknowns without equations.
    pub fn new(size: usize) -> Self {
        Linear {
            factor: DMatrix::zeros(size, size),
            turned: DVector::zeros(size),
            columns: DVector::zeros(size),
            gradient: DVector::zeros(size),
            rows: 0,
            trusted: false,
            of_normal: false,
        }
    }

    /// From a slope (m, n) and a residual (m,), m and n as they come, by Householder reflections.
    pub fn from_dense(slope: &DMatrix<f64>, residual: &[f64]) -> Self {
        let mut linear = Linear::new(slope.ncols());
        linear.set_dense(slope.clone(), residual);
        linear
    }

    /// As [`Linear::from_dense`], in place; the slope is used up. False where something is not finite or too large to be
    /// squared.
    pub fn set_dense(&mut self, mut slope: DMatrix<f64>, residual: &[f64]) -> bool {
        let (rows, size) = slope.shape();
        assert_eq!(residual.len(), rows, "one residual for each row of the slope");
        (self.rows, self.of_normal) = (rows, false);
        if rows == 0 {
            *self = Linear::new(size);
            return true;
        }
        self.columns = DVector::zeros(size);
        self.gradient = DVector::zeros(size);
        for (j, column) in slope.as_mut_slice().chunks_exact_mut(rows).enumerate() {
            self.columns[j] = norm(column);
            self.gradient[j] = dot(column, residual);
            // Unit columns: units of the unknowns then neither overflow nor count.
            if self.columns[j] > 0.0 {
                column.iter_mut().for_each(|value| *value /= self.columns[j]);
            }
        }
        let mut turned = residual.to_vec();
        let diagonal = triangle(slope.as_mut_slice(), rows, size, &mut turned);
        let kept = rows.min(size);
        self.turned = DVector::from_fn(size, |i, _| if i < kept { turned[i] } else { 0.0 });
        self.factor = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
            _ if i >= kept => 0.0,
            std::cmp::Ordering::Less => slope[(i, j)],
            std::cmp::Ordering::Equal => diagonal[i],
            std::cmp::Ordering::Greater => 0.0,
        });
        self.trusted = inverse_norm(&self.factor) < SOUND;
        self.unscale();
        self.finite()
    }

    /// As [`Linear::set_dense`], from the slope's rows one after another.
    pub fn set_dense_rows(&mut self, slope: &[f64], residual: &[f64]) -> bool {
        let size = self.turned.len();
        self.set_dense(DMatrix::from_row_slice(residual.len(), size, slope), residual)
    }

    /// From the normal equations of `rows` equations: `normal` (n, n) = slope^T slope, of which the upper triangle is
    /// read, and `gradient` (n,) = slope^T residual. None where a pivot is so small that digits are lost; then
    /// [`Linear::from_dense`] still has them.
    pub fn from_normal(normal: &DMatrix<f64>, gradient: &[f64], rows: usize) -> Option<Self> {
        let mut linear = Linear::new(gradient.len());
        linear.set_normal(normal, gradient, rows).then_some(linear)
    }

    /// As [`Linear::from_normal`], in place; false in place of none.
    pub fn set_normal(&mut self, normal: &DMatrix<f64>, gradient: &[f64], rows: usize) -> bool {
        let size = gradient.len();
        assert_eq!(normal.shape(), (size, size), "a normal matrix for the gradient");
        // Column after column, of which the lower triangle then is what is read.
        let turned = normal.transpose();
        self.set_normal_rows(turned.as_slice(), size, gradient, rows)
    }

    /// As [`Linear::set_normal`], from rows of `stride` numbers one after another.
    pub fn set_normal_rows(
        &mut self,
        normal: &[f64],
        stride: usize,
        gradient: &[f64],
        rows: usize,
    ) -> bool {
        let (size, given) = (gradient.len(), stride);
        (self.rows, self.of_normal) = (rows, false);
        for (i, column) in self.columns.iter_mut().enumerate() {
            *column = normal[i * given + i].sqrt();
        }
        self.gradient.copy_from_slice(gradient);
        if !self.columns.iter().all(|&length| length > 0.0) {
            return false;
        }
        let stride = (size + 1).next_multiple_of(LANES);
        let mut table = vec![0.0; size * stride];
        let shares: Vec<f64> = self.columns.iter().map(|length| 1.0 / length).collect();
        for (i, row) in table.chunks_exact_mut(stride).enumerate() {
            let (own, normal) = (shares[i], &normal[i * given + i..i * given + size]);
            for ((cell, value), share) in row[i..size].iter_mut().zip(normal).zip(&shares[i..]) {
                *cell = value * own * share;
            }
            row[size] = gradient[i] * own;
        }
        let mut inverse_norm = f64::INFINITY;
        dispatch(Triangle { table: &mut table, size, stride, inverse_norm: &mut inverse_norm });
        self.trusted = inverse_norm < SOUND_NORMAL;
        if !self.trusted {
            return false;
        }
        for (j, column) in self.factor.as_mut_slice().chunks_exact_mut(size.max(1)).enumerate() {
            let length = self.columns[j];
            for (cell, row) in column[..=j].iter_mut().zip(table.chunks_exact(stride)) {
                *cell = row[j] * length;
            }
        }
        for (turned, row) in self.turned.iter_mut().zip(table.chunks_exact(stride)) {
            *turned = row[size];
        }
        self.of_normal = self.finite();
        self.of_normal
    }

    /// Another gradient (n,) in the same triangle.
    pub(super) fn set_gradient(&mut self, gradient: &[f64]) {
        self.gradient.copy_from_slice(gradient);
        self.turned.copy_from_slice(gradient);
        eliminate_transposed(&self.factor, self.turned.as_mut_slice());
    }

    /// Length |D p| of the step that makes the model least with another gradient (n,) in the same triangle, which is
    /// regular.
    pub(super) fn way_with(&self, gradient: &[f64], axes: &[f64]) -> f64 {
        let mut step = gradient.to_vec();
        eliminate_transposed(&self.factor, &mut step);
        eliminate(&self.factor, &mut step);
        step.iter_mut().zip(axes).for_each(|(value, axis)| *value *= axis);
        norm(&step)
    }

    /// R of the slope itself, from R of its unit columns.
    fn unscale(&mut self) {
        for (mut column, norm) in self.factor.column_iter_mut().zip(self.columns.iter()) {
            column *= *norm;
        }
    }

    fn finite(&self) -> bool {
        let parts = [self.factor.as_slice(), self.turned.as_slice(), self.columns.as_slice()];
        let all = parts.into_iter().chain([self.gradient.as_slice()]).flatten();
        all.into_iter().all(|value| value.is_finite())
    }

    /// The step (n,) that makes the model least, by back substitution.
    pub(super) fn whole(&self) -> Vec<f64> {
        let mut step: Vec<f64> = self.turned.iter().map(|value| -value).collect();
        eliminate(&self.factor, &mut step);
        step
    }

    /// |slope step|.
    pub(super) fn along(&self, step: &[f64]) -> f64 {
        let mut moved = vec![0.0; step.len()];
        for (j, value) in step.iter().enumerate() {
            for i in 0..=j {
                moved[i] += self.factor[(i, j)] * value;
            }
        }
        norm(&moved)
    }
}

/// The triangle R of normal equations R^T R with unit diagonal, row by row in lanes; the column after the last, a
/// right-hand side g, becomes R^-T g. The norm of the inverse stays infinite where a pivot is too small.
struct Triangle<'a> {
    table: &'a mut [f64],
    size: usize,
    stride: usize,
    inverse_norm: &'a mut f64,
}

impl Work for Triangle<'_> {
    #[inline(always)]
    fn run<S: Real>(self) {
        let Triangle { table, size, stride, inverse_norm } = self;
        for k in 0..size {
            let (head, tail) = table.split_at_mut((k + 1) * stride);
            let row = &mut head[k * stride..];
            if !(row[k] >= LEAST_PIVOT) {
                return;
            }
            let share = S::splat(1.0 / row[k].sqrt());
            for cells in row[k / S::WIDTH * S::WIDTH..].chunks_exact_mut(S::WIDTH) {
                (S::load(cells) * share).store(cells);
            }
            for (other, i) in tail.chunks_exact_mut(stride).zip(k + 1..size) {
                take_away::<S>(other, row, row[i], i);
            }
        }
        let mut inverse = vec![0.0; size * stride];
        let mut sum = 0.0;
        for i in (0..size).rev() {
            let (head, tail) = inverse.split_at_mut((i + 1) * stride);
            let own = &mut head[i * stride..];
            let row = &table[i * stride..(i + 1) * stride];
            own[i] = 1.0;
            for (other, j) in tail.chunks_exact(stride).zip(i + 1..size) {
                take_away::<S>(own, other, row[j], j);
            }
            let share = S::splat(1.0 / row[i]);
            for cells in own.chunks_exact_mut(S::WIDTH) {
                (S::load(cells) * share).store(cells);
            }
            sum += square_sum(own);
        }
        *inverse_norm = if sum.is_finite() { sum.sqrt() } else { f64::INFINITY };
    }
}

/// Takes `factor` times `other` from `row`, from the lanes that column `from` is in.
#[inline(always)]
fn take_away<S: Real>(row: &mut [f64], other: &[f64], factor: f64, from: usize) {
    let (first, factor) = (from / S::WIDTH * S::WIDTH, S::splat(-factor));
    let cells = row[first..].chunks_exact_mut(S::WIDTH);
    for (cells, other) in cells.zip(other[first..].chunks_exact(S::WIDTH)) {
        factor.mul_add(S::load(other), S::load(cells)).store(cells);
    }
}

/// The singular values of a triangle in other units of the unknowns: R D^-1 = U S V^T.
pub(super) struct Singular {
    /// (n,) in no order; zero where it is rounding only.
    pub values: Vec<f64>,
    /// (n,) U^T turned.
    pub turned: Vec<f64>,
    /// Rows of n: values times the right vectors, V S.
    spanned: Vec<f64>,
}

impl Singular {
    /// By rotations of the rows of R D^-1 until they are at right angles.
    pub fn new(linear: &Linear, axes: &[f64]) -> Self {
        let size = axes.len();
        let mut order: Vec<(f64, usize)> = (0..size)
            .map(|i| {
                let row = (i..size).map(|j| (linear.factor[(i, j)] / axes[j]).abs());
                (row.fold(0.0, f64::max), i)
            })
            .collect();
        // Long rows first: fewer sweeps.
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let largest = order.first().map_or(0.0, |first| first.0);
        let unit = if largest > 0.0 { largest } else { 1.0 };
        let mut spanned = vec![0.0; size * size];
        for (row, &(_, i)) in spanned.chunks_exact_mut(size.max(1)).zip(&order) {
            (i..size).for_each(|j| row[j] = linear.factor[(i, j)] / axes[j] / unit);
        }
        let mut turned: Vec<f64> = order.iter().map(|&(_, i)| linear.turned[i]).collect();
        for _ in 0..SWEEPS {
            let mut turns = 0;
            for i in 0..size {
                let (head, tail) = spanned.split_at_mut((i + 1) * size);
                let first = &mut head[i * size..];
                for j in i + 1..size {
                    let second = &mut tail[(j - i - 1) * size..][..size];
                    if let Some((c, s)) = rotation(first, second) {
                        rotate(first, second, c, s);
                        let (a, b) = (turned[i], turned[j]);
                        (turned[i], turned[j]) = (c * a - s * b, s * a + c * b);
                        turns += 1;
                    }
                }
            }
            if turns == 0 {
                break;
            }
        }
        spanned.iter_mut().for_each(|value| *value *= unit);
        let mut values: Vec<f64> = spanned.chunks_exact(size.max(1)).map(norm).collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let floor = f64::EPSILON * linear.rows.max(size) as f64 * largest;
        for value in &mut values {
            if !(*value > floor) {
                *value = 0.0;
            }
        }
        Singular { values, turned, spanned }
    }

    /// The step (n,) that is so long along each right vector, in the units of the unknowns.
    pub fn step(&self, coordinates: impl Iterator<Item = f64>, axes: &[f64]) -> Vec<f64> {
        let size = axes.len();
        let mut step = vec![0.0; size];
        for (k, coordinate) in coordinates.enumerate() {
            if self.values[k] > 0.0 {
                let row = &self.spanned[k * size..][..size];
                let share = coordinate / self.values[k];
                step.iter_mut().zip(row).for_each(|(value, part)| *value += share * part);
            }
        }
        step.iter_mut().zip(axes).for_each(|(value, axis)| *value /= axis);
        step
    }
}

/// Cosine and sine of the rotation that makes two rows orthogonal; none where they are.
fn rotation(first: &[f64], second: &[f64]) -> Option<(f64, f64)> {
    let (a, b, both) = (square_sum(first), square_sum(second), dot(first, second));
    let orthogonal = f64::EPSILON * first.len() as f64 * (a * b).sqrt();
    if !(both.abs() > orthogonal) {
        return None;
    }
    let zeta = (b - a) / (2.0 * both);
    let tangent = 1.0_f64.copysign(zeta) / (zeta.abs() + zeta.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    (tangent != 0.0).then_some((cosine, cosine * tangent))
}

fn rotate(first: &mut [f64], second: &mut [f64], c: f64, s: f64) {
    for (a, b) in first.iter_mut().zip(second) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

/// Reflects the columns (column after column) to an upper triangle and the right-hand side with them; returns the
/// diagonal. Above it stands R, from it on the reflections.
fn triangle(columns: &mut [f64], rows: usize, size: usize, right: &mut [f64]) -> Vec<f64> {
    let mut diagonal = vec![0.0; rows.min(size)];
    for (k, corner) in diagonal.iter_mut().enumerate() {
        let (head, tail) = columns.split_at_mut((k + 1) * rows);
        let axis = &mut head[k * rows + k..];
        let length = norm(axis);
        if !(length > 0.0) {
            continue;
        }
        *corner = -length.copysign(axis[0]);
        let weight = 1.0 / (length * (length + axis[0].abs()));
        axis[0] -= *corner;
        for column in tail.chunks_exact_mut(rows).chain([&mut *right]) {
            let column = &mut column[k..];
            let share = weight * dot(axis, column);
            column.iter_mut().zip(&*axis).for_each(|(value, part)| *value -= share * part);
        }
    }
    diagonal
}

/// Back substitution in place, for the first unknowns if there are fewer than the triangle has.
fn eliminate(factor: &DMatrix<f64>, x: &mut [f64]) {
    let columns = factor.as_slice().chunks_exact(factor.nrows().max(1));
    let count = x.len();
    for (j, column) in columns.take(count).enumerate().rev() {
        let (above, here) = x.split_at_mut(j);
        here[0] /= column[j];
        above.iter_mut().zip(column).for_each(|(value, part)| *value -= part * here[0]);
    }
}

/// The same with the transposed triangle.
fn eliminate_transposed(factor: &DMatrix<f64>, x: &mut [f64]) {
    let columns = factor.as_slice().chunks_exact(factor.nrows().max(1));
    for (j, column) in columns.take(x.len()).enumerate() {
        let (above, here) = x.split_at_mut(j);
        here[0] = (here[0] - dot(&column[..j], above)) / column[j];
    }
}

/// Frobenius norm of the inverse of an upper triangle; infinite where it has none.
fn inverse_norm(factor: &DMatrix<f64>) -> f64 {
    let size = factor.ncols();
    let (mut sum, mut column) = (0.0, vec![0.0; size]);
    for k in 0..size {
        column[..k].fill(0.0);
        column[k] = 1.0;
        eliminate(factor, &mut column[..=k]);
        sum += square_sum(&column[..=k]);
    }
    if sum.is_finite() { sum.sqrt() } else { f64::INFINITY }
}

/// Sum of products, in lanes.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (whole, other) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = whole.remainder().iter().zip(other.remainder()).map(|(x, y)| x * y).sum::<f64>();
    for (x, y) in whole.zip(other) {
        for lane in 0..LANES {
            sums[lane] += x[lane] * y[lane];
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// Sum of squares.
pub fn square_sum(values: &[f64]) -> f64 {
    dot(values, values)
}

/// Euclidean length, also of numbers too small or too large to be squared.
pub(super) fn norm(values: &[f64]) -> f64 {
    let sum = square_sum(values);
    if sum > 1e-280 && sum < 1e280 {
        return sum.sqrt();
    }
    let largest = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest == 0.0 || !largest.is_finite() || sum.is_nan() {
        return if largest == 0.0 && !sum.is_nan() { 0.0 } else { sum.sqrt() };
    }
    largest * values.iter().map(|value| (value / largest) * (value / largest)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of sizes that differ by many orders; the last `twins` columns repeat the first.
    fn sample(rows: usize, size: usize, twins: usize) -> (DMatrix<f64>, Vec<f64>) {
        let mut state = (rows * 100 + size) as u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut slope =
            DMatrix::from_fn(rows, size, |_, j| next() * 10.0_f64.powi(3 * j as i32 - 6));
        for k in 0..twins {
            let twin = slope.column(k) * 3.0;
            slope.set_column(size - 1 - k, &twin);
        }
        (slope, (0..rows).map(|_| next()).collect())
    }

    fn close(a: f64, b: f64, scale: f64) -> bool {
        (a - b).abs() <= 1e-13 * scale
    }

    #[test]
    fn a_triangle_has_the_columns_and_the_gradient_of_the_slope() {
        for (rows, size) in [(30, 5), (5, 5), (3, 5), (1, 4), (9, 1), (0, 3), (4, 0)] {
            let (slope, residual) = sample(rows, size, 0);
            let linear = Linear::from_dense(&slope, &residual);
            let right = DVector::from_column_slice(&residual);
            let (normal, again) = (slope.tr_mul(&slope), linear.factor.tr_mul(&linear.factor));
            let gradient = slope.tr_mul(&right);
            let turned = linear.factor.tr_mul(&linear.turned);
            for j in 0..size {
                let length = linear.columns[j];
                assert!(close(length, slope.column(j).norm(), length));
                assert!(close(linear.gradient[j], gradient[j], length * right.norm()));
                assert!(close(turned[j], gradient[j], length * right.norm()));
                for i in 0..size {
                    assert!(close(again[(i, j)], normal[(i, j)], length * linear.columns[i]));
                    assert!(i <= j || linear.factor[(i, j)] == 0.0);
                }
            }
            assert_eq!(linear.trusted, rows >= size);
        }
    }

    #[test]
    fn normal_equations_are_the_same_triangle() {
        let (slope, residual) = sample(40, 6, 0);
        let dense = Linear::from_dense(&slope, &residual);
        let normal = slope.tr_mul(&slope);
        let linear = Linear::from_normal(&normal, dense.gradient.as_slice(), 40).unwrap();
        assert!(linear.trusted && dense.trusted);
        for j in 0..6 {
            // The sign of a row is free.
            let sign = dense.factor[(j, j)].signum();
            assert!(close(linear.turned[j], sign * dense.turned[j], 10.0));
            for k in j..6 {
                let here = sign * dense.factor[(j, k)];
                assert!(close(linear.factor[(j, k)], here, 10.0 * linear.columns[k]));
            }
        }
        let steps = linear.whole().into_iter().zip(dense.whole());
        assert!(steps.into_iter().all(|(a, b)| close(a, b, 100.0 * b.abs())));
    }

    #[test]
    fn normal_equations_that_lose_their_digits_are_refused() {
        let (mut slope, residual) = sample(40, 6, 1);
        let refused = |slope: &DMatrix<f64>| {
            let gradient = vec![1.0; 6];
            Linear::from_normal(&slope.tr_mul(slope), &gradient, 40).is_none()
        };
        assert!(refused(&slope));
        assert!(!Linear::from_dense(&slope, &residual).trusted);
        // Apart by 1e-2 and by 1e-6 of their length.
        let other = DVector::from_column_slice(&residual).normalize() * slope.column(5).norm();
        let twin = slope.column(5).clone_owned();
        slope.set_column(5, &(&twin + &other * 1e-2));
        assert!(!refused(&slope));
        slope.set_column(5, &(&twin + &other * 1e-6));
        assert!(refused(&slope));
        assert!(Linear::from_dense(&slope, &residual).trusted);
        slope[(2, 3)] = f64::NAN;
        assert!(refused(&slope));
        assert!(!Linear::new(6).set_dense(slope, &residual));
    }

    #[test]
    fn singular_values_give_the_step_of_the_triangle() {
        for (rows, size, twins) in [(30, 7, 0), (30, 7, 2), (3, 7, 0), (20, 1, 0), (2, 0, 0)] {
            let (slope, residual) = sample(rows, size, twins);
            let linear = Linear::from_dense(&slope, &residual);
            let axes: Vec<f64> = linear.columns.iter().map(|c| 0.3 * c).collect();
            let singular = Singular::new(&linear, &axes);
            let scaled = DMatrix::from_fn(rows, size, |i, j| slope[(i, j)] / axes[j]);
            let mut descending: Vec<f64> = singular.values.clone();
            descending.sort_by(|a, b| b.total_cmp(a));
            let expected = if size > 0 { scaled.singular_values() } else { DVector::zeros(0) };
            let rank = rows.min(size - twins);
            for k in 0..rank {
                assert!(close(descending[k], expected[k], 10.0 * expected[0]));
            }
            assert!(descending[rank..].iter().all(|value| *value == 0.0));
            // The step leaves a residual at right angles to every column, and is in the row space.
            let parts = singular.values.iter().zip(&singular.turned);
            let whole = parts.map(|(s, c)| if *s > 0.0 { -c / s } else { 0.0 });
            let step = DVector::from_vec(singular.step(whole, &axes));
            let left = &slope * &step + DVector::from_column_slice(&residual);
            for j in 0..size {
                assert!(slope.column(j).dot(&left).abs() < 1e-12 * linear.columns[j]);
            }
            for k in 0..twins {
                // Unit by unit, twins move alike.
                let (a, b) = (step[k] * axes[k], step[size - 1 - k] * axes[size - 1 - k]);
                assert!(close(a, b, 100.0 * a.abs()));
            }
        }
    }

    #[test]
    fn lengths_neither_overflow_nor_vanish() {
        for unit in [1e-300, 1e-170, 1.0, 1e160, 1e300] {
            assert!(close(norm(&[3.0 * unit, -4.0 * unit]) / unit, 5.0, 1.0));
        }
        assert_eq!(norm(&[]), 0.0);
        assert!(norm(&[1.0, f64::NAN]).is_nan());
        assert_eq!(norm(&[f64::INFINITY, 0.0]), f64::INFINITY);
    }
}
