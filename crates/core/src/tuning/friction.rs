//! Numbers of friction.

/// How Coulomb's law is regularised, and when its normal forces are renewed (`crate::contact::friction`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionTuning {
    /// Slip below which a point sticks, as a fraction of the hand's motion, or of the device's radius if the hand rests:
    /// the error of the regularisation.
    pub stick: f64,
    /// Factor by which it shrinks in every relaxation while the hand holds still. Friction between instruments sticks
    /// within at least this fraction of what it would if they slipped as far as hands move.
    pub stick_at_rest: f64,
    /// Smallest slip after shrinking, as a fraction of that of the step: a smaller one would make friction stiffer than
    /// any wall.
    pub least_at_rest: f64,

    /// Friction at a point causes another round in a Newton step where its force is wrong by more than this fraction of
    /// its bound. If infinite, it causes none.
    pub changed: f64,
    /// A round updates friction where it is wrong by more than this fraction: without the update, the error would make
    /// steps uphill. If infinite, no round does.
    pub renewed: f64,
    /// Normal forces are settled once their relative change, and their relative difference from the contact forces, is
    /// below this.
    pub settled: f64,

    /// Points nearer to the tip than this many radii (plus the advance) begin with their own normal force; the others
    /// with the one felt before at their new position, since the wall does not move.
    pub tip_radii: f64,
    /// Largest number of iterations for the axial force of an instrument in others behind a node and the friction
    /// there: each reduces the error by the coefficient times half the angle of an element.
    pub lateral_rounds: usize,
    /// Distance behind the sheath's mouth, or behind a hub, at which friction holds an instrument, in its radii: the
    /// mouth turns by the twist of that length while it sticks.
    pub grip_radii: f64,
}

impl FrictionTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        stick: 1e-3,
        stick_at_rest: 0.3,
        least_at_rest: 0.01,
        changed: 0.05,
        renewed: 5e-3,
        settled: 1e-4,
        tip_radii: 10.0,
        lateral_rounds: 12,
        grip_radii: 1.0,
    };
}

impl Default for FrictionTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
