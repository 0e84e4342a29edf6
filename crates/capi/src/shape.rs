//! Where things are: the line of the instruments, their radii, coils, the vessel.

use endowire_core::Vec3;
use endowire_core::device::line_mm;
use endowire_core::insertion::Simulation;
use endowire_core::vessel::NoStore;

use crate::border::{Room, handle};
use crate::simulation::EndowireSimulation;
use crate::status::{EndowireStatus, Failure, call};

/// Rounding of an arc length at the end of a device, mm.
const SLACK_MM: f64 = 1e-9;

/// Points as C has them.
fn points(list: &[Vec3]) -> Vec<[f64; 3]> {
    list.iter().map(|point| (*point).into()).collect()
}

/// The outer radius of an instrument at every point of the line; 0 where it is not.
fn radii_mm(simulation: &Simulation, index: usize) -> Result<Vec<f64>, Failure> {
    let instruments = simulation.stack().instruments();
    let Some(instrument) = instruments.get(index) else {
        let text = format!("instrument = {index}: there are {}, the innermost is 0", instruments.len());
        return Err(Failure::input(text));
    };
    let lengths_mm = simulation.report().lengths_mm();
    let (inserted_mm, line_mm) = (lengths_mm[index], line_mm(lengths_mm.iter().copied()));
    let radius_mm = |from_tip_mm: &f64| {
        // From the tip of this one, which may lie behind that of the line.
        let own_mm = from_tip_mm - (line_mm - inserted_mm);
        let is_there = inserted_mm > 0.0 && own_mm >= -SLACK_MM;
        if is_there { instrument.device.section_at(own_mm.max(0.0)).radius_mm } else { 0.0 }
    };
    Ok(simulation.shape().from_tip_mm.iter().map(radius_mm).collect())
}

/// Copies the centre line that all instruments share, from the mouth of the sheath to the tip: a list (see the top) of
/// points x, y, z in mm. `capacity` and `count` are in points: `positions_mm` has room for 3 * `capacity` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_positions_mm(
    simulation: *const EndowireSimulation,
    positions_mm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let list = points(&unsafe { handle("simulation", simulation) }?.lock()?.shape().positions_mm);
        // SAFETY: the caller's promise of room for as many points as the capacity says, and of a place for a count.
        unsafe { Room { name: "positions_mm", out: positions_mm.cast(), capacity, count }.take(&list) }
    })
}

/// Copies the outer radius of an instrument at each point of `endowire_positions_mm`, mm; 0 where it is not. A list (see the
/// top).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_radii_mm(
    simulation: *const EndowireSimulation,
    instrument: usize,
    radii_mm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let list = self::radii_mm(&simulation, instrument)?;
        // SAFETY: the caller's promise of room for as many as the capacity says, and of a place for a count.
        unsafe { Room { name: "radii_mm", out: radii_mm, capacity, count }.take(&list) }
    })
}

/// Copies the line of a detached coil, from its detached end to its tip; coils are counted from 0 in the order in which they
/// were detached. A list of points, as of `endowire_positions_mm`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_coil_positions_mm(
    simulation: *const EndowireSimulation,
    coil: usize,
    positions_mm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let coils = simulation.coils();
        let Some(left) = coils.get(coil) else {
            return Err(Failure::input(format!(
                "coil = {coil}: {} are detached, the first is 0",
                coils.len()
            )));
        };
        let list = points(&left.shape.positions_mm);
        // SAFETY: the caller's promise of room for as many points as the capacity says, and of a place for a count.
        unsafe { Room { name: "positions_mm", out: positions_mm.cast(), capacity, count }.take(&list) }
    })
}

/// Copies the vertices of the vessel at rest, mm: a list of points, as of `endowire_positions_mm`. They never change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_vessel_vertices_mm(
    simulation: *const EndowireSimulation,
    vertices_mm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let list = points(&simulation.lumen().wall(&NoStore)?.mesh().vertices_mm);
        // SAFETY: the caller's promise of room for as many points as the capacity says, and of a place for a count.
        unsafe { Room { name: "vertices_mm", out: vertices_mm.cast(), capacity, count }.take(&list) }
    })
}

/// Copies the vertices of the vessel where they are now, mm, as many and in the same order as those at rest: where the vessel
/// moves (`[[vessel.motion]]`) or its course yields (`[vessel.yielding]`) they change with every step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_vessel_vertices_now_mm(
    simulation: *const EndowireSimulation,
    vertices_mm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let displacement = simulation.displacement();
        let wall = simulation.lumen().wall(&NoStore)?;
        let now = |at: &Vec3| displacement.as_ref().map_or(*at, |now| now.place(at)).into();
        let list: Vec<[f64; 3]> = wall.mesh().vertices_mm.iter().map(now).collect();
        // SAFETY: the caller's promise of room for as many points as the capacity says, and of a place for a count.
        unsafe { Room { name: "vertices_mm", out: vertices_mm.cast(), capacity, count }.take(&list) }
    })
}

/// Copies the triangles of the vessel: a list (see the top) of three numbers of vertices each, counter-clockwise seen from
/// outside. `capacity` and `count` are in triangles: `triangles` has room for 3 * `capacity` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_vessel_triangles(
    simulation: *const EndowireSimulation,
    triangles: *mut u32,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let list: &[[u32; 3]] = &simulation.lumen().wall(&NoStore)?.mesh().triangles;
        // SAFETY: the caller's promise of room for as many triangles as the capacity says, and of a place for a count.
        unsafe { Room { name: "triangles", out: triangles.cast(), capacity, count }.take(list) }
    })
}
