//! X-ray physics: attenuation, absorption in the detector, and noise.

mod beam;
mod blur;
mod detector;
mod exp;
mod exposure;
mod noise;
mod path;
mod quadrature;
mod spectrum;

pub(crate) use beam::{Beam, Lanes};
pub(crate) use blur::Blur;
pub(crate) use detector::Detector;
pub(crate) use exp::{LANES, exp_lanes, ln_lanes};
pub(crate) use exposure::check as check_exposure;
pub use exposure::{Exposure, Pulse};
pub use path::PathLengths;
pub(crate) use spectrum::check_kvp;
