//! Recordings of simulations that a program moves, and what the repository says of their format.

mod format;
mod program;
