//! CPU time, which other programs on the machine do not change as they change the clock on the wall.

use std::time::Instant;

use endowire_core::Result;

/// CPU time of this process in ms, of all its threads; the clock on the wall where the system does not tell.
pub(crate) fn cpu_ms(start: Instant) -> f64 {
    let nanoseconds = |path: std::path::PathBuf| {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    // The file of the process tells of its first thread alone.
    let threads = std::fs::read_dir("/proc/self/task").ok();
    let reported =
        threads.map(|all| all.flatten().filter_map(|thread| nanoseconds(thread.path())).sum::<f64>());
    reported.filter(|ns| *ns > 0.0).map_or(start.elapsed().as_secs_f64() * 1e3, |ns| ns / 1e6)
}

/// Mean CPU time of a job over this many runs after a first one, ms: the system counts in steps of milliseconds, so many
/// runs are counted together.
pub(crate) fn mean_ms(runs: u32, mut job: impl FnMut(u32) -> Result<()>) -> Result<f64> {
    job(0)?;
    let start = Instant::now();
    let before = cpu_ms(start);
    (1..=runs).try_for_each(&mut job)?;
    Ok((cpu_ms(start) - before) / f64::from(runs))
}
