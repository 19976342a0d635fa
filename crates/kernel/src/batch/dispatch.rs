//! Which instruction set runs a chunk: chosen at run time from a binary built for any machine.
//!
//! The one place with `unsafe`: calling a function compiled for an instruction set is sound only on
//! a processor that has it, which [`detected`] asks the processor itself.
#![allow(unsafe_code)]

use crate::scalar::{Lanes, Real};
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
    work.run::<Lanes<true>>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2")]
fn run_avx2<W: Work>(work: W) {
    work.run::<Lanes<true>>();
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
        InstructionSet::Scalar => work.run::<f64>(),
        _ => work.run::<Lanes<false>>(),
    }
}
