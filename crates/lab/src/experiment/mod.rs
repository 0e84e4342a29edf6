//! The experiments of Li et al. 2011 (`endowire experiment`): [run times](timing), [navigation], [loops](looping) and
//! [deformation]. Coils in an aneurysm are a [bench test](crate::bench::coil).

pub mod catalogue;
pub mod deformation;
pub mod looping;
pub mod navigation;
mod straight;
pub mod timing;
