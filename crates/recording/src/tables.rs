//! The tables of a recording that grow step by step. A step is in all of them or in none.

use std::io;
use std::path::Path;

use endowire_core::insertion::{DetachedCoil, Move, Simulation};
use endowire_core::vessel::Sac;
use endowire_core::{Error, Result};

use crate::coils::CoilTable;
use crate::instruments::InstrumentTable;
use crate::packing::{Packed, PackingTable};
use crate::steps::{STEPS, StepRow};
use crate::table::StepTable;
use crate::vessel::VesselTables;

/// The tables of a run.
pub(crate) struct Tables {
    steps: StepTable,
    instruments: InstrumentTable,
    packing: Option<PackingTable>,
    coils: CoilTable,
    vessel: Option<VesselTables>,
}

impl Tables {
    /// Those of a new recording of this simulation.
    pub(crate) fn new(folder: &Path, at: &Simulation) -> io::Result<Self> {
        Ok(Self {
            steps: StepTable::new(&folder.join(STEPS))?,
            instruments: InstrumentTable::new(folder)?,
            packing: None,
            coils: CoilTable::new(folder),
            vessel: VesselTables::go_on(folder, 0, at)?,
        })
    }

    /// Those of a recording that resumes after a step, up to which the table of steps has so many bytes; rows of later
    /// steps are dropped.
    pub(crate) fn go_on(folder: &Path, (steps, bytes): (usize, u64), at: &Simulation) -> Result<Self> {
        let failed = |error: io::Error| Error::file(folder, error);
        Ok(Self {
            steps: StepTable::cut(&folder.join(STEPS), bytes).map_err(failed)?,
            instruments: InstrumentTable::go_on(folder, steps).map_err(failed)?,
            packing: None,
            coils: CoilTable::go_on(folder, at.stack(), steps)?,
            vessel: VesselTables::go_on(folder, steps, at).map_err(failed)?,
        })
    }

    /// Adds the packing of a sac, if there is one, from the step after `steps` on.
    pub(crate) fn pack(
        &mut self,
        folder: &Path,
        sac: Option<Sac>,
        steps: usize,
        simulation: &Simulation,
    ) -> Result<()> {
        let table = |sac| PackingTable::go_on(folder, sac, steps, simulation);
        self.packing = sac.map(table).transpose()?;
        Ok(())
    }

    /// Writes the rows of a step, which [`Self::keep`] keeps and [`Self::take_back`] drops, also where this failed.
    pub(crate) fn write(&mut self, row: StepRow, moves: &[Move], simulation: &Simulation) -> io::Result<()> {
        let step = row.step;
        self.instruments.push(step, moves, simulation)?;
        if let Some(packing) = &mut self.packing {
            packing.push(step, simulation)?;
        }
        self.coils.push(step, simulation)?;
        if let Some(vessel) = &mut self.vessel {
            vessel.push(step, simulation)?;
        }
        self.steps.push(row)?;
        self.each_mut().try_for_each(StepTable::write)
    }

    /// Keeps the step that was written.
    pub(crate) fn keep(&mut self) {
        self.each_mut().for_each(StepTable::keep);
        self.packing.iter_mut().for_each(PackingTable::keep);
        self.coils.keep();
    }

    /// Drops what was written of a step.
    pub(crate) fn take_back(&mut self) {
        self.each_mut().for_each(StepTable::take_back);
    }

    /// All of them. That of steps is the last one: what it has, the others have.
    fn each_mut(&mut self) -> impl Iterator<Item = &mut StepTable> {
        let vessel = self.vessel.iter_mut().flat_map(|vessel| [&mut vessel.unknowns, &mut vessel.places]);
        let packing = self.packing.iter_mut().map(|packing| &mut packing.table);
        let instruments = std::iter::once(&mut self.instruments.table);
        let coils = self.coils.table.iter_mut();
        instruments.chain(packing).chain(coils).chain(vessel).chain(std::iter::once(&mut self.steps))
    }

    /// Packing of the sac after the last step.
    pub(crate) fn packed(&self) -> Option<Packed> {
        self.packing.as_ref().map(PackingTable::reported)
    }

    /// Detached coils after the last step.
    pub(crate) fn coils(&self) -> &[DetachedCoil] {
        self.coils.reported()
    }

    /// Length of the table of steps.
    pub(crate) fn bytes_of_steps(&self) -> io::Result<u64> {
        self.steps.bytes()
    }

    /// Syncs all rows to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.instruments.table.sync()?;
        self.packing.as_ref().map_or(Ok(()), |packing| packing.table.sync())?;
        self.coils.table.as_ref().map_or(Ok(()), StepTable::sync)?;
        if let Some(vessel) = &self.vessel {
            vessel.unknowns.sync()?;
            vessel.places.sync()?;
        }
        self.steps.sync()
    }
}
