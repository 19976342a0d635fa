//! How many threads share a batch.

use super::CHUNK;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Range;
use std::sync::{Arc, RwLock};

/// The pool in use and the process that started its threads.
struct Started {
    process: u32,
    pool: Arc<ThreadPool>,
}

static POOL: RwLock<Option<Started>> = RwLock::new(None);

/// Threads that share a batch, at most: more than any machine has cores.
pub const MOST_THREADS: usize = 1024;

/// Uses `count` threads from now on, from one to `MOST_THREADS`.
pub fn set_threads(count: usize) {
    let pool = ThreadPoolBuilder::new().num_threads(count.clamp(1, MOST_THREADS)).build();
    // A machine that cannot start another thread works on with what it has.
    if let Ok(pool) = pool {
        let started = Started { process: std::process::id(), pool: Arc::new(pool) };
        let mut slot = POOL.write().unwrap_or_else(|poisoned| poisoned.into_inner());
        let before = slot.replace(started);
        // A fork copies no thread but its own: to end the parent's would wait on their locks.
        if let Some(before) = before.filter(|before| before.process != std::process::id()) {
            std::mem::forget(before);
        }
    }
}

/// The pool that this process started, if there is one, or else how many threads its parent used.
fn started() -> Result<Arc<ThreadPool>, Option<usize>> {
    match &*POOL.read().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        Some(started) if started.process == std::process::id() => Ok(Arc::clone(&started.pool)),
        Some(started) => Err(Some(started.pool.current_num_threads())),
        None => Err(None),
    }
}

/// The pool in use; by default a thread per core, after a fork as many as before it.
fn pool() -> Arc<ThreadPool> {
    let before = match started() {
        Ok(pool) => return pool,
        Err(before) => before,
    };
    set_threads(
        before
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |count| count.get())),
    );
    started().unwrap_or_else(|_| {
        let alone = ThreadPoolBuilder::new().use_current_thread().num_threads(1).build();
        Arc::new(alone.expect("a pool of the current thread starts no thread"))
    })
}

/// The number of threads in use.
pub fn threads() -> usize {
    pool().current_num_threads()
}

/// Calls `work(first sample, its part of a, its part of b, its part of c)` for every chunk of `count`
/// samples; `a`, `b`, `c` have the given widths per sample.
pub fn for_chunks<C: Send>(
    count: usize,
    (a, width_a): (&mut [f64], usize),
    (b, width_b): (&mut [f64], usize),
    c: &mut [C],
    work: impl Fn(usize, &mut [f64], &mut [f64], &mut [C]) + Sync,
) {
    for_tables(count, vec![(a, width_a), (b, width_b)], c, |first, tables, c| {
        let [a, b] = tables else { unreachable!("two tables are given") };
        work(first, a, b, c);
    });
}

/// Calls `work(first sample, its part of each of the tables, its part of c)` for every chunk of `count` samples;
/// each table has a width per sample.
pub fn for_tables<C: Send>(
    count: usize,
    tables: Vec<(&mut [f64], usize)>,
    c: &mut [C],
    work: impl Fn(usize, &mut [&mut [f64]], &mut [C]) + Sync,
) {
    let mut pieces = Vec::with_capacity(count.div_ceil(CHUNK));
    let (mut tables, mut c) = (tables, c);
    for first in (0..count).step_by(CHUNK) {
        let size = CHUNK.min(count - first);
        let mut parts = Vec::with_capacity(tables.len());
        for (table, width) in &mut tables {
            let (head, tail) = std::mem::take(table).split_at_mut(size * *width);
            parts.push(head);
            *table = tail;
        }
        let (head, tail) = c.split_at_mut(size);
        c = tail;
        pieces.push((first, parts, head));
    }
    if pieces.len() <= 1 || threads() == 1 {
        for (first, mut parts, c) in pieces {
            work(first, &mut parts, c);
        }
    } else {
        pool().install(|| {
            pieces.into_par_iter().for_each(|(first, mut parts, c)| work(first, &mut parts, c));
        });
    }
}

/// Shares `count` pieces of work, each with `width` of the `results`, out to the threads in runs of
/// neighbours; returns what each run made, in order.
pub fn share_out<R: Send, T: Send>(
    results: &mut [R],
    count: usize,
    width: usize,
    work: impl Fn(Range<usize>, &mut [R]) -> T + Sync,
) -> Vec<T> {
    let runs = threads().min(count).max(1);
    let mut parts = Vec::with_capacity(runs);
    let mut rest = results;
    for run in 0..runs {
        let pieces = run * count / runs..(run + 1) * count / runs;
        let (head, tail) = rest.split_at_mut(pieces.len() * width);
        parts.push((pieces, head));
        rest = tail;
    }
    if runs == 1 {
        return parts.into_iter().map(|(pieces, results)| work(pieces, results)).collect();
    }
    pool()
        .install(|| parts.into_par_iter().map(|(pieces, results)| work(pieces, results)).collect())
}
