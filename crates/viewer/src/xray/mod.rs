//! X-ray physics: what attenuates how much, and how path lengths become a picture.

mod beam;
mod material;
mod path;

pub(crate) use beam::{Beam, SUBRAYS};
pub use material::Material;
pub use path::PathLengths;
