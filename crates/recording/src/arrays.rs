//! Shapes and contacts of a run as arrays. During the run each array grows in its own file, so that a run that is
//! killed keeps every step; at the end they are packed into shapes.npz.

use std::io;
use std::path::{Path, PathBuf};

use endowire_core::file::whole;
use endowire_core::insertion::StepReport;
use endowire_core::shape::Shape;

use crate::npz::{self, ArrayStream, Kind, Member};

/// File of the packed arrays.
pub const SHAPES: &str = "shapes.npz";
/// Folder of the growing arrays.
pub(crate) const GROWING: &str = "shapes.part";

const fn member(name: &'static str, kind: Kind, columns: usize, meaning: &'static str) -> Member {
    Member { name, kind, columns, meaning }
}

pub(crate) const POSITIONS: Member =
    member("positions_mm", Kind::F64, 3, "Places of the nodes of all steps, from the sheath to the tip.");
pub(crate) const TANGENTS: Member =
    member("tangents", Kind::F64, 3, "Unit tangents at the nodes, towards the tip.");
pub(crate) const FROM_TIP: Member =
    member("from_tip_mm", Kind::F64, 1, "Arc length of the nodes from the tip.");
pub(crate) const OFFSETS: Member = member(
    "offsets",
    Kind::I64,
    1,
    "Step k, from 0, has the nodes offsets[k] to offsets[k + 1]; one more than there are steps.",
);
pub(crate) const CONTACT_POSITIONS: Member = member(
    "contact_positions_mm",
    Kind::F64,
    3,
    "Places of the contacts of all steps, on the device's axis.",
);
pub(crate) const CONTACT_FORCES: Member = member(
    "contact_forces_n",
    Kind::F64,
    3,
    "Forces of the wall on the device there, normal and friction together.",
);
pub(crate) const CONTACT_OFFSETS: Member = member(
    "contact_offsets",
    Kind::I64,
    1,
    "Step k, from 0, has the contacts contact_offsets[k] to contact_offsets[k + 1].",
);

/// All arrays, in the order of packing.
pub(crate) const MEMBERS: [Member; 7] =
    [POSITIONS, TANGENTS, FROM_TIP, OFFSETS, CONTACT_POSITIONS, CONTACT_FORCES, CONTACT_OFFSETS];

/// The arrays of a running recording.
pub(crate) struct ShapeArrays {
    folder: PathBuf,
    arrays: [ArrayStream; 7],
    nodes: i64,
    contacts: i64,
}

impl ShapeArrays {
    /// Empty arrays in the folder of a recording.
    pub(crate) fn new(recording: &Path) -> io::Result<Self> {
        let folder = recording.join(GROWING);
        std::fs::create_dir_all(&folder)?;
        let [a, b, c, d, e, f, g] = MEMBERS.map(|member| ArrayStream::new(member, &folder));
        let mut arrays = [a?, b?, c?, d?, e?, f?, g?];
        arrays[3].push_i64(0)?;
        arrays[6].push_i64(0)?;
        Ok(Self { folder, arrays, nodes: 0, contacts: 0 })
    }

    /// Empty arrays that replace those of the recording, packed or not.
    pub(crate) fn anew(recording: &Path) -> io::Result<Self> {
        whole::remove(&recording.join(SHAPES))?;
        Self::new(recording)
    }

    /// The first `steps` steps of the arrays of a recording, packed or not, ready for more steps.
    pub(crate) fn go_on(recording: &Path, steps: usize) -> io::Result<Self> {
        let folder = recording.join(GROWING);
        let packed = recording.join(SHAPES);
        if packed.exists() {
            std::fs::create_dir_all(&folder)?;
            for member in MEMBERS {
                std::fs::write(folder.join(member.file_name()), npz::read(&packed, member.name)?.concat())?;
            }
        }
        let count = |member: &Member| -> io::Result<i64> {
            let numbers = npz::read_unpacked(&folder, member)?;
            let number = numbers.get(steps).ok_or_else(|| io::Error::from(io::ErrorKind::UnexpectedEof))?;
            Ok(i64::from_le_bytes(*number))
        };
        let (nodes, contacts) = (count(&OFFSETS)?, count(&CONTACT_OFFSETS)?);
        let [n, c, s] = [nodes as u64, contacts as u64, steps as u64 + 1];
        let open =
            |member: Member, rows: u64| ArrayStream::open(member, &folder, rows * member.columns as u64);
        let arrays = [
            open(POSITIONS, n)?,
            open(TANGENTS, n)?,
            open(FROM_TIP, n)?,
            open(OFFSETS, s)?,
            open(CONTACT_POSITIONS, c)?,
            open(CONTACT_FORCES, c)?,
            open(CONTACT_OFFSETS, s)?,
        ];
        // Removed last, because the packed arrays stay valid until the growing ones are complete.
        whole::remove(&packed)?;
        Ok(Self { folder, arrays, nodes, contacts })
    }

    /// Adds a step, and calls `write_more` for what belongs to it. If either fails, earlier steps are kept.
    pub(crate) fn push(
        &mut self,
        shape: &Shape,
        report: &StepReport,
        write_more: impl FnOnce() -> io::Result<()>,
    ) -> io::Result<()> {
        let whole = self.arrays.each_ref().map(ArrayStream::len);
        let nodes = self.nodes + shape.len() as i64;
        let contacts = self.contacts + report.contacts.len() as i64;
        let [positions, tangents, from_tip, offsets, points, forces, contact_offsets] = &mut self.arrays;
        let push = || -> io::Result<()> {
            positions.push_f64(shape.positions_mm.iter().flat_map(|x| [x.x, x.y, x.z]))?;
            tangents.push_f64(shape.tangents.iter().flat_map(|t| [t.x, t.y, t.z]))?;
            from_tip.push_f64(shape.from_tip_mm.iter().copied())?;
            points.push_f64(report.contacts.iter().flat_map(|c| <[f64; 3]>::from(c.position_mm)))?;
            forces.push_f64(report.contacts.iter().flat_map(|c| <[f64; 3]>::from(c.total_n())))?;
            // Written last, because a step counts once its offsets are written.
            contact_offsets.push_i64(contacts)?;
            offsets.push_i64(nodes)?;
            write_more()
        };
        let pushed = push();
        match pushed {
            Ok(()) => (self.nodes, self.contacts) = (nodes, contacts),
            Err(_) => self.arrays.iter_mut().zip(whole).for_each(|(array, numbers)| array.truncate(numbers)),
        }
        pushed
    }

    /// Syncs all steps to disk.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.arrays.iter().try_for_each(ArrayStream::sync)
    }

    /// Packs the arrays into shapes.npz; if that fails, the growing ones stay.
    pub(crate) fn pack(mut self, recording: &Path) -> io::Result<()> {
        whole::write(&recording.join(SHAPES), |file| npz::write(file.try_clone()?, &mut self.arrays))?;
        // Some systems cannot remove an open file.
        drop(self.arrays);
        remove_growing(&self.folder)
    }
}

/// Removes growing arrays and their folder, unless it contains files of the user.
pub(crate) fn remove_growing(folder: &Path) -> io::Result<()> {
    for member in MEMBERS {
        whole::remove(&folder.join(member.file_name()))?;
    }
    let _ = std::fs::remove_dir(folder);
    Ok(())
}
