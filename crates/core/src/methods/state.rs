//! The complete state of an insertion, for any method.

use std::sync::Arc;

use nalgebra::Rotation3;
use serde::{Deserialize, Serialize};

use super::finite;
use super::kirchhoff::KirchhoffState;
use crate::device::Device;
use crate::methods::StepReport;
use crate::shape::Shape;
use crate::{Error, Result, Vec3};

/// The state of an insertion: together with vessel, device, sheath and options it determines the next step.
///
/// Two simulations of one scene in the same state respond to the same commands with the same bits. It can be cloned,
/// sent, and written in any format of `serde` that keeps every bit of a number. Clones share their data, which is
/// immutable.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State {
    /// Name of the method.
    method: String,
    /// The number of the scene that it belongs to; 0 for none.
    scene: u64,
    /// Time since the start, s.
    time_s: f64,
    content: Content,
}

/// State of a method between steps.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Content {
    /// The exact rod.
    Kirchhoff {
        /// All that the next step depends on.
        #[serde(with = "shared")]
        state: Arc<KirchhoffState>,
        /// The report of the step that led to it.
        #[serde(with = "shared")]
        report: Arc<StepReport>,
    },
    /// A method with nodes, tangents and the planes that hold them.
    Chain(Box<ChainState>),
    /// A method with nodes and triads alone.
    Nodes(Box<NodesState>),
}

/// Serialises shared data in place.
pub(super) mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(in crate::methods) fn serialize<T: Serialize, S: Serializer>(
        value: &Arc<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        (**value).serialize(serializer)
    }

    pub(in crate::methods) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}

/// Nodes and tangents, and the planes of the wall in contact.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ChainState {
    /// The centre line.
    pub shape: Shape,
    /// The report of the last step.
    pub report: StepReport,
    /// The plane that each node touches, **tip first**: so nodes keep their index.
    pub touched: Vec<Option<TouchedPlane>>,
}

/// The plane of a wall triangle, offset by the device's radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TouchedPlane {
    /// Unit normal n of the triangle, into the lumen.
    pub normal: Vec3,
    /// Offset d in mm: the device's axis touches where n·x = d.
    pub offset_mm: f64,
    /// The wall triangle.
    pub triangle: u32,
    /// Penetration of the device's surface, mm.
    pub depth_mm: f64,
    /// Force of the wall in the last step, N; negative where it pulled, 0 without contact.
    pub force_n: f64,
}

/// Nodes and triads of a chain.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct NodesState {
    /// Node positions, sheath first, mm.
    pub positions_mm: Vec<Vec3>,
    /// Triads of the nodes: tangent and two material directions as columns.
    pub frames: Vec<Rotation3<f64>>,
    /// Arc lengths of the nodes from the tip, mm.
    pub from_tip_mm: Vec<f64>,
    /// Rotation of the clamp, rad.
    pub turn_rad: f64,
    /// The report of the last step.
    pub report: StepReport,
}

impl State {
    /// The state of the method `method`.
    pub fn new(method: &str, content: Content) -> Self {
        Self { method: method.to_owned(), scene: 0, time_s: 0.0, content }
    }

    /// The same state of a scene at a time since the start, s.
    pub(crate) fn of_scene(self, scene: u64, time_s: f64) -> Self {
        Self { scene, time_s, ..self }
    }

    /// Refuses numbers that no insertion has: a state may come from a file, or from anybody.
    ///
    /// # Errors
    /// The key of the first number that is not finite.
    pub(crate) fn check_finite(&self) -> Result<()> {
        finite::check(self).map_err(|found| {
            let remedy = "must be a finite number: restore a state that was written by an insertion";
            Error::parameter(format!("state.{}", found.path()), "not finite", remedy)
        })
    }

    /// The number of the scene that it belongs to; 0 for none.
    pub(crate) fn scene(&self) -> u64 {
        self.scene
    }

    /// Time since the start, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Name of the method.
    pub fn method(&self) -> &str {
        &self.method
    }

    /// The report of the step that led to this state.
    pub fn report(&self) -> &StepReport {
        match &self.content {
            Content::Kirchhoff { report, .. } => report,
            Content::Chain(state) => &state.report,
            Content::Nodes(state) => &state.report,
        }
    }

    /// The content, if it is of the method `method`.
    ///
    /// # Errors
    /// A state of another method.
    pub fn of(&self, method: &str) -> Result<&Content> {
        if self.method == method { Ok(&self.content) } else { Err(self.of_another(method)) }
    }

    /// The error for a state that is not of `method`.
    pub fn of_another(&self, method: &str) -> Error {
        let remedy =
            format!("this simulation is one of {method}: restore a state of the same scene and method");
        Error::parameter("state.method", &self.method, remedy)
    }
}

/// Checks the inserted length of a state to be restored.
///
/// # Errors
/// A length greater than the device's.
pub fn check_inserted(inserted_mm: f64, device: &Device) -> Result<()> {
    if (0.0..=device.length_mm()).contains(&inserted_mm) {
        return Ok(());
    }
    let remedy = format!("the device is {} mm long here: restore a state of this scene", device.length_mm());
    Err(Error::parameter("state.inserted_mm", inserted_mm, remedy))
}
