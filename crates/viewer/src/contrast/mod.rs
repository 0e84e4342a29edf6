//! Contrast medium: its transport by blood, and its attenuation of rays.

mod flow;
mod map;
mod mixing;
mod tip_way;
mod tissue;
mod transport;
mod volumes;

pub(crate) use flow::{Flow, read_tree};
pub(crate) use map::{ContrastMap, Medium, Shares};
