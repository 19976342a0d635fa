//! Elimination of a 6 x 6 system without heap.
//!
//! Lanes share one row order, found by pivoting at a nearby pose: pivoting lane by lane costs half as
//! much again. Whether the order served is checked per lane by its caller, which falls back to an
//! order found for the sample alone.

use super::{IN_ORDER, Matrix6, Order, SIX};
use crate::scalar::{Real, Scalar};

/// Eliminates in place, rows in the order in which they stand: multipliers below the diagonal, inverse
/// pivots on it. Returns the product of the pivots, the determinant.
#[inline(always)]
pub fn factor<S: Scalar>(m: &mut Matrix6<S>) -> S {
    let one = m[0][0].lift(1.0);
    let mut product = one;
    for k in 0..SIX {
        product = product * m[k][k];
        let inverse = one / m[k][k];
        m[k][k] = inverse;
        for i in k + 1..SIX {
            let multiplier = m[i][k] * inverse;
            m[i][k] = multiplier;
            let negative = -multiplier;
            for j in k + 1..SIX {
                m[i][j] = negative.mul_add(m[k][j], m[i][j]);
            }
        }
    }
    product
}

/// The sum of the multipliers' sizes after [`factor`]: with rows of like size, rounding errors grow by
/// about as much. Pivoting keeps it below 15; an order that does not serve makes it large.
#[inline(always)]
pub fn growth<S: Real>(m: &Matrix6<S>) -> S {
    let mut sum = S::default();
    for i in 1..SIX {
        for k in 0..i {
            sum = sum + m[i][k].abs();
        }
    }
    sum
}

/// One matrix eliminated with pivoting.
pub struct Pivoted {
    /// As [`factor`] leaves them.
    pub factors: Matrix6<f64>,
    /// Which row stands at each place.
    pub order: Order,
    /// With the sign of the order.
    pub determinant: f64,
}

/// Eliminates with the row that has the largest element, relative to its row's norm, at every pivot.
pub fn factor_pivoting(rows: &Matrix6<f64>) -> Pivoted {
    let mut m = *rows;
    let mut order = IN_ORDER;
    let mut weight = [0.0; SIX];
    for i in 0..SIX {
        let square = m[i].iter().map(|value| value * value).sum::<f64>();
        weight[i] = if square > 0.0 { 1.0 / square } else { 0.0 };
    }
    let mut determinant = 1.0;
    for k in 0..SIX {
        let mut best = k;
        let mut largest = m[k][k].square() * weight[k];
        for i in k + 1..SIX {
            let size = m[i][k].square() * weight[i];
            if size > largest {
                (best, largest) = (i, size);
            }
        }
        if best != k {
            m.swap(k, best);
            order.swap(k, best);
            weight.swap(k, best);
            determinant = -determinant;
        }
        determinant *= m[k][k];
        let inverse = 1.0 / m[k][k];
        m[k][k] = inverse;
        for i in k + 1..SIX {
            let multiplier = m[i][k] * inverse;
            m[i][k] = multiplier;
            for j in k + 1..SIX {
                m[i][j] -= multiplier * m[k][j];
            }
        }
    }
    Pivoted { factors: m, order, determinant }
}

/// Solves in place for one right-hand side in the order of the eliminated rows.
#[inline(always)]
pub fn solve<S: Real>(m: &Matrix6<S>, x: &mut [S; SIX]) {
    for k in 0..SIX {
        for i in k + 1..SIX {
            x[i] = (-m[i][k]).mul_add(x[k], x[i]);
        }
    }
    back_substitute(m, x);
}

#[inline(always)]
fn back_substitute<S: Real>(m: &Matrix6<S>, x: &mut [S; SIX]) {
    for k in (0..SIX).rev() {
        let mut value = x[k];
        // The newest unknown last: everything before it can go on while it is being computed.
        for j in (k + 1..SIX).rev() {
            value = (-m[k][j]).mul_add(x[j], value);
        }
        x[k] = value * m[k][k];
    }
}

/// Solves the transposed system for one right-hand side: the unknowns of the rows in their order.
#[inline(always)]
pub fn solve_transposed<S: Scalar>(m: &Matrix6<S>, right: &[S; SIX]) -> [S; SIX] {
    let mut x = *right;
    for k in 0..SIX {
        for i in 0..k {
            x[k] = (-m[i][k]).mul_add(x[i], x[k]);
        }
        x[k] = x[k] * m[k][k];
    }
    for k in (0..SIX).rev() {
        for i in k + 1..SIX {
            x[k] = (-m[i][k]).mul_add(x[i], x[k]);
        }
    }
    x
}

/// The inverse of the eliminated matrix, in the first six columns; `order[k]` is the column that row k
/// answers to.
#[inline(always)]
pub fn invert<S: Real, const N: usize>(m: &Matrix6<S>, order: &Order, inverse: &mut [[S; N]; SIX]) {
    for column in 0..SIX {
        // The right-hand side is a unit vector: elimination starts at its own place.
        let mut x = [S::default(); SIX];
        x[column] = S::splat(1.0);
        for k in column..SIX {
            for i in k + 1..SIX {
                x[i] = (-m[i][k]).mul_add(x[k], x[i]);
            }
        }
        back_substitute(m, &mut x);
        for k in 0..SIX {
            inverse[k][order[column]] = x[k];
        }
    }
}

/// The inverse of one matrix, pivoted; not finite where it has none.
pub fn inverse_of(rows: &Matrix6<f64>) -> Matrix6<f64> {
    let Pivoted { factors, order, .. } = factor_pivoting(rows);
    let mut inverse = [[0.0; SIX]; SIX];
    invert(&factors, &order, &mut inverse);
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seed: u64) -> Matrix6<f64> {
        let mut state = seed;
        let mut rows = [[0.0; SIX]; SIX];
        for row in rows.iter_mut() {
            for value in row.iter_mut() {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                *value = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            }
        }
        rows
    }

    #[test]
    fn inverse_and_solution_give_back_the_right_hand_side() {
        for seed in 0..50 {
            let rows = sample(seed);
            let inverse = inverse_of(&rows);
            let right = [1.0, -2.0, 0.5, 3.0, -1.0, 0.25];
            let Pivoted { factors, order, determinant } = factor_pivoting(&rows);
            let mut x = order.map(|row| right[row]);
            solve(&factors, &mut x);
            let mut again = order.map(|row| rows[row]);
            let product = factor(&mut again);
            assert!((product.abs() - determinant.abs()).abs() < 1e-14);
            let mut y = order.map(|row| right[row]);
            solve(&again, &mut y);
            let placed = solve_transposed(&again, &right);
            let mut z = [0.0; SIX];
            for (k, row) in order.into_iter().enumerate() {
                z[row] = placed[k];
            }
            for i in 0..SIX {
                let transposed: f64 = (0..SIX).map(|j| rows[j][i] * z[j]).sum();
                assert!((transposed - right[i]).abs() < 1e-11);
                let product: f64 = (0..SIX).map(|j| rows[i][j] * x[j]).sum();
                assert!((product - right[i]).abs() < 1e-11);
                assert!((x[i] - y[i]).abs() < 1e-11);
                for j in 0..SIX {
                    let unit: f64 = (0..SIX).map(|k| rows[i][k] * inverse[k][j]).sum();
                    assert!((unit - f64::from(u8::from(i == j))).abs() < 1e-11);
                }
            }
        }
    }

    #[test]
    fn the_determinant_changes_sign_with_two_rows_exchanged() {
        let rows = sample(3);
        let mut exchanged = rows;
        exchanged.swap(1, 4);
        let ratio = factor_pivoting(&rows).determinant / factor_pivoting(&exchanged).determinant;
        assert!((ratio + 1.0).abs() < 1e-12);
    }
}
