//! Commands of the laboratory: what it computes is in `endowire-lab`.

mod bench;
mod compare;
mod devices;
mod evidence;
mod experiment;
mod parallel;
mod surfaces;
mod verify;

pub(super) use bench::bench;
pub(super) use compare::compare;
pub(super) use evidence::evidence;
pub(super) use experiment::experiment;
pub(super) use verify::verify;
