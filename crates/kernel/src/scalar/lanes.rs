//! Eight samples side by side, as plain arrays that the compiler turns into vector registers.
//!
//! No vector crate: those either fix the instruction set when compiled or hide the lanes. A newtype
//! over `[f64; 8]`, compiled once per instruction set (see [`crate::dispatch`]), measured fastest.

use super::{Real, Scalar};
use crate::dispatch::{PORTABLE, transpose};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Samples in one [`Lanes`]: one 512-bit or two 256-bit registers.
pub const LANES: usize = 8;

/// Eight `f64`. `LEVEL`: the instruction set that the code around is compiled for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Lanes<const LEVEL: u8>(pub [f64; LANES]);

/// The lanes whose number `k` is an expression of `k`, as a plain loop.
macro_rules! lanes {
    ($k:ident => $value:expr) => {{
        let mut result = [0.0; LANES];
        for $k in 0..LANES {
            result[$k] = $value;
        }
        Lanes(result)
    }};
}

macro_rules! lane_wise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<const LEVEL: u8> $trait for Lanes<LEVEL> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                lanes!(k => self.0[k] $operator other.0[k])
            }
        }
    };
}
lane_wise!(Add, add, +);
lane_wise!(Sub, sub, -);
lane_wise!(Mul, mul, *);
lane_wise!(Div, div, /);

impl<const LEVEL: u8> Neg for Lanes<LEVEL> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        lanes!(k => -self.0[k])
    }
}

impl<const LEVEL: u8> Scalar for Lanes<LEVEL> {
    #[inline(always)]
    fn lift(self, value: f64) -> Self {
        Lanes([value; LANES])
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        lanes!(k => if LEVEL > PORTABLE {
            self.0[k].mul_add(factor.0[k], term.0[k])
        } else {
            self.0[k] * factor.0[k] + term.0[k]
        })
    }
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
    #[inline(always)]
    fn square_plus(self, term: Self) -> Self {
        self.mul_add(self, term)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        lanes!(k => self.0[k].sqrt())
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }
    // Only a crank's inverse asks for it, once a pose; the library's is good enough there.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        lanes!(k => self.0[k].atan2(x.0[k]))
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        lanes!(k => if self.0[k] >= 0.0 { then.0[k] } else { otherwise.0[k] })
    }
}

impl<const LEVEL: u8> Real for Lanes<LEVEL> {
    const WIDTH: usize = LANES;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Lanes([value; LANES])
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane]
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane] = value;
    }
    #[inline(always)]
    fn load(values: &[f64]) -> Self {
        let mut result = [0.0; LANES];
        result.copy_from_slice(&values[..LANES]);
        Lanes(result)
    }
    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        values[..LANES].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn abs(self) -> Self {
        lanes!(k => self.0[k].abs())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let mut result = self.0;
        for k in 0..LANES {
            // Twice, so that a NaN on either side stays.
            result[k] = if self.0[k] <= other.0[k] { self.0[k] } else { other.0[k] };
            result[k] = if self.0[k].is_nan() { self.0[k] } else { result[k] };
        }
        Lanes(result)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        lanes!(k => if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] })
    }
    #[inline(always)]
    fn all_below(self, limit: f64) -> bool {
        let mut below = true;
        for k in 0..LANES {
            below &= self.0[k] < limit;
        }
        below
    }
    #[inline(always)]
    fn load_rows(rows: &[f64], count: usize, columns: &mut [Self]) {
        let width = columns.len();
        if count < LANES || rows.len() < (LANES - 1) * width + width.max(LANES) {
            for k in 0..LANES {
                let row = &rows[k.min(count - 1) * width..][..width];
                for (column, &value) in columns.iter_mut().zip(row) {
                    column.0[k] = value;
                }
            }
        } else if width < LANES {
            // A narrow row is read as a whole tile, with the beginning of the next.
            let tile = load_tile(rows, width);
            for (column, &lanes) in columns.iter_mut().zip(&tile) {
                *column = lanes;
            }
        } else {
            for first in tiles(width) {
                columns[first..first + LANES].copy_from_slice(&load_tile(&rows[first..], width));
            }
        }
    }
    #[inline(always)]
    fn store_rows(columns: &[Self], rows: &mut [f64], stride: usize, count: usize) {
        let width = columns.len();
        if count < LANES || (width < LANES && stride != width) {
            for k in 0..count {
                let row = &mut rows[k * stride..k * stride + width];
                for (value, column) in row.iter_mut().zip(columns) {
                    *value = column.0[k];
                }
            }
        } else if width < LANES {
            // A narrow row is written as a whole tile, whose end the next row overwrites; the last
            // row alone is cut.
            let mut tile = [Lanes([0.0; LANES]); LANES];
            for (lanes, &column) in tile.iter_mut().zip(columns) {
                *lanes = column;
            }
            let tile = transpose(tile);
            for k in 0..LANES - 1 {
                let rest = &mut rows[k * width..];
                if rest.len() < LANES {
                    rest[..width].copy_from_slice(&tile[k].0[..width]);
                } else {
                    rest[..LANES].copy_from_slice(&tile[k].0);
                }
            }
            let last = &mut rows[(LANES - 1) * width..LANES * width];
            for (value, &number) in last.iter_mut().zip(&tile[LANES - 1].0) {
                *value = number;
            }
        } else {
            for first in tiles(width) {
                let mut tile = [Lanes([0.0; LANES]); LANES];
                tile.copy_from_slice(&columns[first..first + LANES]);
                let tile = transpose(tile);
                for k in 0..LANES {
                    rows[k * stride + first..][..LANES].copy_from_slice(&tile[k].0);
                }
            }
        }
    }
}

/// Eight numbers of each of eight rows, as eight columns.
#[inline(always)]
fn load_tile<const LEVEL: u8>(rows: &[f64], width: usize) -> [Lanes<LEVEL>; LANES] {
    let mut tile = [Lanes([0.0; LANES]); LANES];
    for k in 0..LANES {
        tile[k].0.copy_from_slice(&rows[k * width..][..LANES]);
    }
    transpose(tile)
}

/// Where the 8-wide tiles of `width >= 8` columns begin; the last may overlap the one before.
#[inline(always)]
fn tiles(width: usize) -> impl Iterator<Item = usize> {
    (0..width.div_ceil(LANES)).map(move |tile| (tile * LANES).min(width - LANES))
}

/// Sine and cosine by reduction to [-pi/4, pi/4] (pi/2 in three parts, after Cody & Waite 1980) and
/// the Taylor polynomials to degree 17 and 18, whose truncation there is below 1e-17.
///
/// Relative to the library's the difference stays below 4e-16 for angles up to 1e5 rad, far beyond
/// any joint.
#[inline(always)]
fn sin_cos<const LEVEL: u8>(angle: Lanes<LEVEL>) -> (Lanes<LEVEL>, Lanes<LEVEL>) {
    // pi/2 as a sum of three numbers; the first two have 33 significant bits, so that their
    // products with the quadrant are exact.
    const FIRST: f64 = 1.570_796_326_734_125_6;
    const SECOND: f64 = 6.077_100_506_303_966e-11;
    const THIRD: f64 = 2.022_266_248_795_950_6e-21;
    // Adding and subtracting 1.5 * 2^52 rounds to the nearest whole number.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let mut sine = [0.0; LANES];
    let mut cosine = [0.0; LANES];
    for k in 0..LANES {
        let shifted = angle.0[k] * std::f64::consts::FRAC_2_PI + ROUND;
        let quadrant = shifted - ROUND;
        let x = ((angle.0[k] - quadrant * FIRST) - quadrant * SECOND) - quadrant * THIRD;
        let x2 = x * x;
        let mut s = 1.0 / 355_687_428_096_000.0;
        for term in [
            -1.0 / 1_307_674_368_000.0,
            1.0 / 6_227_020_800.0,
            -1.0 / 39_916_800.0,
            1.0 / 362_880.0,
            -1.0 / 5_040.0,
            1.0 / 120.0,
            -1.0 / 6.0,
        ] {
            s = s * x2 + term;
        }
        let s = x + x * (x2 * s);
        let mut c = -1.0 / 6_402_373_705_728_000.0;
        for term in [
            1.0 / 20_922_789_888_000.0,
            -1.0 / 87_178_291_200.0,
            1.0 / 479_001_600.0,
            -1.0 / 3_628_800.0,
            1.0 / 40_320.0,
            -1.0 / 720.0,
            1.0 / 24.0,
        ] {
            c = c * x2 + term;
        }
        let c = 1.0 - (0.5 * x2 - x2 * x2 * c);
        // The lowest bits of the shifted number are the quadrant modulo 4.
        let bits = shifted.to_bits();
        let (s, c) = if bits & 1 == 0 { (s, c) } else { (c, s) };
        sine[k] = if bits & 2 == 0 { s } else { -s };
        cosine[k] = if (bits.wrapping_add(1)) & 2 == 0 { c } else { -c };
    }
    (Lanes(sine), Lanes(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        let mut worst = 0.0_f64;
        for i in 0..200_000 {
            let first = (i as f64 - 100_000.0) * 0.37e-3;
            let angles: [f64; LANES] = std::array::from_fn(|k| first * (1.0 + 10.0 * k as f64));
            let (sine, cosine) = Lanes::<PORTABLE>(angles).sin_cos();
            for k in 0..LANES {
                let (s, c) = angles[k].sin_cos();
                worst = worst.max((sine.0[k] - s).abs()).max((cosine.0[k] - c).abs());
            }
        }
        assert!(worst < 4e-16, "{worst:e}");
    }

    #[test]
    fn rows_are_stored_sample_by_sample() {
        for width in [1, 5, 8, 19] {
            for count in [1, 3, 8] {
                let columns: Vec<Lanes<PORTABLE>> = (0..width)
                    .map(|j| Lanes(std::array::from_fn(|k| (100 * k + j) as f64)))
                    .collect();
                // What stands behind the rows must stay.
                let mut rows = vec![-1.0; count * width + 3];
                let behind = rows.split_off(count * width);
                Lanes::store_rows(&columns, &mut rows, width, count);
                let mut back = vec![Lanes::<PORTABLE>::default(); width];
                Lanes::load_rows(&rows, count, &mut back);
                assert_eq!(behind, [-1.0; 3]);
                rows.extend(&behind);
                let mut again = vec![Lanes::<PORTABLE>::default(); width];
                Lanes::load_rows(&rows, count, &mut again);
                assert_eq!(again, back);
                for (column, back) in columns.iter().zip(&back) {
                    for k in 0..LANES {
                        assert_eq!(back.0[k], column.0[k.min(count - 1)]);
                    }
                }
                for k in 0..count {
                    for j in 0..width {
                        assert_eq!(rows[k * width + j], (100 * k + j) as f64);
                    }
                }
            }
        }
    }

    #[test]
    fn the_smaller_keeps_a_nan_from_either_side() {
        let nan = Lanes::<PORTABLE>::splat(f64::NAN);
        let one = Lanes::splat(1.0);
        assert!(nan.min(one).0[3].is_nan() && one.min(nan).0[3].is_nan());
        assert!(Real::min(f64::NAN, 1.0).is_nan() && Real::min(1.0, f64::NAN).is_nan());
        assert_eq!(Real::min(2.0, 1.0), 1.0);
    }

    #[test]
    fn the_larger_keeps_the_other_beside_a_nan() {
        let nan = Lanes::<PORTABLE>::splat(f64::NAN);
        let (one, two) = (Lanes::splat(1.0), Lanes::splat(2.0));
        assert!(one.larger(nan).0[5].is_nan() && Real::larger(1.0, f64::NAN).is_nan());
        assert_eq!((nan.larger(one), two.larger(one), one.larger(two)), (one, two, two));
        assert_eq!(Real::larger(f64::NAN, 1.0), 1.0);
        assert_eq!((Real::larger(2.0, 1.0), Real::larger(1.0, 2.0)), (2.0, 2.0));
    }

    #[test]
    fn a_nan_lane_is_not_below() {
        assert!(Lanes::<PORTABLE>([1.0, 3.0, 2.0, 0.0, -4.0, 0.0, 0.0, 0.0]).all_below(3.1));
        for k in 0..LANES {
            for value in [f64::NAN, 2.0, f64::INFINITY] {
                let mut values = [1.0; LANES];
                values[k] = value;
                assert!(!Lanes::<PORTABLE>(values).all_below(2.0));
            }
        }
    }
}
