//! Commands of the laboratory: what it computes is in `endowire-lab`.

mod bench;
mod compare;
mod devices;
mod evidence;
mod experiment;
mod parallel;
mod surfaces;
mod verify;

use endowire_core::error::number;

use crate::failure::Failure;

pub(super) use bench::bench;
pub(super) use compare::compare;
pub(super) use evidence::evidence;
pub(super) use experiment::experiment;
pub(super) use verify::verify;

/// Longest time limit, s: some days, which a clock can still count.
const LONGEST_LIMIT_S: f64 = 1e6;

/// Refuses a time limit of nothing, or without end.
fn check_limit_s(limit_s: f64) -> Result<(), Failure> {
    if limit_s > 0.0 && limit_s <= LONGEST_LIMIT_S {
        return Ok(());
    }
    let remedy = format!("give a time above 0, and at most {LONGEST_LIMIT_S} s");
    Err(Failure::Input(format!("--limit-s {}: {remedy}", number(limit_s))))
}
