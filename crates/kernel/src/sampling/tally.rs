//! What is kept of samples, in constant memory: moments, extremes and a histogram that widens itself.

use crate::scalar::{LANES, Real};

/// Bins of a histogram, half of them on each side of its origin.
pub(super) const BINS: usize = 2048;
const MIDDLE: i64 = BINS as i64 / 2;
/// Values at which the narrowest interval is looked for.
const STARTS: usize = 1000;

/// Counts of values in bins of equal width about an origin.
///
/// A value beyond the outermost bin doubles the width, every two bins becoming one: the width is the first
/// one times a power of two, so the counts in the end do not depend on the order of the values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    pub origin: f64,
    pub per_unit: f64,
    pub doublings: u32,
    pub lowest: f64,
    pub highest: f64,
    pub counts: Box<[u64; BINS]>,
}

impl Histogram {
    /// How many bins there were in one at first, before any width was doubled.
    pub fn first_per_unit(&self) -> f64 {
        self.per_unit * f64::from(self.doublings).exp2()
    }

    /// The width is taken down to a power of two, so that halving and doubling it is exact.
    fn new(origin: f64, width: f64) -> Self {
        Histogram {
            origin,
            per_unit: width.log2().floor().exp2().recip(),
            doublings: 0,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            counts: Box::new([0; BINS]),
        }
    }

    fn add(&mut self, value: f64) {
        self.reach([value, value]);
        let bin = ((value - self.origin) * self.per_unit).floor();
        self.count(bin, value);
    }

    /// Counts a value whose bin from the origin is `bin`.
    #[inline(always)]
    fn count(&mut self, bin: f64, value: f64) {
        if bin.abs() < MIDDLE as f64 {
            self.counts[place(bin)] += 1;
        } else {
            self.add_beyond(value);
        }
    }

    fn reach(&mut self, [lowest, highest]: [f64; 2]) {
        self.lowest = self.lowest.min(lowest);
        self.highest = self.highest.max(highest);
    }

    #[cold]
    fn add_beyond(&mut self, value: f64) {
        // The lowest bin is reached here too.
        loop {
            let bin = ((value - self.origin) * self.per_unit).floor();
            if bin >= -MIDDLE as f64 && bin < MIDDLE as f64 {
                self.counts[(bin as i64 + MIDDLE) as usize] += 1;
                return;
            }
            if !bin.is_finite() {
                return;
            }
            self.widen();
        }
    }

    fn widen(&mut self) {
        let mut counts = Box::new([0; BINS]);
        for (index, count) in self.counts.iter().enumerate() {
            counts[((index as i64 - MIDDLE).div_euclid(2) + MIDDLE) as usize] += count;
        }
        self.counts = counts;
        self.per_unit *= 0.5;
        self.doublings += 1;
    }

    fn merge(&mut self, mut other: Histogram) {
        while self.doublings < other.doublings {
            self.widen();
        }
        while other.doublings < self.doublings {
            other.widen();
        }
        for (count, more) in self.counts.iter_mut().zip(other.counts.iter()) {
            *count += more;
        }
        self.lowest = self.lowest.min(other.lowest);
        self.highest = self.highest.max(other.highest);
    }

    fn distribution(&self) -> Distribution<'_> {
        let mut sum = 0;
        let up_to = self.counts.iter().map(|count| {
            sum += count;
            sum
        });
        Distribution { of: self, up_to: up_to.collect() }
    }
}

/// Where a bin, numbered from the origin, stands among the counts.
#[inline(always)]
fn place(bin: f64) -> usize {
    // Adding 1.5 * 2^52 leaves a whole number's bits at the end.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    ((bin + WHOLE).to_bits() as usize).wrapping_add(BINS / 2) % BINS
}

/// A histogram with the sums of its counts up to each bin.
struct Distribution<'a> {
    of: &'a Histogram,
    up_to: Vec<u64>,
}

impl Distribution<'_> {
    /// The value below which lies a `share` of all, linear within a bin. `from`: a bin that is not behind
    /// that of the share, which is put there: ascending shares walk over the bins once.
    fn quantile_from(&self, share: f64, from: &mut usize) -> f64 {
        let total = self.up_to[BINS - 1];
        if total == 0 {
            return f64::NAN;
        }
        let wanted = share * total as f64;
        while self.up_to.get(*from).is_some_and(|&sum| sum == 0 || (sum as f64) < wanted) {
            *from += 1;
        }
        let bin = *from;
        let Some(&count) = self.of.counts.get(bin) else { return self.of.highest };
        let before = self.up_to[bin] - count;
        let inside = (wanted - before as f64) / count as f64;
        let bins = (bin as i64 - MIDDLE) as f64 + inside;
        (self.of.origin + bins / self.of.per_unit).clamp(self.of.lowest, self.of.highest)
    }

    /// The narrowest interval that holds a `share` of all (JCGM 101:2008, 5.3.4).
    fn shortest(&self, share: f64) -> [f64; 2] {
        let mut best = [f64::NAN; 2];
        let (mut lower, mut upper) = (0, 0);
        for start in 0..=STARTS {
            let below = (1.0 - share) * start as f64 / STARTS as f64;
            let ends = [
                self.quantile_from(below, &mut lower),
                self.quantile_from(below + share, &mut upper),
            ];
            if !(best[1] - best[0] <= ends[1] - ends[0]) {
                best = ends;
            }
        }
        best
    }
}

/// Sums over some samples of one set of columns, about their origins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// How many samples were added.
    pub count: u64,
    /// Of each column.
    pub first: Vec<f64>,
    /// Of the products of two of the columns with a covariance, upper triangle row after row.
    pub second: Vec<f64>,
    /// Position errors of the samples, three numbers each, NaN without a result, where they are kept.
    pub positions: Vec<f64>,
}

impl Sums {
    /// Of no samples yet.
    pub fn new(columns: usize, covariant: usize) -> Self {
        Sums {
            count: 0,
            first: vec![0.0; columns],
            second: vec![0.0; covariant * (covariant + 1) / 2],
            positions: Vec::new(),
        }
    }

    /// Adds the sums of further samples.
    pub fn add(&mut self, other: &Sums) {
        self.count += other.count;
        for (sum, more) in self.first.iter_mut().zip(&other.first) {
            *sum += more;
        }
        for (sum, more) in self.second.iter_mut().zip(&other.second) {
            *sum += more;
        }
    }
}

/// What is kept of the samples of one pose, or of one function: columns, the first of which have a
/// covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    pub(super) covariant: usize,
    pub(super) sums: Sums,
    pub(super) histograms: Vec<Histogram>,
    /// Samples without a result, by status.
    pub failed: [u64; 7],
}

impl Tally {
    /// Of no samples yet. Each column has an origin, near which its values lie, and a width of the order
    /// of a hundredth of their spread, above 0.
    pub fn new(origins: &[f64], widths: &[f64], covariant: usize) -> Self {
        let histograms =
            origins.iter().zip(widths).map(|(&origin, &width)| Histogram::new(origin, width));
        Tally {
            covariant,
            sums: Sums::new(origins.len(), covariant),
            histograms: histograms.collect(),
            failed: [0; 7],
        }
    }

    /// The same without samples.
    pub fn blank(&self) -> Self {
        let histograms = self
            .histograms
            .iter()
            .map(|one| Histogram::new(one.origin, 1.0 / one.first_per_unit()));
        Tally {
            covariant: self.covariant,
            sums: Sums::new(self.columns(), self.covariant),
            histograms: histograms.collect(),
            failed: [0; 7],
        }
    }

    /// How many columns.
    pub fn columns(&self) -> usize {
        self.histograms.len()
    }

    /// How many columns have a covariance.
    pub fn covariant(&self) -> usize {
        self.covariant
    }

    /// Where the values of a column are counted from.
    pub fn origin(&self, column: usize) -> f64 {
        self.histograms[column].origin
    }

    /// Counts values of a column, one a lane, without their moments and extremes.
    #[inline(always)]
    pub fn count_values<S: Real>(&mut self, column: usize, values: S, wanted: &[bool; LANES]) {
        let histogram = &mut self.histograms[column];
        let (origin, per_unit) = (S::splat(histogram.origin), S::splat(histogram.per_unit));
        let (mut all, mut bins) = ([0.0; LANES], [0.0; LANES]);
        values.store(&mut all);
        ((values - origin) * per_unit).store(&mut bins);
        let mut inside = true;
        for lane in 0..S::WIDTH {
            bins[lane] = bins[lane].floor();
            inside &= wanted[lane] & (bins[lane].abs() < MIDDLE as f64);
        }
        if inside {
            for bin in &bins[..S::WIDTH] {
                histogram.counts[place(*bin)] += 1;
            }
            return;
        }
        for lane in 0..S::WIDTH {
            if wanted[lane] {
                histogram.add_beyond(all[lane]);
            }
        }
    }

    /// Takes the extremes of values that are counted already.
    pub fn reach(&mut self, column: usize, extremes: [f64; 2]) {
        self.histograms[column].reach(extremes);
    }

    /// Adds the moments of samples whose values are counted one by one.
    pub fn add_sums(&mut self, sums: &Sums) {
        self.sums.add(sums);
    }

    /// Adds one sample.
    pub fn add(&mut self, values: &[f64]) {
        self.sums.count += 1;
        let mut place = 0;
        for (i, &value) in values.iter().enumerate() {
            let away = value - self.origin(i);
            self.sums.first[i] += away;
            if i < self.covariant {
                for (j, &other) in values.iter().enumerate().take(self.covariant).skip(i) {
                    self.sums.second[place] += away * (other - self.origin(j));
                    place += 1;
                }
            }
            self.histograms[i].add(value);
        }
    }

    /// Appends a column, its value in each sample that has a result.
    pub fn append(&mut self, origin: f64, width: f64, values: impl Iterator<Item = f64>) {
        let mut histogram = Histogram::new(origin, width);
        let mut sum = 0.0;
        for value in values {
            sum += value - origin;
            histogram.add(value);
        }
        self.sums.first.push(sum);
        self.histograms.push(histogram);
    }

    /// Whether another tally is of the same columns, origins and widths, so that the two can be merged.
    pub fn fits(&self, other: &Tally) -> bool {
        let same = |(one, other): (&Histogram, &Histogram)| {
            one.origin == other.origin && one.first_per_unit() == other.first_per_unit()
        };
        self.covariant == other.covariant
            && self.columns() == other.columns()
            && self.histograms.iter().zip(&other.histograms).all(same)
    }

    /// Takes its sums, which depend on the order in which they are added: what is left depends on none.
    pub fn take_sums(&mut self) -> Sums {
        let none = Sums::new(self.columns(), self.covariant);
        std::mem::replace(&mut self.sums, none)
    }

    /// Adds the samples of another tally of the same origins and widths.
    pub fn merge(&mut self, other: Tally) {
        self.sums.add(&other.sums);
        for (one, more) in self.histograms.iter_mut().zip(other.histograms) {
            one.merge(more);
        }
        for (one, more) in self.failed.iter_mut().zip(other.failed) {
            *one += more;
        }
    }

    /// Samples with a result.
    pub fn count(&self) -> u64 {
        self.sums.count
    }

    /// The mean of a column.
    pub fn mean(&self, column: usize) -> f64 {
        self.origin(column) + self.sums.first[column] / self.sums.count as f64
    }

    /// The covariance of two columns that have one: sums of products over one less than the samples.
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        let (i, j) = (one.min(other), one.max(other));
        let place = i * self.covariant - i * (i + 1) / 2 + j;
        let (count, sums) = (self.sums.count as f64, &self.sums.first);
        (self.sums.second[place] - sums[i] * sums[j] / count) / (count - 1.0)
    }

    /// The values of a column below which lie the `shares` of the samples.
    pub fn quantiles(&self, column: usize, shares: &[f64]) -> Vec<f64> {
        let distribution = self.histograms[column].distribution();
        let (mut before, mut bin) = (f64::INFINITY, 0);
        let quantile = |&share: &f64| {
            if !(share >= before) {
                bin = 0;
            }
            before = share;
            distribution.quantile_from(share, &mut bin)
        };
        shares.iter().map(quantile).collect()
    }

    /// The narrowest interval of a column that holds a `share` of the samples.
    pub fn shortest(&self, column: usize, share: f64) -> [f64; 2] {
        self.histograms[column].distribution().shortest(share)
    }

    /// Smallest and largest value of a column.
    pub fn extremes(&self, column: usize) -> [f64; 2] {
        [self.histograms[column].lowest, self.histograms[column].highest]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(count: u64) -> Vec<f64> {
        (0..count).map(|k| ((k * 2_654_435_761) % 1_000_003) as f64 / 1_000_003.0).collect()
    }

    #[test]
    fn quantiles_of_even_values_are_their_shares() {
        let mut tally = Tally::new(&[0.5], &[1e-9], 1);
        for value in values(200_000) {
            tally.add(&[value]);
        }
        for share in [0.0, 0.025, 0.3, 0.5, 0.975, 1.0] {
            assert!((tally.quantiles(0, &[share])[0] - share).abs() < 1e-3, "{share}");
        }
        let [lower, upper] = tally.shortest(0, 0.9);
        assert!((upper - lower - 0.9).abs() < 2e-3);
        assert!((tally.mean(0) - 0.5).abs() < 1e-3);
        assert!((tally.covariance(0, 0) - 1.0 / 12.0).abs() < 1e-3);
    }

    #[test]
    fn the_order_of_the_values_and_their_sharing_out_do_not_count() {
        let given = values(5000);
        let mut whole = Tally::new(&[0.0, 0.0], &[1e-6, 1e-7], 2);
        let mut parts = [whole.clone(), whole.clone()];
        for &value in &given {
            whole.add(&[value, value * value * 1e3]);
        }
        for (k, &value) in given.iter().enumerate().rev() {
            parts[k % 2].add(&[value, value * value * 1e3]);
        }
        let [mut one, other] = parts;
        one.merge(other);
        for column in 0..2 {
            let shares = [0.01, 0.4, 0.99];
            assert_eq!(whole.quantiles(column, &shares), one.quantiles(column, &shares));
            assert!((whole.mean(column) / one.mean(column) - 1.0).abs() < 1e-12);
        }
        assert!((whole.covariance(0, 1) / one.covariance(1, 0) - 1.0).abs() < 1e-10);
        assert_eq!(whole.extremes(1), one.extremes(1));
    }
}
