//! Renders a scene into frames: a 3D view and a simulated fluoroscopic view, without a window.
//!
//! A [`ViewSpec`] specifies the frames, a [`Renderer`] prepares them for a vessel wall and draws devices in it.
//! Frames come from a graphics processor through wgpu if there is one, and otherwise from plain Rust, which is also
//! the exact reference for path lengths. Without the feature `gpu` (on by default) only plain Rust is used. Units:
//! millimetre, degree and keV as named.
//!
//! ```
//! use endowire_core::{Vec3, vessel::SurfaceMesh};
//! use endowire_viewer::{Backend, DevicePoint, DeviceView, Renderer, View, ViewSpec};
//!
//! // A vessel: here a tetrahedron, counter-clockwise seen from outside.
//! let wall = SurfaceMesh {
//!     vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
//!     triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
//! };
//! let point = |x: f64| DevicePoint { position_mm: Vec3::new(x, 5.0, 5.0), tangent: Vec3::x(), radius_mm: 0.4 };
//! let wire = DeviceView { points: vec![point(1.0), point(20.0)], ..DeviceView::default() };
//!
//! let spec =
//!     ViewSpec { views: vec![View::Fluoro], size_px: [64, 64], backend: Backend::Cpu, ..ViewSpec::default() };
//! let mut renderer = Renderer::new(&spec, &wall)?;
//! let frames = renderer.render(&[wire])?;
//! assert_eq!(frames.fluoro.map(|image| image.width()), Some(64));
//! assert!(frames.three_d.is_none());
//! # Ok::<(), endowire_core::Error>(())
//! ```

mod c_arm;
mod contrast;
mod cpu;
mod device;
mod device_file;
mod engine;
mod fingerprint;
mod fluoro;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(not(feature = "gpu"))]
#[path = "no_gpu.rs"]
mod gpu;
mod material;
mod moment;
mod output;
mod patient;
mod pulse;
mod pushed;
mod renderer;
mod scene;
mod shaft;
mod spec;
mod tails;
mod three_d;
mod xray;

pub use c_arm::CArm;
pub use device::{DevicePart, DevicePoint, DeviceView};
pub use device_file::{device_parts, section_parts};
pub use fluoro::{Brightness, FrameTime};
#[cfg(feature = "gpu")]
pub use gpu::{Drawing, Graphics};
pub use material::Material;
pub use moment::Moment;
pub use output::{
    Angiogram, Animation, ContactLabel, DeviceLabel, Image, Labels, Mask, Pace, PartLabel, PixelFormat,
};
pub use patient::read_label_map;
pub use pulse::Seen;
pub use pushed::{Pushed, ShownDevice};
pub use renderer::{Frames, Renderer};
pub use shaft::SheathMouth;
pub use spec::{
    Backend, CArmSpec, CameraSpec, CtSpec, DetectorSpec, ExposureSpec, FlowSpec, InjectionSpec, Mode,
    PatientSpec, Pose, Shutter, TorsoSpec, View, ViewSpec, XRaySpec,
};
pub use three_d::{ContactView, largest_force_n};
pub use xray::{Exposure, PathLengths, Pulse};
