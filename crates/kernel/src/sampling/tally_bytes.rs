//! A tally as bytes and back, so that samples can be drawn elsewhere and merged here.
//!
//! Little-endian numbers of eight bytes: columns, columns with a covariance, samples by status; the sums; and
//! of each column its origin, bins per unit, doublings, extremes, and the counts from its first to its last
//! bin with any. Every number is kept bit by bit, so merging what was given back is merging the original.

use super::tally::{BINS, Histogram, Sums, Tally};
use crate::status::Status;

/// The most columns of a tally that is read.
const MOST_COLUMNS: usize = 64;
/// Doublings from the least width of a number to the largest.
const MOST_DOUBLINGS: u64 = 2200;
/// The most samples of a tally that is read: sums of such do not overflow.
const MOST_SAMPLES: u64 = 1 << 48;

fn put(bytes: &mut Vec<u8>, number: u64) {
    bytes.extend(number.to_le_bytes());
}

/// Numbers from bytes, one after another; None where there are no more.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn number(&mut self) -> Option<u64> {
        let (first, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*first))
    }

    /// At most `limit`.
    fn size(&mut self, limit: u64) -> Option<u64> {
        self.number().filter(|&number| number <= limit)
    }

    fn float(&mut self) -> Option<f64> {
        self.number().map(f64::from_bits)
    }

    fn floats(&mut self, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.float()).collect()
    }
}

impl Sums {
    /// Appends them to bytes.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        put(bytes, self.count);
        for value in self.first.iter().chain(&self.second) {
            put(bytes, value.to_bits());
        }
    }

    /// Reads those of so many columns from the beginning of bytes, which then go on behind them.
    pub fn read(bytes: &mut &[u8], columns: usize, covariant: usize) -> Option<Sums> {
        let mut reader = Reader(bytes);
        let sums = Sums::take(&mut reader, columns, covariant)?;
        *bytes = reader.0;
        Some(sums)
    }

    fn take(reader: &mut Reader<'_>, columns: usize, covariant: usize) -> Option<Sums> {
        Some(Sums {
            count: reader.size(MOST_SAMPLES)?,
            first: reader.floats(columns)?,
            second: reader.floats(covariant * (covariant + 1) / 2)?,
            positions: Vec::new(),
        })
    }
}

impl Histogram {
    fn write(&self, bytes: &mut Vec<u8>) {
        put(bytes, self.origin.to_bits());
        put(bytes, self.per_unit.to_bits());
        put(bytes, u64::from(self.doublings));
        put(bytes, self.lowest.to_bits());
        put(bytes, self.highest.to_bits());
        let first = self.counts.iter().position(|&count| count > 0).unwrap_or(0);
        let end = self.counts.iter().rposition(|&count| count > 0).map_or(0, |last| last + 1);
        put(bytes, first as u64);
        put(bytes, end as u64);
        for &count in &self.counts[first..end.max(first)] {
            put(bytes, count);
        }
    }

    fn take(reader: &mut Reader<'_>) -> Option<Self> {
        let mut histogram = Histogram {
            origin: reader.float()?,
            per_unit: reader.float()?,
            doublings: reader.size(MOST_DOUBLINGS)? as u32,
            lowest: reader.float()?,
            highest: reader.float()?,
            counts: Box::new([0; BINS]),
        };
        let sound = histogram.origin.is_finite()
            && histogram.per_unit > 0.0
            && histogram.per_unit.is_finite();
        let first = reader.size(BINS as u64)? as usize;
        let end = reader.size(BINS as u64)? as usize;
        for count in histogram.counts.get_mut(first..end.max(first))? {
            *count = reader.size(MOST_SAMPLES)?;
        }
        sound.then_some(histogram)
    }
}

impl Tally {
    /// All that it keeps.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.columns() as u64);
        put(&mut bytes, self.covariant as u64);
        for count in self.failed {
            put(&mut bytes, count);
        }
        self.sums.write(&mut bytes);
        for histogram in &self.histograms {
            histogram.write(&mut bytes);
        }
        bytes
    }

    /// The tally that gave these bytes; None where none did.
    pub fn from_bytes(bytes: &[u8]) -> Option<Tally> {
        let mut reader = Reader(bytes);
        let columns = reader.size(MOST_COLUMNS as u64)? as usize;
        let covariant = reader.size(columns as u64)? as usize;
        let mut failed = [0; Status::ALL.len()];
        for count in &mut failed {
            *count = reader.size(MOST_SAMPLES)?;
        }
        let sums = Sums::take(&mut reader, columns, covariant)?;
        let histograms =
            (0..columns).map(|_| Histogram::take(&mut reader)).collect::<Option<_>>()?;
        reader.0.is_empty().then_some(Tally { covariant, sums, histograms, failed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tallies of parts of one set of samples, far enough apart that widths differ.
    fn parts() -> [Tally; 3] {
        let blank = Tally::new(&[0.1, -2.0, 0.0], &[1e-3, 1e-7, 1e-300], 2);
        let mut parts = [blank.clone(), blank.clone(), blank];
        for (k, tally) in parts.iter_mut().enumerate() {
            for sample in 0..3000_u64 {
                let value = ((sample * 2_654_435_761 + k as u64) % 1_000_003) as f64 / 3.0e5;
                tally.add(&[value, value.sin() * 10.0_f64.powi(k as i32), value * 1e-290]);
            }
            tally.failed[k + 2] += 7 * k as u64;
        }
        parts
    }

    #[test]
    fn what_is_given_back_is_what_was_taken() {
        let [one, ..] = parts();
        for tally in [one.blank(), one] {
            assert_eq!(Tally::from_bytes(&tally.to_bytes()), Some(tally));
        }
    }

    #[test]
    fn merging_what_was_given_back_is_merging_the_original_bit_by_bit() {
        let [mut whole, two, three] = parts();
        let mut given_back = Tally::from_bytes(&whole.to_bytes()).expect("of a tally");
        for part in [two, three] {
            assert!(whole.fits(&part));
            let again = Tally::from_bytes(&part.to_bytes()).expect("of a tally");
            assert!(given_back.fits(&again));
            whole.merge(part);
            given_back.merge(again);
        }
        assert_eq!(whole.to_bytes(), given_back.to_bytes());
        assert_eq!(whole.count(), 9000);
        for column in 0..3 {
            assert_eq!(whole.mean(column).to_bits(), given_back.mean(column).to_bits());
        }
        assert_eq!(whole.covariance(0, 1).to_bits(), given_back.covariance(0, 1).to_bits());
        let shares = [0.0, 0.025, 0.5, 0.975, 1.0];
        assert_eq!(whole.quantiles(1, &shares), given_back.quantiles(1, &shares));
    }

    #[test]
    fn sums_are_taken_and_given_back_by_themselves() {
        let [mut tally, ..] = parts();
        let before = tally.clone();
        let sums = tally.take_sums();
        assert_eq!(tally.count(), 0);
        let mut bytes = Vec::new();
        sums.write(&mut bytes);
        sums.write(&mut bytes);
        let mut rest = bytes.as_slice();
        for _ in 0..2 {
            assert_eq!(Sums::read(&mut rest, 3, 2).as_ref(), Some(&sums));
        }
        assert!(rest.is_empty());
        tally.add_sums(&sums);
        assert_eq!(tally, before);
    }

    #[test]
    fn other_bytes_are_no_tally() {
        let [one, ..] = parts();
        let bytes = one.to_bytes();
        for end in (0..bytes.len()).step_by(5) {
            assert_eq!(Tally::from_bytes(&bytes[..end]), None);
        }
        let longer: Vec<u8> = bytes.iter().copied().chain([0]).collect();
        assert_eq!(Tally::from_bytes(&longer), None);
        for place in 0..bytes.len() {
            let mut spoilt = bytes.clone();
            spoilt[place] ^= 0x55;
            // Whatever it is: it is merged, or is none.
            if let Some(mut tally) = Tally::from_bytes(&spoilt) {
                tally.merge(one.clone());
                assert!(tally.quantiles(0, &[0.5]).len() == 1);
            }
        }
        assert!(!one.fits(&Tally::new(&[0.1, -2.0, 0.0], &[1e-3, 1e-7, 1e-200], 2)));
        assert!(!one.fits(&Tally::new(&[0.1, -2.0], &[1e-3, 1e-7], 2)));
    }
}
