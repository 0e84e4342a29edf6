//! Columns by the rotation of a hand: the tail passes it on, and the slip within which friction sticks is a part of what hands do.

use super::super::tails::Tails;
use super::super::workspace::Tools;
use super::columns::{Begin, Column, Local};
use super::{STEP, moved};
use crate::contact::stick_mm;
use crate::methods::Parameter;
use crate::rod::Layout;

impl Local<'_> {
    /// Columns by the rotation of a hand before the part and after it; none where other forces know it.
    pub(super) fn turned<const C: usize>(
        &self,
        tools: &mut Tools<C>,
        instrument: usize,
    ) -> Option<[Column; 2]> {
        let piece = self.around.piece;
        if Layout::<C>::ANGLES == 0
            || self.pushes_are_of_the_line()
            || piece.hands[instrument].inserted_mm == 0.0
        {
            return None;
        }
        let together = vec![(Parameter::Rotation { instrument }, 1.0)];
        let hands = [-STEP, STEP].map(|by| moved(&together, &piece.hands, by));
        let before = [-STEP, STEP].map(|by| {
            let mut state = (*piece.was.state).clone();
            state.hands = moved(&together, &state.hands, by);
            state
        });
        let environment = &self.around.environment;
        let stacks = [environment.surroundings.stack; 2];
        let begin_before =
            |tails: &mut Tails, side: usize| tails.begin(environment, (&before[side], &piece.hands));
        let begin_after =
            |tails: &mut Tails, side: usize| tails.begin(environment, (&piece.was.state, &hands[side]));
        let sides: [(&Begin<'_>, f64); 2] = [(&begin_before, -1.0), (&begin_after, 1.0)];
        Some(sides.map(|(begin, sign)| {
            let mut to = self.nothing::<C>();
            if sign < 0.0 && piece.was.mesh.elements.is_empty() {
                return to;
            }
            self.add_twists(tools, (stacks, begin), 2.0 * STEP, &mut to);
            let more_mm = sign * self.sticks_by(tools, instrument);
            for at in self.pressing {
                let Some(friction) = at.friction.filter(|_| more_mm != 0.0) else { continue };
                let (force, moment) = friction.by_stick;
                self.add_at::<C>(at.index, (force * more_mm, moment * more_mm), &mut to);
            }
            to
        }))
    }

    /// How the slip within which friction sticks, mm, changes with the rotation of a hand after the part, rad; not where the wall moves farther.
    fn sticks_by<const C: usize>(&self, tools: &Tools<C>, instrument: usize) -> f64 {
        let Some(point) = self.at.mesh.points.first() else { return 0.0 };
        let tuning = &self.around.environment.options.tuning.friction;
        let with = |by: f64| {
            let mut motions = tools.guess.motions.clone();
            motions[instrument].turn_rad += by;
            stick_mm(&motions, point.potential.radius_mm, tuning)[0]
        };
        if with(0.0) != tools.friction.stick_mm() {
            return 0.0;
        }
        (with(STEP) - with(-STEP)) / (2.0 * STEP)
    }
}
