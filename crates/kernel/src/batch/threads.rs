//! How many threads share a batch, where there are any.

use super::CHUNK;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Range;
use std::sync::{Arc, RwLock};

/// Who shares a batch.
#[derive(Clone)]
enum Workers {
    /// The thread that asks: no other can be started.
    Alone,
    /// The threads of a pool.
    Pool(Arc<ThreadPool>),
}

impl Workers {
    fn count(&self) -> usize {
        match self {
            Workers::Alone => 1,
            Workers::Pool(pool) => pool.current_num_threads(),
        }
    }
}

/// Those in use and the process that started them.
struct Started {
    process: u32,
    workers: Workers,
}

static STARTED: RwLock<Option<Started>> = RwLock::new(None);

/// Threads that share a batch, at most: more than any machine has cores.
pub const MOST_THREADS: usize = 1024;

/// Whether threads can be started at all. WebAssembly has none: rayon would make the asking thread a pool,
/// which it does only once. What asks for this first is not compiled in there.
const THERE_ARE_THREADS: bool = !cfg!(target_family = "wasm");

/// The number of this process; WebAssembly's has none.
fn process() -> u32 {
    if THERE_ARE_THREADS { std::process::id() } else { 0 }
}

/// Uses `count` threads from now on, from one to `MOST_THREADS`.
pub fn set_threads(count: usize) {
    let pool = if THERE_ARE_THREADS {
        ThreadPoolBuilder::new().num_threads(count.clamp(1, MOST_THREADS)).build().ok()
    } else {
        None
    };
    use_pool(pool);
}

/// Uses a pool from now on. None: a machine that cannot start another thread works on with those that it
/// has, and without any on the thread that asks.
fn use_pool(pool: Option<ThreadPool>) {
    let process = process();
    let mut slot = STARTED.write().unwrap_or_else(|poisoned| poisoned.into_inner());
    let workers = match pool {
        Some(pool) => Workers::Pool(Arc::new(pool)),
        None if slot.as_ref().is_some_and(|before| before.process == process) => return,
        None => Workers::Alone,
    };
    let before = slot.replace(Started { process, workers });
    // A fork copies no thread but its own: to end the parent's would wait on their locks.
    if let Some(before) = before.filter(|before| before.process != process) {
        std::mem::forget(before);
    }
}

/// Those that this process started, if it did, or else how many threads its parent used.
fn started() -> Result<Workers, Option<usize>> {
    match &*STARTED.read().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        Some(started) if started.process == process() => Ok(started.workers.clone()),
        Some(started) => Err(Some(started.workers.count())),
        None => Err(None),
    }
}

/// Those in use; by default a thread per core, after a fork as many as before it.
fn workers() -> Workers {
    let before = match started() {
        Ok(workers) => return workers,
        Err(before) => before,
    };
    set_threads(
        before
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |count| count.get())),
    );
    started().unwrap_or(Workers::Alone)
}

/// The number of threads in use.
pub fn threads() -> usize {
    workers().count()
}

/// Runs work that rayon shares out.
fn install<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match workers() {
        // rayon is not asked: without a pool it would make one.
        Workers::Alone => work(),
        Workers::Pool(pool) => pool.install(work),
    }
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
    if !THERE_ARE_THREADS || pieces.len() <= 1 || threads() == 1 {
        for (first, mut parts, c) in pieces {
            work(first, &mut parts, c);
        }
    } else {
        install(|| {
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
    let runs = if THERE_ARE_THREADS { threads().min(count).max(1) } else { 1 };
    let mut parts = Vec::with_capacity(runs);
    let mut rest = results;
    for run in 0..runs {
        let pieces = run * count / runs..(run + 1) * count / runs;
        let (head, tail) = rest.split_at_mut(pieces.len() * width);
        parts.push((pieces, head));
        rest = tail;
    }
    if !THERE_ARE_THREADS || runs == 1 {
        return parts.into_iter().map(|(pieces, results)| work(pieces, results)).collect();
    }
    install(|| parts.into_par_iter().map(|(pieces, results)| work(pieces, results)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers_of(count: usize) -> Vec<f64> {
        let mut numbers = vec![0.0; count];
        let mut marks = vec![0; count];
        for_tables(count, vec![(&mut numbers, 1)], &mut marks, |first, tables, marks| {
            for (at, (number, mark)) in tables[0].iter_mut().zip(marks).enumerate() {
                (*number, *mark) = ((first + at) as f64, 1);
            }
        });
        assert!(marks.iter().all(|&mark| mark == 1));
        numbers
    }

    /// One test, because the threads in use are everyone's.
    #[test]
    fn batch_after_batch_is_done_where_no_thread_can_be_started() {
        let expected: Vec<f64> = (0..20_000).map(f64::from).collect();
        let slot = || STARTED.write().unwrap_or_else(|poisoned| poisoned.into_inner());
        *slot() = None;
        use_pool(None);
        assert_eq!(threads(), 1);
        for _ in 0..3 {
            assert_eq!(numbers_of(20_000), expected);
            assert_eq!(numbers_of(CHUNK + 1), expected[..=CHUNK]);
            let mut squares = vec![0; 1000];
            let runs = share_out(&mut squares, 1000, 1, |pieces, squares| {
                for (piece, square) in pieces.clone().zip(squares) {
                    *square = piece * piece;
                }
                pieces
            });
            assert_eq!((runs.len(), runs[0].clone()), (1, 0..1000));
            assert_eq!(squares[999], 999 * 999);
            assert_eq!(install(|| 7), 7);
        }
        // Where one can be, as many as are asked for; and those stay where the next ones cannot.
        if THERE_ARE_THREADS {
            set_threads(3);
            use_pool(None);
            assert_eq!(threads(), 3);
            assert_eq!(numbers_of(20_000), expected);
            assert_eq!(share_out(&mut [(); 6], 6, 1, |pieces, _| pieces), [0..2, 2..4, 4..6]);
        }
    }
}
