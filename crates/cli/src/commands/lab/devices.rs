//! Devices by name in the catalogue or by file.

use std::path::{Path, PathBuf};

use endowire_core::device::DeviceFile;

use crate::failure::Failure;
use crate::output::provenance::read_input;
use crate::scenes;

/// Folder of devices that can be named without a path.
const CATALOGUE: &str = "assets/devices";

/// A device that was named on a command line.
pub(crate) struct NamedDevice {
    /// The stem of its file.
    pub(crate) stem: String,
    pub(crate) file: DeviceFile,
    /// Bytes of the file.
    pub(crate) input: Vec<u8>,
}

/// Reads devices, each given by a file or by its name in the catalogue.
pub(crate) fn read_all(which: &[PathBuf]) -> Result<Vec<NamedDevice>, Failure> {
    which.iter().map(|which| read(which)).collect()
}

fn read(which: &Path) -> Result<NamedDevice, Failure> {
    let path = scenes::named(which, CATALOGUE, "device")?;
    let input = read_input(&path)?;
    let file = DeviceFile::read(&path)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(NamedDevice { stem, file, input })
}
