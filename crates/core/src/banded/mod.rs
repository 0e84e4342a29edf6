//! Matrices that couple only neighbouring nodes, and their factorisations.
//!
//! `matrix` holds symmetric block tridiagonal matrices; `ldlt` factors them without pivoting and reports their
//! inertia.

/// Repeats a block for every index below `$end` ≤ 12 at compile time: loops whose bounds depend on another index
/// would not be unrolled, and their rows not kept in registers.
macro_rules! unrolled {
    ($i:ident in 0..$end:expr, $body:block) => { unrolled!(@ $i, $end, $body, 0 1 2 3 4 5 6 7 8 9 10 11) };
    (@ $i:ident, $end:expr, $body:block, $($k:literal)*) => {
        $({
            let $i: usize = $k;
            if $i < $end $body
        })*
    };
}

pub(crate) mod ldlt;
pub(crate) mod matrix;

pub(crate) use ldlt::{Factor, FactorError, Inertia};
pub(crate) use matrix::{BandMatrix, Shift};

#[cfg(test)]
mod tests;
