//! Contrast medium: where the blood carries it, and what of it a ray meets.

mod flow;
mod map;
mod nearest;
mod tip_way;
mod transport;

pub(crate) use flow::Flow;
pub(crate) use map::{ContrastMap, Medium, Shares};
