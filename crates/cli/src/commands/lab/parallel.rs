//! Parallel work on several threads.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Results of `work` for 0, 1, … `count` − 1, in this order, computed on `threads` threads; by default on all cores.
pub(crate) fn in_parallel<T: Send + Sync>(
    count: usize,
    threads: Option<usize>,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or(available).clamp(1, count.max(1));
    let made: Vec<OnceLock<T>> = (0..count).map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let take = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(place) = made.get(index) else { break };
            // Cannot fail, because each index is taken once.
            let _ = place.set(work(index));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(take);
        }
    });
    made.into_iter().filter_map(OnceLock::into_inner).collect()
}
