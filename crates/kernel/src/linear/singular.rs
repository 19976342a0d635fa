//! How near to singular a matrix is.

use super::{Matrix6, SIX};
use nalgebra::DMatrix;

/// Smallest over largest singular value of the first `rows` rows and the columns in `columns`:
/// 1 is isotropic, 0 singular. Zero too where a value is not finite.
pub fn condition_index(matrix: &Matrix6<f64>, rows: usize, columns: &[bool; SIX]) -> f64 {
    let kept: Vec<usize> = (0..SIX).filter(|&j| columns[j]).collect();
    if kept.is_empty() || matrix[..rows].iter().flatten().any(|value| !value.is_finite()) {
        return 0.0;
    }
    let dense = DMatrix::from_fn(rows, kept.len(), |i, j| matrix[i][kept[j]]);
    let values = dense.singular_values();
    // A wide matrix leaves freedoms unheld, however large its singular values are.
    if rows < kept.len() { 0.0 } else { values.min() / values.max() }
}
