//! States as bytes, the same as those of `State.to_bytes` in Python.

use std::sync::Arc;

use endowire_core::field::{Field, FieldSpec};
use endowire_core::insertion::{Simulation, State};
use sha2::{Digest, Sha256};

use crate::border::{Room, handle, slice};
use crate::simulation::EndowireSimulation;
use crate::status::{EndowireStatus, Failure, call};

/// First bytes of a saved state, which ends with a hash.
const FORMAT: &[u8] = b"endowire.State 15\n";

/// Length of the hash in bytes.
const HASH_BYTES: usize = 32;

/// The state of a simulation with its fields, as bytes that keep every bit of its numbers.
fn bytes(simulation: &Simulation) -> Result<Vec<u8>, Failure> {
    let failed =
        |error: &dyn std::fmt::Display| Failure::internal(format!("the state cannot be written: {error}"));
    let fields = simulation.fields().map(|fields| fields.iter().filter_map(|one| one.spec()).collect());
    let fields: [Vec<FieldSpec>; 2] = fields;
    // Their tags need a format that describes itself.
    let fields = serde_json::to_string(&fields).map_err(|e| failed(&e))?;
    let mut bytes =
        postcard::to_extend(&(simulation.state(), fields), FORMAT.to_vec()).map_err(|e| failed(&e))?;
    let hash = Sha256::digest(&bytes);
    bytes.extend(hash);
    Ok(bytes)
}

/// The simulation in the state of these bytes.
fn restored(simulation: &Simulation, bytes: &[u8]) -> Result<Simulation, Failure> {
    let refuse = |what: &dyn std::fmt::Display| Failure::input(format!("the bytes of a state: {what}"));
    if !bytes.starts_with(FORMAT) {
        let shown = String::from_utf8_lossy(FORMAT);
        return Err(refuse(&format!(
            "they do not begin with {shown:?}: give what endowire_state_save wrote"
        )));
    }
    let whole = bytes.split_last_chunk::<HASH_BYTES>();
    let whole = whole.filter(|(body, hash)| Sha256::digest(body).as_slice() == *hash);
    let Some(body) = whole.and_then(|(body, _)| body.strip_prefix(FORMAT)) else {
        return Err(refuse(&"they are not whole, or were changed since they were written"));
    };
    let (state, fields): (State, String) = postcard::from_bytes(body).map_err(|e| refuse(&e))?;
    let fields = serde_json::from_str(&fields).map_err(|e| refuse(&format!("fields: {e}")))?;
    let [before, now]: [Vec<FieldSpec>; 2] = fields;
    let mut restored = simulation.clone();
    restored.set_fields(of_specs(&before)?)?;
    restored.restore(&state)?;
    restored.set_fields(of_specs(&now)?)?;
    Ok(restored)
}

/// The fields of these numbers.
fn of_specs(specs: &[FieldSpec]) -> endowire_core::Result<Vec<Arc<dyn Field>>> {
    specs.iter().map(FieldSpec::field).collect()
}

/// Copies the state as bytes: all that the next step depends on besides the scene. A list (see the top); the number of bytes
/// changes from step to step. Programs in Python read them with `State.from_bytes`, and the other way round.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_state_save(
    simulation: *const EndowireSimulation,
    bytes: *mut u8,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let saved = self::bytes(&*unsafe { handle("simulation", simulation) }?.lock()?)?;
        // SAFETY: the caller's promise of room for as many bytes as the capacity says, and of a place for a count.
        unsafe { Room { name: "bytes", out: bytes, capacity, count }.take(&saved) }
    })
}

/// Continues from a state of the same scene, to the bit. After an error nothing has changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_state_restore(
    simulation: *mut EndowireSimulation,
    bytes: *const u8,
    count: usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle and of so many bytes.
        let (simulation, bytes) =
            unsafe { (handle("simulation", simulation)?, slice("bytes", bytes, count)?) };
        let mut simulation = simulation.lock()?;
        *simulation = restored(&simulation, bytes)?;
        Ok(())
    })
}
