//! Work on all cores; the result does not depend on their number.

use std::ops::Range;
use std::thread;

/// Largest number of threads: more would be limited by memory bandwidth.
const THREADS: usize = 8;
/// Smallest number of items per thread: starting a thread costs as much as some hundred of them.
const LEAST: usize = 512;

/// `work` on consecutive parts of `0..count`, in order.
pub(crate) fn parts<T: Send>(count: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let most = if cfg!(feature = "threads") { THREADS } else { 1 };
    let threads = thread::available_parallelism().map_or(1, usize::from).min(most).min(count / LEAST);
    if threads < 2 {
        return vec![work(0..count)];
    }
    let size = count.div_ceil(threads);
    let part = |k: usize| (k * size).min(count)..((k + 1) * size).min(count);
    thread::scope(|scope| {
        let work = &work;
        let others: Vec<_> = (1..threads).map(|k| scope.spawn(move || work(part(k)))).collect();
        let mut made = vec![work(part(0))];
        made.extend(
            others.into_iter().map(|other| other.join().unwrap_or_else(|e| std::panic::resume_unwind(e))),
        );
        made
    })
}

/// `of` 0, 1, … `count` − 1.
pub(crate) fn map<T: Send>(count: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut all = Vec::with_capacity(count);
    parts(count, |part| part.map(&of).collect::<Vec<T>>()).into_iter().for_each(|part| all.extend(part));
    all
}

#[cfg(test)]
mod tests {
    #[test]
    fn parts_come_in_order() {
        for count in [0, 1, 511, 1024, 5000, 5001] {
            assert_eq!(super::map(count, |i| i), (0..count).collect::<Vec<_>>());
        }
    }
}
