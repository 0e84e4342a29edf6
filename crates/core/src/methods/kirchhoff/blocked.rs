//! Where a vessel is narrower than the device that is pushed into it.
//!
//! A wall that yields lets a device through a vessel somewhat narrower than itself, and then there is nothing to tell. Where no
//! equilibrium is found on the way, the room across the lumen says whether that is why.

use super::Environment;
use super::configuration::Start;
use super::workspace::Tools;
use crate::contact::{ContactSurface, WallContact};
use crate::methods::Command;
use crate::{Error, PhysicalEnd, Result, Vec3};

/// Less room than this part of what the device needs is so little that a way through is not looked for with patience.
pub(super) const FAR_TOO_LITTLE: f64 = 0.5;
/// How far off the wall, in radii, ways across begin at most.
const OFF: f64 = 0.3;
/// Tangents of the angles between the normal and other ways across.
const TILTS: [f64; 2] = [0.4, 1.0];
/// Pieces of the near wall that the way across may meet before it has left them behind.
const PIECES: usize = 4;
/// From one of them the way goes on so much farther, mm.
const ON_MM: f64 = 1e-3;

impl<const C: usize> Tools<C> {
    /// Refuses to push on from where there is less room than `part` of what the device needs, for commands of the hands that have found no
    /// equilibrium.
    ///
    /// # Errors
    /// [`PhysicalEnd::Blocked`] with the narrowest place, if there is one and an instrument advances.
    pub(super) fn refuse_narrower(
        &mut self,
        environment: &Environment<'_>,
        from: Start<'_>,
        commands: &[Command],
        part: f64,
    ) -> Result<()> {
        if commands.iter().any(|command| command.advance_mm > 0.0)
            && let Some((narrowest, end)) = self.narrowest(environment, from)
            && narrowest < part
        {
            return Err(Error::End(end));
        }
        Ok(())
    }

    /// The narrowest place at which the device presses on the wall and has less room across the lumen than its diameter, and the part of
    /// that which it has.
    pub(super) fn narrowest(
        &mut self,
        environment: &Environment<'_>,
        Start { mesh, state }: Start<'_>,
    ) -> Option<(f64, PhysicalEnd)> {
        let wall = environment.wall();
        let mut contact = WallContact::new(
            wall,
            &mesh.points,
            &mut self.cache,
            &mut self.friction,
            environment.surroundings.stack.softest_nmm2(),
        );
        let mut least: Option<(f64, PhysicalEnd)> = None;
        contact.touches(&mesh.elements, &state.rod, &mut self.touches);
        for (index, touch) in &self.touches {
            let device_radius_mm = mesh.points[*index].potential.radius_mm;
            let place = wall.material(&touch.contact.position_mm);
            let Some(lumen_radius_mm) = room_mm(&wall, &place, device_radius_mm) else {
                continue;
            };
            let part = lumen_radius_mm / device_radius_mm;
            if least.is_none_or(|(narrowest, _)| part < narrowest) {
                let position_mm = touch.contact.position_mm;
                least = Some((part, PhysicalEnd::Blocked { position_mm, lumen_radius_mm, device_radius_mm }));
            }
        }
        least
    }
}

/// Half of the least way across the lumen at a place on the device's axis, mm, if that is less than its radius: along the normal of the
/// nearest wall, and aslant.
fn room_mm(surface: &ContactSurface, place: &Vec3, radius_mm: f64) -> Option<f64> {
    let near = surface.query.nearest(place, 2.0 * radius_mm)?;
    let n = near.normal;
    // In a lumen narrower than that the middle of what there is.
    let opposite_mm = facing_mm(surface, &(near.point_mm + n * ON_MM), &n, OFF * radius_mm);
    let from = near.point_mm + n * opposite_mm.map_or(OFF * radius_mm, |way_mm| 0.5 * way_mm);
    let e = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    let f = n.cross(&e);
    let aslant = TILTS.into_iter().flat_map(|tilt| [e, f, -e, -f].map(|side| (n + side * tilt).normalize()));
    let ways = std::iter::once(n).chain(aslant);
    let across = ways.filter_map(|way| {
        let ahead_mm = facing_mm(surface, &from, &way, 2.0 * radius_mm)?;
        let (back_mm, _) = surface.query.first_met(&from, &-way, 2.0 * radius_mm - ahead_mm)?;
        Some(0.5 * (ahead_mm + back_mm))
    });
    across.min_by(f64::total_cmp)
}

/// How far ahead the wall that faces `from` is, mm, within `reach_mm`.
fn facing_mm(surface: &ContactSurface, from: &Vec3, way: &Vec3, reach_mm: f64) -> Option<f64> {
    let mut ahead_mm = 0.0;
    for _ in 0..PIECES {
        let (met_mm, triangle) =
            surface.query.first_met(&(from + way * ahead_mm), way, reach_mm - ahead_mm)?;
        ahead_mm += met_mm;
        if surface.query.inward_normal(triangle).dot(way) < 0.0 {
            return Some(ahead_mm);
        }
        ahead_mm += ON_MM;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Stack};
    use crate::insertion::{Command, Move, Sheath, Surroundings, WallProperties};
    use crate::methods::Method;
    use crate::methods::kirchhoff::workspace::Workspace;
    use crate::methods::kirchhoff::{Kirchhoff, KirchhoffOptions};
    use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution, WallQuery};

    /// What is said of a wire of radius 0.4 mm that is pushed into a tube which narrows from 3 mm to `end_mm`.
    fn pushed_into(end_mm: f64) -> Option<PhysicalEnd> {
        let nodes = (0..40).map(|i| CentrelineNode {
            position_mm: Vec3::z() * f64::from(i),
            radius_mm: (3.0 - 0.1 * f64::from(i)).max(end_mm),
            parent: usize::try_from(i - 1).ok(),
        });
        let tree = CentrelineTree::new(nodes.collect()).unwrap();
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.3)).unwrap();
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
        let (device, properties) = (Device::uniform(60.0, 0.4, 10.0).unwrap(), WallProperties::default());
        let query = WallQuery::new(&made.wall).unwrap();
        let stack = Stack::from(device.clone());
        let surroundings = Surroundings {
            wall: &made.wall,
            properties: &properties,
            query: &query,
            sheath: &sheath,
            device: &device,
            stack: &stack,
            motion: None,
            flow: None,
            time_s: [0.0; 2],
        };
        let options = KirchhoffOptions::default();
        let mut wire = Kirchhoff::<{ crate::rod::PLAIN }>::new(options, &surroundings, &NoStore).unwrap();
        for _ in 0..33 {
            wire.step(&surroundings, Command::advance(1.0)).unwrap();
        }
        let environment = Environment::new(&surroundings, &wire.surface, &wire.options);
        let mut workspace = Workspace::<{ crate::rod::PLAIN }>::new(&environment, &wire.state);
        let moves = [Move { instrument: 0, command: Command::advance(1.0) }];
        workspace.carry_out(&environment, &wire.state, &moves).unwrap();
        workspace.tools.narrowest(&environment, workspace.now.start()).map(|(_, end)| end)
    }

    #[test]
    fn the_room_across_is_that_of_the_narrow_tube_and_a_wide_one_has_enough() {
        match pushed_into(0.3) {
            Some(PhysicalEnd::Blocked { position_mm, lumen_radius_mm, device_radius_mm }) => {
                assert!((lumen_radius_mm - 0.3).abs() < 0.05, "{lumen_radius_mm}");
                assert!(position_mm.z > 25.0 && device_radius_mm == 0.4, "{position_mm}");
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(pushed_into(0.6), None);
    }
}
