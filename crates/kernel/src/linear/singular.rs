//! How near to singular a matrix is.

use super::SIX;
use nalgebra::DMatrix;

/// Smallest over largest singular value of the first `rows` rows and the columns in `columns`:
/// 1 is isotropic, 0 singular. Zero too where a value is not finite.
pub fn condition_index(matrix: &[[f64; SIX]], rows: usize, columns: &[bool; SIX]) -> f64 {
    let kept: Vec<usize> = (0..SIX).filter(|&j| columns[j]).collect();
    if kept.is_empty() || matrix[..rows].iter().flatten().any(|value| !value.is_finite()) {
        return 0.0;
    }
    let dense = DMatrix::from_fn(rows, kept.len(), |i, j| matrix[i][kept[j]]);
    let values = dense.singular_values();
    // A wide matrix leaves freedoms unheld, however large its singular values are.
    if rows < kept.len() { 0.0 } else { values.min() / values.max() }
}

/// The unit combinations of the columns that the first `rows` rows leave free: right singular vectors whose
/// value is below `limit` times the largest, zero in the other columns.
pub fn null_space(
    matrix: &[[f64; SIX]],
    rows: usize,
    columns: &[bool; SIX],
    limit: f64,
) -> Vec<[f64; SIX]> {
    let kept: Vec<usize> = (0..SIX).filter(|&j| columns[j]).collect();
    // Padded with zero rows, so that there are as many right vectors as columns.
    let size = rows.max(kept.len());
    let dense =
        DMatrix::from_fn(size, kept.len(), |i, j| if i < rows { matrix[i][kept[j]] } else { 0.0 });
    let svd = dense.svd(false, true);
    let Some(right) = svd.v_t else { return Vec::new() };
    let largest = svd.singular_values.max();
    let free = (0..kept.len()).filter(|&k| svd.singular_values[k] <= limit * largest);
    free.map(|k| {
        let mut vector = [0.0; SIX];
        for (j, &column) in kept.iter().enumerate() {
            vector[column] = right[(k, j)];
        }
        vector
    })
    .collect()
}
