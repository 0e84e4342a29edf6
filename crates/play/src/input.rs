//! What comes from outside: keys, mouse, pedals, or a line of JSON.

use endowire_viewer::{Mode, Pose};
use serde::{Deserialize, Serialize};

/// One input; as JSON an object whose `do` names it: `{"do": "move", "instrument": "wire", "mm_per_s": 20}`.
///
/// An instrument that is not named is the one that was selected.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Input {
    /// Takes an instrument in the hand.
    Select {
        /// Its name.
        instrument: String,
    },
    /// Moves an instrument from now on at these speeds, until it is told otherwise.
    Move {
        /// Name of the instrument.
        instrument: Option<String>,
        /// Speed of pushing, mm/s; negative pulls.
        #[serde(default)]
        mm_per_s: f64,
        /// Speed of turning, degrees/s.
        #[serde(default)]
        deg_per_s: f64,
    },
    /// Moves an instrument by so much, as fast as a tick may go.
    Nudge {
        /// Name of the instrument.
        instrument: Option<String>,
        /// Length to push, mm; negative pulls.
        #[serde(default)]
        mm: f64,
        /// Angle to turn by, degrees.
        #[serde(default)]
        deg: f64,
    },
    /// Lets all instruments rest.
    Stop {},
    /// Presses or releases the pedal.
    Pedal {
        /// Whether it is down.
        down: bool,
        /// What is shown while it is; as before if absent.
        mode: Option<Mode>,
    },
    /// Injects contrast medium at the tip of the outermost instrument that is in; of several, of those with a lumen.
    Inject {
        /// Volume, ml.
        ml: f64,
        /// Rate, ml/s.
        ml_per_s: f64,
    },
    /// Leaves the coil of an instrument behind, where it comes to rest, and takes its pusher out.
    Detach {
        /// Name of the instrument.
        instrument: Option<String>,
    },
    /// Brings the C-arm to these angles.
    CArm {
        /// As they are said: "LAO 40 CRA 10".
        pose: Pose,
    },
    /// Turns the C-arm by so much.
    TurnCArm {
        /// Towards LAO, degrees.
        #[serde(default)]
        lao_deg: f64,
        /// Cranially, degrees.
        #[serde(default)]
        cra_deg: f64,
    },
    /// Moves what is seen over the patient.
    Table {
        /// Rightwards in the picture, mm at the isocentre.
        #[serde(default)]
        right_mm: f64,
        /// Downwards in the picture, mm at the isocentre.
        #[serde(default)]
        down_mm: f64,
        /// Whether that is the picture of the second plane.
        #[serde(default)]
        second: bool,
    },
    /// Magnifies by a factor.
    Zoom {
        /// Above 1 comes nearer.
        factor: f64,
    },
    /// Sets the blades: shares of the field's width and height that they leave open.
    Collimate {
        /// Of the width, 0.1 to 1.
        width: f64,
        /// Of the height, 0.1 to 1.
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
    /// Shows the scene's script from its start, or goes on where it rests. An instrument that is moved ends it; `stop` has it rest.
    Script {},
    /// Takes the last motion back: all steps since a hand began to move.
    Undo {},
    /// Does the next motion of those that were undone again, and what was injected in it. They are there until something else is done.
    Redo {},
    /// Goes back to the moment after a step.
    GoTo {
        /// Number of the step; 0 is the start.
        step: usize,
    },
}
