//! Inputs of a session, from keys, mouse, pedals or lines of JSON.

use endowire_viewer::{Mode, Pose};
use serde::{Deserialize, Serialize};

/// The names of all inputs, as `do` has them.
pub const INPUTS: [&str; 20] = [
    "select",
    "move",
    "nudge",
    "steer",
    "stop",
    "pedal",
    "inject",
    "detach",
    "c_arm",
    "turn_c_arm",
    "table",
    "zoom",
    "collimate",
    "turn_camera",
    "zoom_camera",
    "move_camera",
    "script",
    "undo",
    "redo",
    "go_to",
];

/// One input. As JSON, it is an object whose `do` names it: `{"do": "move", "instrument": "wire", "mm_per_s": 20}`.
///
/// Without a name, an input applies to the selected instrument.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Input {
    /// Selects an instrument.
    Select {
        /// Its name.
        instrument: String,
    },
    /// Moves an instrument at these speeds until the next such input.
    Move {
        /// Name of the instrument.
        instrument: Option<String>,
        /// Advance speed, mm/s; negative pulls back.
        #[serde(default)]
        mm_per_s: f64,
        /// Rotation speed, degrees/s.
        #[serde(default)]
        deg_per_s: f64,
    },
    /// Moves an instrument by an amount, as fast as a tick allows.
    Nudge {
        /// Name of the instrument.
        instrument: Option<String>,
        /// Advance, mm; negative pulls back.
        #[serde(default)]
        mm: f64,
        /// Rotation, degrees.
        #[serde(default)]
        deg: f64,
    },
    /// Steers an instrument whose tip bends by tendons: to a value at a rate, until it is there or until the next such
    /// input. Without a value it is held where it is.
    Steer {
        /// Name of the instrument.
        instrument: Option<String>,
        /// Value, −1 to 1; 0 is straight, or the shape of its own.
        to: Option<f64>,
        /// Rate, 1/s; 0.5 if absent.
        per_s: Option<f64>,
    },
    /// Stops all instruments.
    Stop {},
    /// Presses or releases the pedal.
    Pedal {
        /// Whether it is pressed.
        down: bool,
        /// Imaging mode while it is pressed; unchanged if absent.
        mode: Option<Mode>,
    },
    /// Injects contrast medium at the tip of the outermost inserted instrument with a lumen, otherwise at the mouth of
    /// the sheath.
    Inject {
        /// Volume, ml.
        ml: f64,
        /// Rate, ml/s.
        ml_per_s: f64,
    },
    /// Detaches the coil of an instrument where it comes to rest, and withdraws its pusher.
    Detach {
        /// Name of the instrument.
        instrument: Option<String>,
    },
    /// Turns the C-arm to these angles: at most 120° to the sides, 60° cranially and caudally.
    CArm {
        /// In clinical notation: "LAO 40 CRA 10".
        pose: Pose,
    },
    /// Turns the C-arm by these angles, as far as it goes.
    TurnCArm {
        /// Towards LAO, degrees.
        #[serde(default)]
        lao_deg: f64,
        /// Cranially, degrees.
        #[serde(default)]
        cra_deg: f64,
    },
    /// Moves the field of view over the patient.
    Table {
        /// To the right in the picture, mm at the isocentre.
        #[serde(default)]
        right_mm: f64,
        /// Downwards in the picture, mm at the isocentre.
        #[serde(default)]
        down_mm: f64,
        /// Whether the picture of the second plane is meant; refused without one.
        #[serde(default)]
        second: bool,
    },
    /// Magnifies by a factor.
    Zoom {
        /// Above 1 magnifies.
        factor: f64,
    },
    /// Sets the collimator: fractions of the field's width and height that stay open.
    Collimate {
        /// Fraction of the width, 0.1 to 1.
        width: f64,
        /// Fraction of the height, 0.1 to 1.
        height: f64,
    },
    /// Turns the camera of the 3D view.
    TurnCamera {
        /// Around the patient's long axis, degrees.
        #[serde(default)]
        azimuth_deg: f64,
        /// Upwards, degrees.
        #[serde(default)]
        elevation_deg: f64,
    },
    /// Magnifies the 3D view, from half to twenty times its size.
    ZoomCamera {
        /// Factor of the magnification, 0.1 to 10.
        factor: f64,
    },
    /// Moves the middle of the 3D view, as far as the whole is beside it.
    MoveCamera {
        /// To the right, in widths of the view.
        #[serde(default)]
        right: f64,
        /// Upwards, in widths of the view.
        #[serde(default)]
        up: f64,
    },
    /// Plays the scene's script from its start, or continues it. Moving an instrument ends it; `stop` pauses it.
    Script {},
    /// Undoes the last motion: all steps since an instrument began to move.
    Undo {},
    /// Redoes the next undone motion and its injections. Undone motions are kept until something else is done.
    Redo {},
    /// Goes to the state after a step.
    GoTo {
        /// Number of the step; 0 is the start.
        step: usize,
    },
}
