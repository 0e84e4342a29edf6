//! Numbers of the course of a vessel that yields.

/// How course and device follow each other (`methods/kirchhoff/yielding`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CourseTuning {
    /// Most times that the course follows in a part.
    pub most_rounds: usize,
    /// Largest displacement of the course at once, in radii of the device.
    pub most_radii: f64,
    /// Largest turn of the device at once, rad.
    pub most_turn_rad: f64,
    /// A step goes back where the energy rises at its end by more than this of the slope by which it fell at its beginning, as
    /// where contacts change status.
    pub rises: f64,
    /// A step at whose end the device is not found is halved down to this part of it.
    pub least_part: f64,
    /// Friction that sticks within a wider ε narrows by this factor, …
    pub narrows: f64,
    /// … from a solution that is this near, relative to the largest force.
    pub near_enough: f64,
}

impl CourseTuning {
    /// The numbers the method is tested with.
    pub(crate) const DEFAULT: Self = Self {
        most_rounds: 80,
        most_radii: 2.0,
        most_turn_rad: 0.3,
        rises: 0.5,
        least_part: 0.25,
        narrows: 0.5,
        near_enough: 0.1,
    };
}

impl Default for CourseTuning {
    fn default() -> Self {
        Self::DEFAULT
    }
}
