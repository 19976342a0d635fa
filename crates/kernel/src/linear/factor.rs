//! Elimination of a 6 x 6 system without heap.
//!
//! Lanes share one row order, found by pivoting at a nearby pose: pivoting lane by lane costs half as
//! much again. Whether the order served is checked per lane by its caller, which falls back to
//! [`factor_pivoting`].

use super::{Matrix6, SIX};
use crate::scalar::Real;

/// A matrix after elimination: multipliers below the diagonal, inverse pivots on it.
pub struct Factored<S> {
    matrix: Matrix6<S>,
    order: [usize; SIX],
    /// The product of the pivots: the determinant up to the sign of the row order.
    pub pivot_product: S,
    /// +1 or -1: the sign of the row order.
    pub order_sign: f64,
}

/// Eliminates with the rows in the given order (`rows[order[k]]` becomes row k).
#[inline(always)]
pub fn factor<S: Real>(rows: &Matrix6<S>, order: &[usize; SIX]) -> Factored<S> {
    let mut m = [[S::default(); SIX]; SIX];
    for k in 0..SIX {
        m[k] = rows[order[k]];
    }
    let mut product = S::splat(1.0);
    for k in 0..SIX {
        product = product * m[k][k];
        let inverse = S::splat(1.0) / m[k][k];
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
    Factored { matrix: m, order: *order, pivot_product: product, order_sign: 1.0 }
}

/// Eliminates one matrix with row pivoting; rows are compared by their size relative to their norm.
pub fn factor_pivoting(rows: &Matrix6<f64>) -> Factored<f64> {
    let mut m = *rows;
    let mut order = [0, 1, 2, 3, 4, 5];
    let mut weight = [0.0; SIX];
    for i in 0..SIX {
        let norm = m[i].iter().map(|value| value * value).sum::<f64>().sqrt();
        weight[i] = if norm > 0.0 { 1.0 / norm } else { 0.0 };
    }
    let mut product = 1.0;
    let mut sign = 1.0;
    for k in 0..SIX {
        let mut best = k;
        for i in k + 1..SIX {
            if (m[i][k] * weight[i]).abs() > (m[best][k] * weight[best]).abs() {
                best = i;
            }
        }
        if best != k {
            m.swap(k, best);
            order.swap(k, best);
            weight.swap(k, best);
            sign = -sign;
        }
        product *= m[k][k];
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
    Factored { matrix: m, order, pivot_product: product, order_sign: sign }
}

/// The row order that pivoting chooses for one matrix.
pub fn pivot_order(rows: &Matrix6<f64>) -> [usize; SIX] {
    factor_pivoting(rows).order
}

/// Solves for one right-hand side, given in the rows' own order.
#[inline(always)]
pub fn solve<S: Real>(factored: &Factored<S>, right: &[S; SIX]) -> [S; SIX] {
    let m = &factored.matrix;
    let mut x = [S::default(); SIX];
    for k in 0..SIX {
        x[k] = right[factored.order[k]];
    }
    for k in 0..SIX {
        for i in k + 1..SIX {
            x[i] = (-m[i][k]).mul_add(x[k], x[i]);
        }
    }
    for k in (0..SIX).rev() {
        for j in k + 1..SIX {
            x[k] = (-m[k][j]).mul_add(x[j], x[k]);
        }
        x[k] = x[k] * m[k][k];
    }
    x
}

/// The inverse matrix, its columns in the rows' own order.
#[inline(always)]
pub fn invert<S: Real>(factored: &Factored<S>) -> Matrix6<S> {
    let m = &factored.matrix;
    let mut inverse = [[S::default(); SIX]; SIX];
    for column in 0..SIX {
        // The right-hand side is a unit vector: elimination starts at its own place.
        let mut x = [S::default(); SIX];
        x[column] = S::splat(1.0);
        for k in column..SIX {
            for i in k + 1..SIX {
                x[i] = (-m[i][k]).mul_add(x[k], x[i]);
            }
        }
        for k in (0..SIX).rev() {
            for j in k + 1..SIX {
                x[k] = (-m[k][j]).mul_add(x[j], x[k]);
            }
            x[k] = x[k] * m[k][k];
        }
        for k in 0..SIX {
            inverse[k][factored.order[column]] = x[k];
        }
    }
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
            let factored = factor_pivoting(&rows);
            let inverse = invert(&factored);
            let right = [1.0, -2.0, 0.5, 3.0, -1.0, 0.25];
            let x = solve(&factored, &right);
            let y = solve(&factor(&rows, &pivot_order(&rows)), &right);
            for i in 0..SIX {
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
        let a = factor_pivoting(&rows);
        let b = factor_pivoting(&exchanged);
        let ratio = a.pivot_product * a.order_sign / (b.pivot_product * b.order_sign);
        assert!((ratio + 1.0).abs() < 1e-12);
    }
}
