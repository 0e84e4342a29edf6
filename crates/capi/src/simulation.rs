//! Simulations: made, moved, freed.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use endowire_core::insertion::Simulation;
use endowire_core::vessel::NoStore;
use endowire_core::{Command, Move};

use crate::border::{free, handle, lock, make, slice};
use crate::scene::{EndowireScene, Read};
use crate::status::{EndowireStatus, Failure, call};

/// An insertion: instruments in a vessel, stepped by commands. One thread at a time may use it.
pub struct EndowireSimulation {
    pub(crate) read: Arc<Read>,
    /// Differs from that of all others: pictures show motion since the last picture of the same simulation.
    pub(crate) number: u64,
    inner: Mutex<Simulation>,
}

impl EndowireSimulation {
    fn new(read: Arc<Read>, simulation: Simulation) -> Self {
        static MADE: AtomicU64 = AtomicU64::new(0);
        Self { read, number: MADE.fetch_add(1, Ordering::Relaxed), inner: Mutex::new(simulation) }
    }

    /// The simulation, unless another thread uses it or a panic has left it half done.
    pub(crate) fn lock(&self) -> Result<MutexGuard<'_, Simulation>, Failure> {
        lock("simulation", &self.inner)
    }
}

/// Motion of one instrument.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndowireMove {
    /// Which instrument: in the order of the scene, the innermost is 0.
    pub instrument: u64,
    /// Length pushed in, mm; negative pulls back.
    pub advance_mm: f64,
    /// Rotation of the tail about its axis, rad; positive is right-handed about the direction of insertion.
    pub rotate_rad: f64,
    /// Change of the value to which a steered instrument is steered, which stays within -1 and 1; 0 for others.
    pub steer: f64,
}

impl EndowireMove {
    fn as_move(&self) -> Move {
        let &Self { instrument, advance_mm, rotate_rad, steer } = self;
        // More than there can be is refused as any other that does not exist.
        let instrument = usize::try_from(instrument).unwrap_or(usize::MAX);
        Move { instrument, command: Command { advance_mm, rotate_rad, steer } }
    }
}

/// Makes the simulation of a scene, at its start: what instruments specify is inserted. Reading the vessel takes its time;
/// clones share it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_simulation_new(
    scene: *const EndowireScene,
    out: *mut *mut EndowireSimulation,
) -> EndowireStatus {
    // SAFETY: the caller's promise of a handle, and of a place for another.
    call(|| unsafe {
        make(out, || {
            let read = Arc::clone(&handle("scene", scene)?.0);
            let simulation = read.scene.simulation(&NoStore)?;
            Ok(EndowireSimulation::new(read, simulation))
        })
    })
}

/// Makes a second simulation in the same state, which goes on by itself, on any thread. It shares the vessel, and takes
/// microseconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_simulation_clone(
    simulation: *const EndowireSimulation,
    out: *mut *mut EndowireSimulation,
) -> EndowireStatus {
    // SAFETY: the caller's promise of a handle, and of a place for another.
    call(|| unsafe {
        make(out, || {
            let simulation = handle("simulation", simulation)?;
            let inner = simulation.lock()?.clone();
            Ok(EndowireSimulation::new(Arc::clone(&simulation.read), inner))
        })
    })
}

/// Frees a simulation. NULL is nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_simulation_free(simulation: *mut EndowireSimulation) {
    // SAFETY: the caller's promise of a handle that is not used any more.
    unsafe { free(simulation) };
}

/// Moves a simulation by these moves.
///
/// # Safety
/// A handle or NULL, and as many moves as `count` says.
unsafe fn moved(
    simulation: *mut EndowireSimulation,
    moves: *const EndowireMove,
    count: usize,
    go: impl FnOnce(&mut Simulation, &[Move]) -> endowire_core::Result<()>,
) -> EndowireStatus {
    call(|| {
        // SAFETY: what this function asks for.
        let (simulation, moves) =
            unsafe { (handle("simulation", simulation)?, slice("moves", moves, count)?) };
        let moves: Vec<Move> = moves.iter().map(EndowireMove::as_move).collect();
        Ok(go(&mut *simulation.lock()?, &moves)?)
    })
}

/// Moves instruments, all at the same time, to the next equilibrium; those without a move keep still. `moves` may be empty
/// (NULL, 0). After an error the state is unchanged, to the bit.
///
/// A step ends after a bounded number of linear solves. What is then left of the motion is behind (`under_way` in
/// `EndowireReport`), and the next step or tick goes on with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_step(
    simulation: *mut EndowireSimulation,
    moves: *const EndowireMove,
    count: usize,
) -> EndowireStatus {
    // SAFETY: the caller's promise, the same.
    unsafe {
        moved(simulation, moves, count, |simulation, moves| simulation.step_until(moves, None).map(drop))
    }
}

/// As `endowire_step`, while time proceeds to `time_s` (s since the start), and with it a vessel that moves.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_step_until(
    simulation: *mut EndowireSimulation,
    moves: *const EndowireMove,
    count: usize,
    time_s: f64,
) -> EndowireStatus {
    let go =
        |simulation: &mut Simulation, moves: &[Move]| simulation.step_until(moves, Some(time_s)).map(drop);
    // SAFETY: the caller's promise, the same.
    unsafe { moved(simulation, moves, count, go) }
}

/// As `endowire_step`, as a tick of bounded cost, for haptics and displays that need an answer in time: in about `solves`
/// linear solves (at least 1; 8 are enough to follow hands at 1 kHz), whether or not the instruments come to rest.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_tick(
    simulation: *mut EndowireSimulation,
    moves: *const EndowireMove,
    count: usize,
    solves: usize,
) -> EndowireStatus {
    let go = |simulation: &mut Simulation, moves: &[Move]| simulation.tick(moves, solves, None).map(drop);
    // SAFETY: the caller's promise, the same.
    unsafe { moved(simulation, moves, count, go) }
}

/// As `endowire_tick`, while time proceeds to `time_s` (s since the start), and with it a vessel that moves.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_tick_until(
    simulation: *mut EndowireSimulation,
    moves: *const EndowireMove,
    count: usize,
    solves: usize,
    time_s: f64,
) -> EndowireStatus {
    let go =
        |simulation: &mut Simulation, moves: &[Move]| simulation.tick(moves, solves, Some(time_s)).map(drop);
    // SAFETY: the caller's promise, the same.
    unsafe { moved(simulation, moves, count, go) }
}

/// Drops the motion that ticks and steps have left behind: the hands are then where the instruments are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_forget(simulation: *mut EndowireSimulation) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        unsafe { handle("simulation", simulation) }?.lock()?.forget();
        Ok(())
    })
}

/// Detaches the coil of an instrument, where it comes to rest, and withdraws its pusher. After an error the state is
/// unchanged.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_detach(
    simulation: *mut EndowireSimulation,
    instrument: usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        unsafe { handle("simulation", simulation) }?.lock()?.detach(instrument)?;
        Ok(())
    })
}
