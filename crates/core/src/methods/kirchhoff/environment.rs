//! What a step takes as given.

use super::mesh::Mesh;
use super::options::KirchhoffOptions;
use crate::contact::{ContactSurface, MovedWall};
use crate::device::Stack;
use crate::field::FieldLoad;
use crate::methods::Surroundings;
use crate::rod::RodState;
use crate::vessel::Displacement;

/// Inputs of a step that it does not change.
#[derive(Clone, Copy)]
pub(super) struct Environment<'a> {
    pub(super) surroundings: Surroundings<'a>,
    pub(super) surface: &'a ContactSurface,
    pub(super) options: &'a KirchhoffOptions,
    /// Displacement of the vessel; `None` if it never moves.
    pub(super) displacement: Option<&'a Displacement>,
    /// How far the step has gone into the fields after it, 0 to 1.
    pub(super) fields_part: f64,
}

impl<'a> Environment<'a> {
    /// For a vessel that does not move.
    pub(super) fn new(
        surroundings: &Surroundings<'a>,
        surface: &'a ContactSurface,
        options: &'a KirchhoffOptions,
    ) -> Self {
        Self { surroundings: *surroundings, surface, options, displacement: None, fields_part: 1.0 }
    }

    /// The same environment with the vessel displaced.
    pub(super) fn displaced<'b>(&self, displacement: Option<&'b Displacement>) -> Environment<'b>
    where
        'a: 'b,
    {
        Environment { displacement, ..*self }
    }

    /// The same with the instruments as they are steered.
    pub(super) fn steered<'b>(&self, stack: &'b Stack) -> Environment<'b>
    where
        'a: 'b,
    {
        let surroundings = Surroundings { device: stack.first(), stack, ..self.surroundings };
        Environment { surroundings, ..*self }
    }

    /// The same after this part of the way into the fields after the step.
    pub(super) fn with_fields_at(self, fields_part: f64) -> Self {
        Self { fields_part, ..self }
    }

    /// What fields do to a line; none where there are none.
    pub(super) fn field_load(&self, mesh: &Mesh) -> Option<FieldLoad<'a>> {
        let mut fields = self.surroundings.fields_at(self.fields_part).peekable();
        fields.peek()?;
        Some(FieldLoad::new(fields, &mesh.from_tip_mm, &mesh.inserted_mm))
    }

    /// Energy of a line in the fields, mJ.
    pub(super) fn field_mj(&self, mesh: &Mesh, rod: &RodState) -> f64 {
        self.field_load(mesh).map_or(0.0, |load| load.energy_mj(&mesh.elements, rod))
    }

    /// Whether anything rubs: on the wall, or loops on each other.
    pub(super) fn has_friction(&self) -> bool {
        self.surroundings.properties.has_friction() || self.options.self_friction > 0.0
    }

    /// The wall at its displacement.
    pub(super) fn wall(&self) -> MovedWall<'a> {
        MovedWall::new(self.surface, self.displacement)
    }
}
