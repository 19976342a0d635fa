//! Which instruction set runs a chunk: chosen at run time from a binary built for any machine.
//!
//! The one place with `unsafe`: calling a function compiled for an instruction set is sound only on
//! a processor that has it, which [`detected`] asks the processor itself. A [`Lanes`] of a level is
//! made only by the `run_` function of that level, so what takes one may use that level's
//! instructions.
#![allow(unsafe_code)]

use crate::scalar::{LANES, Lanes, Real};
use std::sync::atomic::{AtomicU8, Ordering};

/// Work on one chunk, written once for every kind of lane.
pub trait Work {
    /// Runs with `S` as the lanes. Must be `#[inline(always)]`, so that it is compiled for the
    /// instruction set of the function that calls it.
    fn run<S: Real>(self);
}

/// How chunks are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum InstructionSet {
    /// One sample at a time.
    Scalar = 0,
    /// Lanes, in the instructions every processor of the family has.
    Portable = 1,
    /// Lanes in 256-bit registers with fused multiply-add.
    Avx2 = 2,
    /// Lanes in 512-bit registers.
    Avx512 = 3,
}

impl InstructionSet {
    /// All, from least to most.
    pub const ALL: [InstructionSet; 4] = [
        InstructionSet::Scalar,
        InstructionSet::Portable,
        InstructionSet::Avx2,
        InstructionSet::Avx512,
    ];

    /// The word in results.
    pub fn name(self) -> &'static str {
        match self {
            InstructionSet::Scalar => "scalar",
            InstructionSet::Portable => "portable",
            InstructionSet::Avx2 => "avx2",
            InstructionSet::Avx512 => "avx512",
        }
    }
}

/// Level of [`Lanes`] that any processor runs.
pub const PORTABLE: u8 = InstructionSet::Portable as u8;
/// Level of [`Lanes`] for [`InstructionSet::Avx2`].
pub const AVX2: u8 = InstructionSet::Avx2 as u8;
/// Level of [`Lanes`] for [`InstructionSet::Avx512`].
pub const AVX512: u8 = InstructionSet::Avx512 as u8;

const UNKNOWN: u8 = u8::MAX;
static IN_USE: AtomicU8 = AtomicU8::new(UNKNOWN);

/// The most that this processor can.
fn detected() -> InstructionSet {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
        {
            return InstructionSet::Avx512;
        }
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
        {
            return InstructionSet::Avx2;
        }
    }
    InstructionSet::Portable
}

/// The instruction set in use.
pub fn instruction_set() -> InstructionSet {
    let number = IN_USE.load(Ordering::Relaxed);
    match InstructionSet::ALL.get(usize::from(number)) {
        Some(&set) => set,
        None => {
            let set = detected();
            IN_USE.store(set as u8, Ordering::Relaxed);
            set
        }
    }
}

/// Uses `set` from now on, `None` the best there is; false and no change where the processor does not
/// have it.
pub fn use_instruction_set(set: Option<InstructionSet>) -> bool {
    let best = detected();
    let set = set.unwrap_or(best);
    if set as u8 > best as u8 {
        return false;
    }
    IN_USE.store(set as u8, Ordering::Relaxed);
    true
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx512cd,avx2,fma,bmi1,bmi2")]
fn run_avx512<W: Work>(work: W) {
    work.run::<Lanes<AVX512>>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2")]
fn run_avx2<W: Work>(work: W) {
    work.run::<Lanes<AVX2>>();
}

/// Runs one chunk on the instruction set in use.
pub fn dispatch<W: Work>(work: W) {
    match instruction_set() {
        // SAFETY: `instruction_set` is never above what `detected` found on this processor.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { run_avx512(work) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { run_avx2(work) },
        // In WebAssembly lanes alone: the same numbers, and a smaller module.
        #[cfg(not(target_family = "wasm"))]
        InstructionSet::Scalar => work.run::<f64>(),
        _ => work.run::<Lanes<PORTABLE>>(),
    }
}

/// The same of work that is seldom done: in WebAssembly sample by sample, the same numbers in a module
/// that is smaller by all of its lanes.
#[inline(always)]
pub fn dispatch_seldom<W: Work>(work: W) {
    if cfg!(target_family = "wasm") { work.run::<f64>() } else { dispatch(work) }
}

/// Rows and columns of an 8 x 8 tile exchanged, by the shuffles of the lanes' level: left to itself
/// the compiler moves the 64 numbers one by one.
#[inline(always)]
pub fn transpose<const LEVEL: u8>(tile: [Lanes<LEVEL>; LANES]) -> [Lanes<LEVEL>; LANES] {
    #[cfg(target_arch = "x86_64")]
    {
        if LEVEL == AVX512 {
            // SAFETY: lanes of this level exist only where the processor has AVX-512.
            return unsafe { transpose_avx512(tile) };
        }
        if LEVEL == AVX2 {
            // SAFETY: lanes of this level exist only where the processor has AVX2.
            return unsafe { transpose_avx2(tile) };
        }
    }
    let mut result = tile;
    for i in 0..LANES {
        for k in 0..LANES {
            result[i].0[k] = tile[k].0[i];
        }
    }
    result
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx512f")]
fn transpose_avx512<const LEVEL: u8>(tile: [Lanes<LEVEL>; LANES]) -> [Lanes<LEVEL>; LANES] {
    use std::arch::x86_64::*;
    // SAFETY: eight numbers and a register of eight numbers have the same size and no invalid values.
    let row = tile.map(|lanes| unsafe { std::mem::transmute::<[f64; LANES], __m512d>(lanes.0) });
    let even = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
    let odd = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
    let mut half = row;
    for i in [0, 4] {
        // Pairs of rows, then quadruples: `half[i + c]` has columns c and c + 4 of rows i to i + 3.
        let (a, b) =
            (_mm512_unpacklo_pd(row[i], row[i + 1]), _mm512_unpackhi_pd(row[i], row[i + 1]));
        let (c, d) = (
            _mm512_unpacklo_pd(row[i + 2], row[i + 3]),
            _mm512_unpackhi_pd(row[i + 2], row[i + 3]),
        );
        half[i] = _mm512_permutex2var_pd(a, even, c);
        half[i + 1] = _mm512_permutex2var_pd(b, even, d);
        half[i + 2] = _mm512_permutex2var_pd(a, odd, c);
        half[i + 3] = _mm512_permutex2var_pd(b, odd, d);
    }
    let mut column = row;
    for c in 0..4 {
        column[c] = _mm512_shuffle_f64x2::<0x44>(half[c], half[c + 4]);
        column[c + 4] = _mm512_shuffle_f64x2::<0xEE>(half[c], half[c + 4]);
    }
    // SAFETY: as above.
    column.map(|lanes| Lanes(unsafe { std::mem::transmute::<__m512d, [f64; LANES]>(lanes) }))
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2")]
fn transpose_avx2<const LEVEL: u8>(tile: [Lanes<LEVEL>; LANES]) -> [Lanes<LEVEL>; LANES] {
    use std::arch::x86_64::*;
    let mut result = tile;
    for i in [0, 4] {
        for k in [0, 4] {
            // One 4 x 4 quarter: rows i.. and columns k.. go to rows k.. and columns i..
            let row: [__m256d; 4] = std::array::from_fn(|j| {
                // SAFETY: four numbers from k <= 4 on lie within the eight of a row.
                unsafe { _mm256_loadu_pd(tile[i + j].0.as_ptr().add(k)) }
            });
            let (a, b) = (_mm256_unpacklo_pd(row[0], row[1]), _mm256_unpackhi_pd(row[0], row[1]));
            let (c, d) = (_mm256_unpacklo_pd(row[2], row[3]), _mm256_unpackhi_pd(row[2], row[3]));
            let column = [
                _mm256_permute2f128_pd::<0x20>(a, c),
                _mm256_permute2f128_pd::<0x20>(b, d),
                _mm256_permute2f128_pd::<0x31>(a, c),
                _mm256_permute2f128_pd::<0x31>(b, d),
            ];
            for j in 0..4 {
                // SAFETY: as above.
                unsafe { _mm256_storeu_pd(result[k + j].0.as_mut_ptr().add(i), column[j]) };
            }
        }
    }
    result
}
