//! Numbers of Newton's method.

/// How Newton's method takes steps, and when it stops (`solve`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonTuning {
    /// Largest rotation of a node in one step, rad. Slightly less than a right angle is best: a dead load across a
    /// rod turns it by no more.
    pub largest_turn_rad: f64,

    /// Largest number of trials of a line search.
    pub trials: usize,
    /// A full step under a shift is also tried at this many times its length. At 1 it is not.
    pub lengthening: f64,
    /// The longer step is taken if the merit falls by this many times as much.
    pub least_gain: f64,
    /// Armijo's constant: the fraction of the decrease predicted by the slope that a trial must reach. Far below 0 any
    /// trial is accepted.
    pub armijo: f64,
    /// A trial that is rejected is followed by one at least this fraction as long …
    pub least_cut: f64,
    /// … and at most this.
    pub largest_cut: f64,
    /// Changes of axial force count as rotation: this times their ratio to EI/L², in radians.
    pub stiffening: f64,
    /// If loads have no potential, a trial is accepted that leaves less than this fraction of the residual.
    pub residual_falls: f64,
    /// Number of trials after which the residual may grow if loads have no potential …
    pub patience: usize,
    /// … by up to this factor.
    pub residual_grows: f64,
    /// Number of times a trial is shortened because it would cross a surface. At 0 trials may cross.
    pub safe_cuts: usize,

    /// After a full Newton step with a largest rotation below this, rad, only the residual is assembled, as the
    /// equilibrium is near. Below 0 in no case.
    pub short_rad: f64,
    /// The same holds below this rotation, rad, if by quadratic convergence the state is within the tolerance: if
    /// `quadratic` times the square of the rotation is at most the tolerance.
    pub near_rad: f64,
    /// Assumed constant of quadratic convergence, 1/rad.
    pub quadratic: f64,
    /// Another step with the same factors is assumed to leave a residual smaller by this times the last rotation,
    /// 1/rad.
    pub chord: f64,
    /// Number of consecutive states at rounding without halving the residual after which it counts as minimal, even
    /// though steps still turn nodes by more than the tolerance.
    pub hidden: usize,

    /// Regularisation that is always added: a uniform tension, as a fraction of EI/L² of the whole rod.
    pub regularisation: f64,
    /// Smallest shift, as a multiple of the regularisation.
    pub least_shift: f64,
    /// Factor by which an insufficient shift grows.
    pub shift_growth: f64,
    /// The search for a shift starts at this fraction of the last one, to which that also decays in an iteration
    /// without shift.
    pub shift_decay: f64,
    /// Number of shifts tried before a matrix is reported as singular. At 0 none is.
    pub shifts: usize,

    /// Largest number of rounds, one factorisation each, in which the active set at the end of a step is sought. At 0
    /// a step has the contacts at its beginning.
    pub contact_rounds: usize,
    /// Largest rotation of a step, rad, in a round: the linearised planes are no model farther away.
    pub contact_turn_rad: f64,
    /// The search along a round ends when the slope has fallen to this part of the initial slope.
    pub searched: f64,
    /// Largest number of trials of such a search.
    pub searches: usize,

    /// Number of corrections of the end conditions of a trial.
    pub corrections: usize,
    /// Largest rotation of a node in a correction, rad; larger corrections are rejected.
    pub correction_rad: f64,

    /// Largest distance of a node from its prediction, as a multiple of its room.
    pub rooms: f64,
    /// Largest difference of a node's material angle from its prediction, rad.
    pub room_rad: f64,
    /// Fraction of these distances that is allowed where the stiffness was indefinite at an iterate.
    pub indefinite_rooms: f64,
    /// An iterate this many times farther than allowed does not return. Below that it may: the first steps from a
    /// prediction can be long where contacts open.
    pub stray: f64,

    /// Number of inverse iterations for the direction in which a saddle is left.
    pub saddle_iterations: usize,
    /// Largest rotation of a node when a saddle is left, rad.
    pub saddle_rad: f64,
    /// Number of times that motion is halved in search of a lower energy. At 0 saddles are not left.
    pub saddle_halvings: usize,
}

impl NewtonTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        largest_turn_rad: 1.4,
        trials: 24,
        lengthening: 2.0,
        least_gain: 1.5,
        armijo: 1e-4,
        least_cut: 0.1,
        largest_cut: 0.6,
        stiffening: 1e-2,
        residual_falls: 0.9,
        patience: 6,
        residual_grows: 2.0,
        safe_cuts: 4,
        short_rad: 1e-5,
        near_rad: 1e-3,
        quadratic: 10.0,
        chord: 10.0,
        hidden: 3,
        regularisation: 1e-8,
        least_shift: 1e5,
        shift_growth: 4.0,
        shift_decay: 1.0 / 8.0,
        shifts: 60,
        contact_rounds: 100,
        contact_turn_rad: 1.0,
        searched: 1e-3,
        searches: 60,
        corrections: 4,
        correction_rad: 0.3,
        rooms: 2.0,
        room_rad: 1.0,
        indefinite_rooms: 0.5,
        stray: 3.0,
        saddle_iterations: 6,
        saddle_rad: 0.5,
        saddle_halvings: 20,
    };
}

impl Default for NewtonTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
