//! The shape of a cloud of position errors: what makes its lengths round.

use truepose_kernel::sampling::Whitening;

/// Sweeps over the pairs of axes; three are enough for rounding.
const SWEEPS: usize = 12;
/// Below this share of the largest variance a direction does not spread.
const LEAST: f64 = 1e-12;

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations (Golub and Van Loan,
/// Matrix Computations, 1996, section 8.4).
fn eigen(mut matrix: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if matrix[p][q] == 0.0 {
                continue;
            }
            let theta = 0.5 * (matrix[q][q] - matrix[p][p]) / matrix[p][q];
            let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let sine = tangent * cosine;
            for k in 0..3 {
                let (one, other) = (matrix[k][p], matrix[k][q]);
                matrix[k][p] = cosine * one - sine * other;
                matrix[k][q] = sine * one + cosine * other;
            }
            for k in 0..3 {
                let (one, other) = (matrix[p][k], matrix[q][k]);
                matrix[p][k] = cosine * one - sine * other;
                matrix[q][k] = sine * one + cosine * other;
            }
            for row in &mut vectors {
                let (one, other) = (row[p], row[q]);
                row[p] = cosine * one - sine * other;
                row[q] = sine * one + cosine * other;
            }
        }
    }
    ([matrix[0][0], matrix[1][1], matrix[2][2]], vectors)
}

/// What whitens errors of such a covariance about a centre: a direction in which nothing spreads does not
/// count.
pub fn whitening(centre: [f64; 3], covariance: [[f64; 3]; 3]) -> Whitening {
    let (values, vectors) = eigen(covariance);
    let least = (LEAST * values.into_iter().fold(0.0, f64::max)).max(0.0);
    let mut matrix = [[0.0; 3]; 3];
    for (row, &value) in values.iter().enumerate() {
        let scale = if value > least { 1.0 / value.sqrt() } else { 0.0 };
        for k in 0..3 {
            matrix[row][k] = scale * vectors[k][row];
        }
    }
    Whitening { centre, matrix }
}
