//! Counter-based random numbers, many samples side by side.
//!
//! Threefry-2x64 with 13 rounds (Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as
//! 1, 2, 3", SC 2011, which reports that 13 rounds pass BigCrush): additions, exclusive ors and rotations,
//! which every vector unit has, where the counter-based generators with products do not vectorise.

use crate::scalar::{LANES, Real};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, LN_2};

/// Registers whose words are made together, so that one's rounds fill the other's waits.
const REGISTERS: usize = 4;

/// Samples whose words are made together.
pub const GROUP: usize = REGISTERS * LANES;

/// One word for each of the samples of a group.
pub type Words = [u64; GROUP];

const PARITY: u64 = 0x1BD1_1BDA_A9FC_1A22;

/// Eight words. Every operation is a plain loop of its own: the compiler makes each one instruction.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Register([u64; LANES]);

impl Register {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        let mut result = self.0;
        for k in 0..LANES {
            result[k] = result[k].wrapping_add(other.0[k]);
        }
        Register(result)
    }

    #[inline(always)]
    fn exclusive_or(self, other: Self) -> Self {
        let mut result = self.0;
        for k in 0..LANES {
            result[k] ^= other.0[k];
        }
        Register(result)
    }

    #[inline(always)]
    fn turned<const BITS: u32>(self) -> Self {
        let mut result = self.0;
        for k in 0..LANES {
            result[k] = result[k].rotate_left(BITS);
        }
        Register(result)
    }
}

type Registers = [Register; REGISTERS];

/// One round of the cipher.
#[inline(always)]
fn round<const BITS: u32>(x: &mut Registers, y: &mut Registers) {
    for j in 0..REGISTERS {
        x[j] = x[j].plus(y[j]);
        y[j] = y[j].turned::<BITS>().exclusive_or(x[j]);
    }
}

/// Adds the key.
#[inline(always)]
fn inject(x: &mut Registers, y: &mut Registers, first: u64, second: u64) {
    for j in 0..REGISTERS {
        x[j] = x[j].plus(Register([first; LANES]));
        y[j] = y[j].plus(Register([second; LANES]));
    }
}

/// Two words for each of the counters `(first + k, second)` under one key.
#[inline(always)]
pub fn threefry(key: [u64; 2], first: u64, second: u64) -> [Words; 2] {
    let schedule = [key[0], key[1], PARITY ^ key[0] ^ key[1]];
    let mut x = [Register([0; LANES]); REGISTERS];
    let mut y = [Register([second; LANES]); REGISTERS];
    for j in 0..REGISTERS {
        for k in 0..LANES {
            x[j].0[k] = first.wrapping_add((j * LANES + k) as u64);
        }
    }
    inject(&mut x, &mut y, schedule[0], schedule[1]);
    round::<16>(&mut x, &mut y);
    round::<42>(&mut x, &mut y);
    round::<12>(&mut x, &mut y);
    round::<31>(&mut x, &mut y);
    inject(&mut x, &mut y, schedule[1], schedule[2].wrapping_add(1));
    round::<16>(&mut x, &mut y);
    round::<32>(&mut x, &mut y);
    round::<24>(&mut x, &mut y);
    round::<21>(&mut x, &mut y);
    inject(&mut x, &mut y, schedule[2], schedule[0].wrapping_add(2));
    round::<16>(&mut x, &mut y);
    round::<42>(&mut x, &mut y);
    round::<12>(&mut x, &mut y);
    round::<31>(&mut x, &mut y);
    inject(&mut x, &mut y, schedule[0], schedule[1].wrapping_add(3));
    round::<16>(&mut x, &mut y);
    let mut words = [[0; GROUP]; 2];
    for (words, registers) in words.iter_mut().zip([&x, &y]) {
        for (words, register) in words.chunks_exact_mut(LANES).zip(registers) {
            words.copy_from_slice(&register.0);
        }
    }
    words
}

/// Numbers in [1, 2), each as likely: the upper 52 bits.
#[inline(always)]
pub fn one_to_two(words: &Words) -> [f64; GROUP] {
    let mut result = [0.0; GROUP];
    for k in 0..GROUP {
        result[k] = f64::from_bits((words[k] >> 12) | 0x3FF0_0000_0000_0000);
    }
    result
}

/// Sine and cosine of angles that are as likely anywhere: an angle within an eighth of a turn of 0, by the
/// Taylor polynomials to degree 15 and 16, then turned by a random number of quarters.
#[inline(always)]
fn direction<S: Real>(words: &[u64], turn: &[f64]) -> (S, S) {
    let x = (S::load(turn) - S::splat(1.5)) * S::splat(FRAC_PI_2);
    let x2 = x.square();
    let mut sine = S::splat(-1.0 / 1_307_674_368_000.0);
    for term in [
        1.0 / 6_227_020_800.0,
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
    ] {
        sine = sine.mul_add(x2, S::splat(term));
    }
    let sine = (sine * x2).mul_add(x, x);
    let mut cosine = S::splat(1.0 / 20_922_789_888_000.0);
    for term in [
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0,
    ] {
        cosine = cosine.mul_add(x2, S::splat(term));
    }
    let (mut s, mut c) = ([0.0; LANES], [0.0; LANES]);
    sine.store(&mut s);
    cosine.store(&mut c);
    // The two lowest bits, which the angle does not use: whether to swap, and both signs.
    let (mut sines, mut cosines) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..S::WIDTH {
        let sign = words[k] << 63;
        let swap = words[k] & 2 != 0;
        sines[k] = f64::from_bits(if swap { c[k] } else { s[k] }.to_bits() ^ sign);
        cosines[k] = f64::from_bits(if swap { -s[k] } else { c[k] }.to_bits() ^ sign);
    }
    (S::load(&sines), S::load(&cosines))
}

/// Numbers of single precision in one register. No operation fuses, so that every processor makes the same
/// numbers to the last bit.
const HALVES: usize = 2 * LANES;

#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Singles([f32; HALVES]);

macro_rules! single_wise {
    ($name:ident, $operator:tt) => {
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            let mut result = self.0;
            for k in 0..HALVES {
                result[k] $operator other.0[k];
            }
            Singles(result)
        }
    };
}

impl Singles {
    single_wise!(plus, +=);
    single_wise!(minus, -=);
    single_wise!(times, *=);
    single_wise!(over, /=);

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Singles([value; HALVES])
    }

    #[inline(always)]
    fn root(self) -> Self {
        let mut result = self.0;
        for k in 0..HALVES {
            result[k] = result[k].sqrt();
        }
        Singles(result)
    }

    /// A polynomial by Horner's rule, the highest coefficient first.
    #[inline(always)]
    fn polynomial<const N: usize>(self, coefficients: [f32; N]) -> Self {
        let mut sum = Self::splat(coefficients[0]);
        for k in 1..N {
            sum = sum.times(self).plus(Self::splat(coefficients[k]));
        }
        sum
    }
}

/// The radius of two normal numbers, sqrt(-2 ln u), from the upper half of a word.
///
/// u = (k + 1/2) 2^-31: up to 6.7 standard deviations. The logarithm is that of the exponent and of the
/// mantissa in [sqrt(1/2), sqrt(2)), ln m = 2 artanh((m - 1) / (m + 1)), whose series to degree 9 is
/// truncated below 1e-8.
#[inline(always)]
fn radius(words: &[u64]) -> Singles {
    const ROOT_HALF: u32 = 0x3F35_04F3;
    let (mut mantissa, mut exponent) = ([0.0; HALVES], [0.0; HALVES]);
    for k in 0..HALVES {
        let unit = ((words[k] >> 33) as i32 as f32 + 0.5) * (1.0 / 2_147_483_648.0);
        let bits = unit.to_bits();
        let shift = (bits.wrapping_sub(ROOT_HALF) as i32) >> 23;
        mantissa[k] = f32::from_bits(bits.wrapping_sub((shift << 23) as u32));
        exponent[k] = shift as f32;
    }
    let (m, e) = (Singles(mantissa), Singles(exponent));
    let one = Singles::splat(1.0);
    let s = m.minus(one).over(m.plus(one));
    let series = s.times(s).polynomial([1.0 / 9.0, 1.0 / 7.0, 0.2, 1.0 / 3.0, 1.0]);
    // -2 ln u, never below 0: u may be rounded to 1.
    let twice = e
        .times(Singles::splat(-2.0 * LN_2 as f32))
        .plus(s.times(Singles::splat(-4.0)).times(series));
    let mut square = twice.0;
    for value in &mut square {
        *value = if *value > 0.0 { *value } else { 0.0 };
    }
    Singles(square).root()
}

/// Cosine and sine of an angle that is as likely anywhere, from the lower half of a word: within an eighth
/// of a turn of 0, by the Taylor polynomials to degree 9 and 8 (truncated below 3e-8), then turned by as
/// many quarters as the last two bits say, which the angle itself has no use for.
#[inline(always)]
fn cosine_and_sine(words: &[u64]) -> [Singles; 2] {
    const STEP: f32 = (FRAC_PI_4 / 2_147_483_648.0) as f32;
    let mut angle = [0.0; HALVES];
    for k in 0..HALVES {
        angle[k] = words[k] as u32 as i32 as f32 * STEP;
    }
    let x = Singles(angle);
    let x2 = x.times(x);
    let terms = [1.0 / 362_880.0, -1.0 / 5_040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0];
    let sine = x.times(x2.polynomial(terms));
    let cosine = x2.polynomial([1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5, 1.0]);
    let (mut c, mut s) = (cosine.0, sine.0);
    for k in 0..HALVES {
        let sign = (words[k] as u32) << 31;
        let swap = words[k] & 2 != 0;
        let (from, to) = (cosine.0[k], sine.0[k]);
        c[k] = f32::from_bits(if swap { -to } else { from }.to_bits() ^ sign);
        s[k] = f32::from_bits(if swap { from } else { to }.to_bits() ^ sign);
    }
    [Singles(c), Singles(s)]
}

/// Four independent standard normal numbers for each sample, from two words (Box & Muller 1958).
///
/// In single precision: their distribution is right to 1e-7 of its width, far below what any number of
/// samples can tell, at a third of the time.
#[inline(always)]
pub fn normal_quad(words: &[Words; 2], into: &mut [[f64; GROUP]; 4]) {
    for (word, words) in words.iter().enumerate() {
        for at in (0..GROUP).step_by(HALVES) {
            let radius = radius(&words[at..at + HALVES]);
            for (turn, factor) in cosine_and_sine(&words[at..at + HALVES]).iter().enumerate() {
                let values = radius.times(*factor);
                let row = &mut into[2 * word + turn][at..at + HALVES];
                for k in 0..HALVES {
                    row[k] = f64::from(values.0[k]);
                }
            }
        }
    }
}

/// The cosine of an angle that is as likely anywhere, for each sample.
#[inline(always)]
pub fn cosine<S: Real>(words: &Words, into: &mut [f64]) {
    let turn = one_to_two(words);
    for at in (0..GROUP).step_by(S::WIDTH) {
        direction::<S>(&words[at..], &turn[at..]).1.store(&mut into[at..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers of the authors' library Random123 (tests/kat_vectors), threefry2x64 with 13 rounds.
    #[test]
    fn words_are_those_of_the_known_answers() {
        let cases = [
            ([0_u64; 2], [0_u64; 2], [0xf167_b032_c3b4_80bd, 0xe91f_9fee_4b7a_6fb5]),
            ([u64::MAX; 2], [u64::MAX; 2], [0xccde_c5c9_17a8_74b1, 0x4df5_3abc_a26c_eb01]),
            (
                [0xa409_3822_299f_31d0, 0x082e_fa98_ec4e_6c89],
                [0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344],
                [0xc3aa_c715_6104_2993, 0x3fe7_ae88_01af_f316],
            ),
        ];
        for (key, counter, answer) in cases {
            for k in [0, 1, 7, 31] {
                let [x, y] = threefry(key, counter[0].wrapping_sub(k), counter[1]);
                assert_eq!([x[k as usize], y[k as usize]], answer);
            }
        }
    }

    #[test]
    fn radius_and_direction_are_those_of_the_library() {
        for k in 0..100_000_u64 {
            let upper = k * 21_474 + k % 7;
            let words = [upper << 33; HALVES];
            let unit = (upper as f64 + 0.5) / 2f64.powi(31);
            let expected = (-2.0 * unit.ln()).sqrt();
            // A number near 1 has 24 bits: its logarithm is right to 6e-8, not relative to itself.
            let slack = 3e-7 * expected + 3e-7 / expected.max(3e-4);
            assert!((f64::from(radius(&words).0[3]) - expected).abs() < slack, "{unit}");
            for quarter in 0..4 {
                let lower = ((k * 42_949) as u32) & !3 | quarter;
                let [c, s] = cosine_and_sine(&[u64::from(lower); HALVES]);
                let turn = [0.0, 2.0, 1.0, 3.0][quarter as usize] * FRAC_PI_2;
                let angle = f64::from(lower as i32) / 2f64.powi(31) * 0.5 * FRAC_PI_2 + turn;
                assert!((f64::from(c.0[5]) - angle.cos()).abs() < 4e-7);
                assert!((f64::from(s.0[5]) - angle.sin()).abs() < 4e-7);
                let fraction = (k as f64 + 0.5) / 100_000.0;
                let (sine, cosine) = direction::<f64>(&[u64::from(quarter)], &[1.0 + fraction]);
                let angle = (fraction - 0.5) * FRAC_PI_2 + turn;
                assert!((sine - angle.sin()).abs() < 1e-15 && (cosine - angle.cos()).abs() < 1e-15);
            }
        }
        let most = f64::from(radius(&[0; HALVES]).0[0]);
        assert!((most - (64.0 * LN_2).sqrt()).abs() < 1e-6);
        assert_eq!(radius(&[u64::MAX; HALVES]).0[0], 0.0);
    }

    #[test]
    fn normal_numbers_have_the_moments_of_the_normal_distribution() {
        let (mut sums, mut cross, count) = ([0.0; 4], [0.0; 6], 1_000_000);
        for group in 0..count / (4 * GROUP) {
            let words = threefry([7, 0], (group * GROUP) as u64, 3);
            let mut normal = [[0.0; GROUP]; 4];
            normal_quad(&words, &mut normal);
            for k in 0..GROUP {
                let mut pair = 0;
                for i in 0..4 {
                    for j in 0..i {
                        cross[pair] += normal[i][k] * normal[j][k] / (count / 4) as f64;
                        pair += 1;
                    }
                    for (power, sum) in sums.iter_mut().enumerate() {
                        *sum += normal[i][k].powi(power as i32 + 1) / count as f64;
                    }
                }
            }
        }
        // Standard deviations of the four means: 1, sqrt 2, sqrt 15, sqrt 96, over sqrt(count).
        let sigmas = [1.0, 2f64.sqrt(), 15f64.sqrt(), 96f64.sqrt()].map(|s| 4.0 * s / 1e3);
        for ((moment, expected), sigma) in sums.iter().zip([0.0, 1.0, 0.0, 3.0]).zip(sigmas) {
            assert!((moment - expected).abs() < sigma, "{sums:?}");
        }
        for product in cross {
            assert!(product.abs() < 4.0 / (count as f64 / 4.0).sqrt(), "{cross:?}");
        }
    }
}
