//! Krawczyk's operator: that there is exactly one root in a box, and where; and what divides by the
//! derivatives over it.

use super::closures::{Six, Square};
use super::{Unproven, point};
use crate::linear::{Matrix6, SIX, inverse_of};
use crate::scalar::Interval;

/// Boxes that are tried before giving up.
const TRIALS: usize = 12;
/// Times that a proven box is made tighter.
const REFINEMENTS: usize = 3;
/// A proven box is made tighter while one of its sides shrinks below this share of itself.
const WORTH_IT: f64 = 0.99;
/// A box grows by this share of itself between trials.
const INFLATION: f64 = 0.1;
/// Smallest half width of a box, m: far below anything and far above rounding.
const FINEST: f64 = 1e-13;
/// Beyond what size of |I - Y J| the inverse is not enclosed.
const CONTRACTING: f64 = 0.97;
/// Steps towards a vector that a matrix shrinks, at most,
const SHRINKING: usize = 100;
/// and by what share it may still change.
const STEADY: f64 = 1e-6;
/// What rounding may take of a sum of some non-negative products of some, generously: a sum of n products
/// errs by less than n + 1 steps of itself (Higham, "Accuracy and Stability of Numerical Algorithms", 2002,
/// section 3.1), and a product that underflows by less than the smallest normal number.
const SUMMED: f64 = 1.0 + 100.0 * f64::EPSILON;

/// The inverse of every matrix in an interval matrix: `(I - E)^-1 Y`, |E| small.
#[derive(Clone, Debug)]
pub struct Inverse {
    approximate: Matrix6<f64>,
    /// `(I - |E|)^-1 |E|`, from above.
    excess: Matrix6<f64>,
}

/// The middles of an interval matrix.
fn middles(matrix: &Square) -> Matrix6<f64> {
    matrix.map(|row| row.map(Interval::midpoint))
}

/// `Y w`: of middles and radii (Rump, "Fast and parallel interval arithmetic", BIT 39, 1999), which is
/// less work than products of intervals.
fn times(matrix: &Matrix6<f64>, w: &Six) -> Six {
    let (middle, radius) = (w.map(Interval::midpoint), w.map(Interval::radius));
    let mut result = [point(0.0); SIX];
    for (value, row) in result.iter_mut().zip(matrix) {
        let (mut sum, mut size, mut spread) = (0.0, 0.0, 0.0);
        for k in 0..SIX {
            let product = row[k] * middle[k];
            sum += product;
            size += product.abs();
            spread += row[k].abs() * radius[k];
        }
        // Rounding errs by less than seven half steps of the sum of sizes.
        let more = (spread + size * (8.0 * f64::EPSILON)) * SUMMED;
        // A zero is exact unless products of others underflow to it.
        let exact = more == 0.0 && (0..SIX).all(|k| row[k] == 0.0 || w[k] == point(0.0));
        let tiny = if exact { 0.0 } else { f64::MIN_POSITIVE };
        *value = point(sum) + Interval::symmetric(more + tiny);
    }
    result
}

/// |I - Y J|, entry by entry from above.
fn distance(approximate: &Matrix6<f64>, jacobian: &Square) -> Matrix6<f64> {
    let mut result = [[0.0; SIX]; SIX];
    for j in 0..SIX {
        let mut column = [point(0.0); SIX];
        for i in 0..SIX {
            column[i] = jacobian[i][j];
        }
        let product = times(approximate, &column);
        for i in 0..SIX {
            let unit = if i == j { 1.0 } else { 0.0 };
            result[i][j] = (point(unit) - product[i]).magnitude();
        }
    }
    result
}

/// A positive vector x that a non-negative matrix B shrinks, and by how much at least: B x <= size x.
///
/// x = 1 + (B / s) x gives B x = s (x - 1) < s x: for any s above the spectral radius such an x exists, and
/// the iteration finds it. Whether it did is then checked. The unknowns are of different kinds, so that the
/// plain sums of rows say little.
fn shrunk(matrix: &Matrix6<f64>) -> Option<([f64; SIX], f64)> {
    for share in [0.25, 0.5, 0.75, 0.95] {
        let mut vector = [1.0; SIX];
        for _ in 0..SHRINKING {
            let before = vector;
            let mut changed = 0.0_f64;
            for i in 0..SIX {
                let sum: f64 = (0..SIX).map(|k| matrix[i][k] * before[k]).sum();
                vector[i] = 1.0 + sum / share;
                changed = changed.max(vector[i] - (1.0 + STEADY) * before[i]);
            }
            if changed <= 0.0 {
                break;
            }
        }
        if !vector.iter().all(|value| value.is_finite()) {
            continue;
        }
        let mut size = 0.0_f64;
        for i in 0..SIX {
            let sum = sum_above((0..SIX).map(|k| (matrix[i][k], vector[k])));
            size = size.max((point(sum) / point(vector[i])).upper);
        }
        if size < CONTRACTING {
            return Some((vector, size));
        }
    }
    None
}

/// The sum of at most some ten non-negative products, from above.
fn sum_above(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut sum = 0.0;
    for (a, b) in values {
        // A zero stays one; what underflows does not become one.
        if a != 0.0 && b != 0.0 {
            sum += a * b + f64::MIN_POSITIVE;
        }
    }
    sum * SUMMED
}

/// `A + B A` of matrices without negative entries, from above.
fn with_product(a: &Matrix6<f64>, b: &Matrix6<f64>) -> Matrix6<f64> {
    let mut result = *a;
    for i in 0..SIX {
        for j in 0..SIX {
            let products = (0..SIX).map(|k| (b[i][k], a[k][j]));
            result[i][j] = (a[i][j] + sum_above(products)) * SUMMED;
        }
    }
    result
}

/// `A A` of a matrix without negative entries, from above.
fn squared(a: &Matrix6<f64>) -> Matrix6<f64> {
    let mut result = *a;
    for i in 0..SIX {
        for j in 0..SIX {
            result[i][j] = sum_above((0..SIX).map(|k| (a[i][k], a[k][j])));
        }
    }
    result
}

impl Inverse {
    /// Of an interval matrix; `None` where that is not certain to hold regular matrices alone.
    pub fn of(matrix: &Square) -> Option<Self> {
        let approximate = inverse_of(&middles(matrix));
        if !approximate.iter().flatten().all(|value| value.is_finite()) {
            return None;
        }
        Self::within(approximate, &distance(&approximate, matrix))
    }

    /// Of all matrices A with |I - Y A| <= B, entry by entry, where Y is `approximate`.
    pub fn within(approximate: Matrix6<f64>, first: &Matrix6<f64>) -> Option<Self> {
        let (weights, size) = shrunk(first)?;
        // B + B^2 + ... + B^8 by doubling, and B^9 (I + B + ...) by the norm.
        let second = squared(first);
        let mut excess = with_product(first, first);
        excess = with_product(&excess, &second);
        excess = with_product(&excess, &squared(&second));
        let mut power = point(size);
        for _ in 0..3 {
            power = power * power;
        }
        let tail = power * point(size) / (point(1.0) - point(size));
        for i in 0..SIX {
            for j in 0..SIX {
                let more = tail * point(weights[i]) / point(weights[j]);
                excess[i][j] = (point(excess[i][j]) + more).upper;
            }
        }
        Some(Inverse { approximate, excess })
    }

    /// The largest share of one place that any of the inverses adds to another.
    pub fn excess(&self) -> f64 {
        self.excess.iter().flatten().copied().fold(0.0, f64::max)
    }

    /// `B (I - B)^-1 B` of the B that these inverses are `within`, from above.
    pub fn excess_beyond(&self, first: &Matrix6<f64>) -> Matrix6<f64> {
        let mut result = *first;
        for i in 0..SIX {
            for j in 0..SIX {
                result[i][j] = sum_above((0..SIX).map(|k| (first[i][k], self.excess[k][j])));
            }
        }
        result
    }

    /// The products of the inverses with a vector.
    pub fn times(&self, vector: &Six) -> Six {
        let nearly = times(&self.approximate, vector);
        let mut result = nearly;
        for i in 0..SIX {
            let more = sum_above((0..SIX).map(|k| (self.excess[i][k], nearly[k].magnitude())));
            result[i] = nearly[i] + Interval::symmetric(more);
        }
        result
    }

    /// The products of a row vector with the inverses.
    pub fn row_times(&self, vector: &Six) -> Six {
        // v (I - E)^-1 Y: v is spread by the excess first.
        let mut spread = [point(0.0); SIX];
        for j in 0..SIX {
            let more = sum_above((0..SIX).map(|i| (vector[i].magnitude(), self.excess[i][j])));
            spread[j] = vector[j] + Interval::symmetric(more);
        }
        let mut result = [point(0.0); SIX];
        for j in 0..SIX {
            for k in 0..SIX {
                result[j] = result[j] + spread[k] * point(self.approximate[k][j]);
            }
        }
        result
    }
}

/// Exactly one root for every value of what else varies.
#[derive(Clone, Debug)]
pub struct Root {
    /// Where the roots are.
    pub enclosure: Six,
    /// Where there is no other.
    pub unique_in: Six,
}

/// What else varies: how the residuals change with it, and by how much it does.
pub type Varying = (Six, Interval);

/// Proves a root near `middle` for all that else varies: `value` are the residuals there where nothing does,
/// `first` encloses the derivatives there for all that else varies, `jacobian` those over a box.
pub fn prove(
    middle: &[f64; SIX],
    value: &Six,
    varying: &[Varying],
    first: &Square,
    jacobian: impl Fn(&Six) -> Square,
) -> Result<Root, Unproven> {
    let at_middle = middle.map(point);
    let approximate = inverse_of(&middles(first));
    if !approximate.iter().flatten().all(|entry| entry.is_finite()) {
        return Err(Unproven::NearSingular);
    }
    // Where the root goes to first order, either way.
    let mut shift = times(&approximate, value).map(|v| -v);
    for (change, extent) in varying {
        // The product first, where what all closures have in common cancels, then the extent.
        let change = times(&approximate, change);
        for k in 0..SIX {
            shift[k] = shift[k] - change[k] * *extent;
        }
    }
    let krawczyk = |tried: &Six| {
        // The mean value theorem is used between the middle and any point of the box.
        let mut between = *tried;
        for i in 0..SIX {
            between[i] = between[i].hull(at_middle[i]);
        }
        let spread = distance(&approximate, &jacobian(&between));
        let mut image = *tried;
        for i in 0..SIX {
            let more =
                sum_above((0..SIX).map(|k| (spread[i][k], (tried[k] - at_middle[k]).magnitude())));
            image[i] = at_middle[i] + shift[i] + Interval::symmetric(more);
        }
        image
    };
    let widened = |one: Interval| one + Interval::symmetric(INFLATION * one.radius() + FINEST);
    let mut tried = [point(0.0); SIX];
    for i in 0..SIX {
        tried[i] = widened((at_middle[i] + shift[i]).hull(at_middle[i]));
    }
    for _ in 0..TRIALS {
        if !tried.iter().all(|one| one.is_finite()) {
            return Err(Unproven::TooWide);
        }
        let image = krawczyk(&tried);
        if image.iter().zip(&tried).all(|(image, tried)| image.is_inside(*tried)) {
            let mut enclosure = image;
            for _ in 0..REFINEMENTS {
                let tighter = krawczyk(&enclosure);
                let before = enclosure;
                for i in 0..SIX {
                    enclosure[i] = enclosure[i].intersection(tighter[i]).unwrap_or(enclosure[i]);
                }
                let gained = |i: usize| enclosure[i].radius() < WORTH_IT * before[i].radius();
                if !(0..SIX).any(gained) {
                    break;
                }
            }
            return Ok(Root { enclosure, unique_in: tried });
        }
        // Not the hull of both: a side that is wide enough must not widen the others.
        tried = image.map(widened);
    }
    Err(Unproven::TooWide)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [-1, 1] that look random, always the same (Marsaglia 2003, xorshift).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn solutions_of_every_matrix_between_lie_in_the_products_with_the_inverse() {
        let mut enclosed = 0;
        for seed in 1..400 {
            let mut next = numbers(seed);
            // From next to nothing to too much.
            let spread = 10f64.powi(-((seed % 8) as i32));
            let scales = [1.0, 1e-3, 1e3, 1.0, 1e-6, 10.0];
            let mut matrix = [[point(0.0); SIX]; SIX];
            for i in 0..SIX {
                for j in 0..SIX {
                    let middle = scales[i] * (next() + if i == j { 4.0 } else { 0.0 });
                    let radius = (scales[i] * spread * next()).abs();
                    matrix[i][j] = Interval::new(middle - radius, middle + radius);
                }
            }
            let Some(inverse) = Inverse::of(&matrix) else {
                assert!(spread > 0.01, "{spread}");
                continue;
            };
            enclosed += 1;
            assert!(inverse.excess() <= 40.0 * spread + 1e-13, "{} {spread}", inverse.excess());
            for _ in 0..20 {
                let x: [f64; SIX] = std::array::from_fn(|_| next());
                let mut w = [point(0.0); SIX];
                for i in 0..SIX {
                    for j in 0..SIX {
                        let Interval { lower, upper } = matrix[i][j];
                        let at = if next() > 0.0 { lower } else { upper };
                        w[i] = w[i] + point(at) * point(x[j]);
                    }
                }
                let solved = inverse.times(&w);
                let holds = solved.iter().zip(x).all(|(solved, x)| solved.contains(x));
                assert!(holds, "{solved:?} {x:?}");
            }
        }
        assert!(enclosed > 300, "{enclosed}");
    }

    #[test]
    fn what_is_exactly_zero_stays_so() {
        let unit: Square =
            std::array::from_fn(|i| std::array::from_fn(|j| point(f64::from(u8::from(i == j)))));
        let inverse = Inverse::of(&unit).expect("the unit matrix is regular");
        assert_eq!(inverse.times(&[point(0.0); SIX]), [point(0.0); SIX]);
        let mut one = [point(0.0); SIX];
        one[2] = point(3.0);
        let result = inverse.times(&one);
        assert!(result[2].contains(3.0));
        assert!((0..SIX).all(|k| k == 2 || result[k].contains(0.0)));
    }

    #[test]
    fn nothing_is_known_of_what_is_no_number() {
        let unit: Square =
            std::array::from_fn(|i| std::array::from_fn(|j| point(f64::from(u8::from(i == j)))));
        let inverse = Inverse::of(&unit).expect("the unit matrix is regular");
        let mut vector = [point(1.0); SIX];
        vector[0] = Interval::ENTIRE;
        assert_eq!(inverse.times(&vector)[0], Interval::ENTIRE);
    }
}
