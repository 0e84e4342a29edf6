//! Detects a vessel narrower than the device that is pushed into it.
//!
//! A device is blocked if no sphere of its radius can pass ahead of its front (`contact/passage.rs`). Any other
//! missing equilibrium is reported as a failed computation. A yielding wall lets a device through a vessel somewhat
//! narrower than itself; this is not an error.

use super::Environment;
use super::configuration::Start;
use super::hands::lengths;
use super::mesh::Mesh;
use crate::contact::passage::{Narrow, narrow_ahead};
use crate::device::line_mm;
use crate::methods::Command;
use crate::rod::RodState;
use crate::rod::quadrature::hermite;
use crate::{Error, PhysicalEnd, Result, Vec3};

/// After no equilibrium was found: rejects commands that advance an instrument where its passage is too narrow.
///
/// # Errors
/// [`PhysicalEnd::Blocked`] with the narrowest position.
pub(super) fn refuse_narrow(
    environment: &Environment<'_>,
    from: Start<'_>,
    commands: &[Command],
) -> Result<()> {
    let lengths_mm: Vec<f64> = lengths(&from.state.hands).collect();
    for (instrument, command) in commands.iter().enumerate() {
        if command.advance_mm > 0.0
            && let Some((narrow, device_radius_mm)) = narrow(environment, from, &lengths_mm, instrument)
        {
            let position_mm = environment.wall().place(&narrow.place_mm);
            let lumen_radius_mm = narrow.radius_mm;
            return Err(Error::End(PhysicalEnd::Blocked { position_mm, lumen_radius_mm, device_radius_mm }));
        }
    }
    Ok(())
}

/// As [`refuse_narrow`], for a wedged device about to be relaxed from a fold: against a nearly rigid wall it would
/// fold behind its held tip, as in the paper's third experiment.
///
/// # Errors
/// As [`refuse_narrow`].
pub(super) fn refuse_wedged(
    environment: &Environment<'_>,
    from: Start<'_>,
    commands: &[Command],
) -> Result<()> {
    let (thinnest_mm, _) = environment.surroundings.stack.radii_mm();
    if from.state.deepest_mm() < environment.options.tuning.passage.wedged * thinnest_mm {
        return Ok(());
    }
    refuse_narrow(environment, from, commands)
}

/// The narrow passage ahead of an instrument, if any, and the instrument's radius there.
fn narrow(
    environment: &Environment<'_>,
    Start { mesh, state }: Start<'_>,
    lengths_mm: &[f64],
    instrument: usize,
) -> Option<(Narrow, f64)> {
    let stack = environment.surroundings.stack;
    let (line_mm, inserted_mm) = (line_mm(lengths_mm.iter().copied()), lengths_mm[instrument]);
    // Inside another instrument it does not touch the wall.
    if lengths_mm[instrument + 1..].iter().any(|outer_mm| *outer_mm >= inserted_mm) {
        return None;
    }
    let tip_mm = line_mm - inserted_mm;
    let radius_mm = stack.outermost_radius_mm(lengths_mm, tip_mm);
    let wall = environment.wall();
    let tuning = &environment.options.tuning.passage;
    let places = (0..tuning.front).map(|k| tip_mm + k as f64 * radius_mm).take_while(|mm| *mm < line_mm);
    let axis_mm: Vec<Vec3> = places.map(|mm| wall.material(&place(mesh, &state.rod, mm))).collect();
    let openings = environment.surroundings.lumen.openings();
    let narrow = narrow_ahead(&wall, openings, &axis_mm, radius_mm, tuning)?;
    Some((narrow, radius_mm))
}

/// A position on the axis at this distance from the tip of the line, within its length, mm.
fn place(mesh: &Mesh, rod: &RodState, from_tip_mm: f64) -> Vec3 {
    let after = mesh.from_tip_mm.partition_point(|mm| *mm > from_tip_mm).clamp(1, mesh.elements.len());
    let (e, length_mm) = (after - 1, mesh.elements[after - 1].length);
    let [w0, s0, w1, s1] = hermite(((mesh.from_tip_mm[e] - from_tip_mm) / length_mm).clamp(0.0, 1.0));
    let (x, frames) = (&rod.positions, &rod.frames);
    x[e] * w0 + x[after] * w1 + (frames[e].t * s0 + frames[after].t * s1) * length_mm
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Stack};
    use crate::insertion::{Command, Move, Sheath, Surroundings, WallProperties};
    use crate::methods::Method;
    use crate::methods::kirchhoff::workspace::Workspace;
    use crate::methods::kirchhoff::{Kirchhoff, KirchhoffOptions};
    use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Lumen, NoStore, Resolution};

    /// The result for a wire of radius 0.4 mm pushed into a tube that narrows from 3 mm to `end_mm`.
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
        let lumen = Lumen::from(made.wall);
        let stack = Stack::from(device.clone());
        let surroundings = Surroundings {
            lumen: &lumen,
            properties: &properties,
            sheath: &sheath,
            device: &device,
            stack: &stack,
            motion: None,
            course: None,
            flow: None,
            fields: [&[], &[]],
            stop: None,
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
        workspace.carry_out(&environment, &wire.state, &moves, usize::MAX).unwrap();
        let forward = [Command::advance(1.0)];
        match refuse_narrow(&environment, workspace.now.start(), &forward) {
            Err(Error::End(end)) => Some(end),
            _ => None,
        }
    }

    #[test]
    fn the_room_ahead_is_that_of_the_narrow_tube_and_a_wide_one_has_enough() {
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
