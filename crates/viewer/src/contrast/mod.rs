//! Contrast medium: where the blood carries it, and what of it a ray meets.

mod flow;
mod map;
mod mixing;
mod tip_way;
mod tissue;
mod transport;
mod volumes;

pub(crate) use flow::Flow;
pub(crate) use map::{ContrastMap, Medium, Shares};
