//! Outputs of the viewer: images, animations, DICOM files, labels for machine learning.

mod animation;
mod dicom;
#[cfg(feature = "mp4")]
mod film;
mod image;
mod labels;
mod mask;
mod pace;
mod visible;

pub use animation::Animation;
pub use dicom::Angiogram;
pub use image::{Image, PixelFormat};
pub use labels::{ContactLabel, DeviceLabel, Labels, PartLabel};
pub use mask::Mask;
pub use pace::Pace;
