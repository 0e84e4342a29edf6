//! Numbers of parts of commands and ticks.

/// How a command is cut into parts, and how long an equilibrium is sought for one (`methods/kirchhoff`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTuning {
    /// Largest motion of the hands in a part with relaxation from a fold, mm: the accuracy of the fold's position.
    pub fold_mm: f64,
    /// Largest motion of the hands in a part that may end in a snap, in radii of the thinnest device: the place of the
    /// snap on the way of the hands is known as well as that. Their solutions are not bounded: shorter parts mostly
    /// find the same equilibrium again.
    /// At 0 no part may.
    pub snap_radii: f64,
    /// Largest part in which friction is held for the first time, mm: longer parts mostly fail for being too long.
    /// At 0 friction is held in no part.
    pub held_mm: f64,
    /// Smallest motion of the hands in a part with relaxation, mm.
    pub least_mm: f64,
    /// Distance from the prediction, as a fraction of the allowed one, below which the next part is doubled. Errors of
    /// first-order predictions then double, those of second order quadruple.
    pub nearer: f64,
    /// Largest number of sub-steps of one command.
    pub substep_limit: usize,
    /// Linear solves of a command, whatever its motion; see `most_solves`, of which this is the
    /// first term. If it is `usize::MAX`, a command is not bounded.
    pub solves: usize,
    /// Further ones per millimetre and per `work_rad` of its motion.
    pub solves_per_mm: f64,
    /// Motion beyond which a command gets no further solves, mm.
    pub solves_up_to_mm: f64,
    /// Newton iterations allowed for a command per millimetre and per `work_rad`, including failed attempts, before it
    /// is relaxed. Relaxations go on after them, until the linear solves are used up.
    pub work: f64,
    /// As many times more where the vessel's course yields: the device is sought again wherever that follows.
    pub work_of_course: f64,
    /// Rotation that counts like a millimetre, rad.
    pub work_rad: f64,
    /// Change of the steering value that counts like a millimetre.
    pub work_steer: f64,
    /// Upper limit of these iterations, as a multiple of those of one solution.
    pub work_of_one: usize,
    /// Number of further relaxations, with the hands held still, of a device that rests at the end of its command but
    /// not in equilibrium.
    pub again: usize,
    /// Motion in a further relaxation, in the smallest radius of the device, below which it is still.
    pub rest_radii: f64,
    /// Residual, relative to the force scale, above which a device that does not move is in no equilibrium.
    pub at_rest: f64,
    /// Cost of a part beside its own linear solves, in linear solves: it builds a mesh and evaluates the whole wall
    /// once.
    pub of_a_part: usize,
    /// Largest number of Newton iterations of a solution near its prediction: shortening the part takes fewer.
    pub most_near: usize,
    /// Largest number of Newton iterations of a solution in a relaxation.
    pub most_moving: usize,
    /// Largest number of Newton iterations of all solutions in a relaxation.
    pub longest: usize,
    /// Largest number of Newton iterations from an equilibrium with held friction to one with friction that follows.
    /// At 0 the device slides at once.
    pub following: usize,
    /// Largest number of slides with the hand held still; two or three are typical.
    pub slides: u32,
    /// Largest number of renewals of the lagged forces at an equilibrium: each needs few iterations.
    pub lagged_renewals: usize,
    /// Whether the prediction repeats what the last step changed; otherwise it is the device slid along its own curve.
    pub repeats: bool,
    /// Whether a solution is tested for having passed through the wall.
    pub tests_passing: bool,
    /// Released or missing energy is significant above this fraction of the energy that is stored in the device and
    /// the wall, exchanged with fields, or released from the sheath. If infinite, energies are not compared.
    pub notable: f64,
    /// Energy below which none is significant, mJ.
    pub notable_floor_mj: f64,
    /// Resistance to motion of a detached coil, over its bending stiffness and length, 1/mm⁴: that to a motion of
    /// 1 mm of a coil of 60 mm is a thousandth of the force that bends it to a radius of 1 mm.
    pub coil_resistance_per_mm4: f64,
}

impl StepTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        fold_mm: 0.05,
        snap_radii: 2.0,
        held_mm: 0.5,
        least_mm: 1e-3,
        nearer: 0.2,
        substep_limit: 4096,
        solves: 15_000,
        solves_per_mm: 100.0,
        solves_up_to_mm: 40.0,
        work: 280.0,
        work_of_course: 4.0,
        work_rad: 0.1,
        work_steer: 0.05,
        work_of_one: 10,
        again: 4,
        rest_radii: 1e-3,
        at_rest: 0.05,
        of_a_part: 2,
        most_near: 60,
        most_moving: 300,
        longest: 2000,
        following: 20,
        slides: 400,
        lagged_renewals: 20,
        repeats: true,
        tests_passing: true,
        notable: 0.02,
        notable_floor_mj: 1e-6,
        coil_resistance_per_mm4: 1e-5,
    };

    /// The linear solves after which a command ends, for its largest motion of a hand, mm (a rotation of `work_rad`
    /// counts as a millimetre), with what earlier commands have left over:
    ///
    /// ```text
    /// solves + solves_per_mm · min(motion, solves_up_to_mm)
    /// ```
    ///
    /// All parts count, whether they are accepted or thrown away, with those in which the device moves to where it
    /// rests, and `of_a_part` for each. The Newton iteration in progress is finished.
    pub(crate) fn most_solves(&self, motion_mm: f64) -> usize {
        self.solves.saturating_add((self.solves_per_mm * motion_mm.min(self.solves_up_to_mm)) as usize)
    }
}

impl Default for StepTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
