//! Evidence: what the model was compared with outside of itself, what came out, and what that does not show.

pub mod bending;
pub mod capstan;
pub mod coil_forces;
mod driven_tubes;
pub mod reversal;
pub mod straightening;
pub mod three_tubes;
pub mod tube_buckling;
pub mod whip;

use crate::Row;

/// A study, in words.
#[derive(Debug, Clone, Copy)]
pub struct Study {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its title.
    pub title: &'static str,
    /// The question that it answers.
    pub question: &'static str,
    /// The data, their source, and where to get them.
    pub data: &'static str,
    /// What is computed.
    pub computed: &'static str,
    /// What it does not show.
    pub not_shown: &'static str,
}

/// All studies, those with measurements first.
pub const STUDIES: [Study; 8] = [
    three_tubes::STUDY,
    straightening::STUDY,
    coil_forces::STUDY,
    reversal::STUDY,
    whip::STUDY,
    capstan::STUDY,
    tube_buckling::STUDY,
    bending::STUDY,
];

/// What a curve is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A result of this program.
    Computed,
    /// A law that it is compared with.
    Law,
    /// Single values that it is compared with.
    Values,
}

/// A curve of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What it is.
    pub name: String,
    /// Whether it is a result or a reference.
    pub kind: Kind,
    /// Its points.
    pub points: Vec<[f64; 2]>,
}

/// The results of a study without data of a user: compared numbers and a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The numbers.
    pub rows: Vec<Row>,
    /// The curves of the figure.
    pub lines: Vec<Line>,
    /// Names of the figure's axes, with units.
    pub axes: [&'static str; 2],
    /// Whether the vertical axis is logarithmic.
    pub is_logarithmic: bool,
}
