//! Columns by the motions of the hands: by differences of forces, the hands being a little elsewhere before the part and after it.

use super::super::configuration::Configuration;
use super::super::hands::Hand;
use super::super::meshed;
use super::super::workspace::Tools;
use super::columns::{Column, column};
use super::linear::Linear;
use super::numbers::{Around, Found};
use super::{STEP, STICKING, Scene, own_scale};
use crate::Result;
use crate::methods::Parameter;

impl<const C: usize> Linear<C> {
    /// Columns by one motion of a hand; none where it has none.
    ///
    /// # Errors
    /// Another mesh on both sides.
    pub(super) fn hand(
        &self,
        tools: &mut Tools<C>,
        around: &Around<'_>,
        (nominal, here): (&Scene, &Found),
        (instrument, motion, stick_mm): (usize, usize, f64),
        next: &mut Configuration,
    ) -> Result<Option<[Column; 2]>> {
        let (piece, environment) = (around.piece, &around.environment);
        let parameter = [
            Parameter::Advance { instrument },
            Parameter::Rotation { instrument },
            Parameter::Steering { instrument },
        ][motion];
        let device = &environment.surroundings.stack.instruments()[instrument].device;
        if piece.hands[instrument].inserted_mm == 0.0 || (motion == 2 && !device.is_steerable()) {
            return Ok(None);
        }
        let scale = own_scale(environment, &parameter)?;
        let radius_mm = if motion == 1 { device.section_at(f64::INFINITY).radius_mm } else { 1.0 };
        let by = (STEP * scale).min(STICKING * stick_mm / radius_mm);
        let start = piece.was.start();
        let moved = |hands: &[Hand], by: f64| super::moved(&vec![(parameter, 1.0)], hands, by);
        let before = [-by, by].map(|by| {
            let mut there = piece.was.clone();
            let (mesh, state) = there.parts();
            state.hands = moved(&state.hands, by);
            if motion == 0 {
                meshed(environment, &state.hands, mesh);
            }
            if mesh.elements.len() != start.mesh.elements.len() || mesh.elements.is_empty() {
                return (by, None);
            }
            state.rod.place(&mesh.elements);
            (by, around.found::<C>(tools, nominal, (there.start(), &piece.hands), next))
        });
        let after = [-by, by].map(|by| {
            let hands = moved(&piece.hands, by);
            (by, around.found::<C>(tools, nominal, (start, &hands), next))
        });
        let refused = || parameter.refused("the mesh changes on both sides: give a slightly other command");
        let before = match start.mesh.elements.is_empty() {
            true => Column::default(),
            false => column(&before, here).ok_or_else(refused)?,
        };
        Ok(Some([before, column(&after, here).ok_or_else(refused)?]))
    }
}
