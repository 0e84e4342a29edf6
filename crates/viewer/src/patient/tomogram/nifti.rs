//! NIfTI-1 and NIfTI-2 files, bare or compressed.
//!
//! The two formats have equivalent headers of 348 and 540 bytes; the library used reads the first. For the second
//! (<https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h>) the header is read here, and its voxels as if they had one of
//! the first. Axes are right, anterior, superior in both.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use endowire_core::nalgebra::Matrix3;
use endowire_core::{Error, Result, Vec3};
use flate2::bufread::MultiGzDecoder;
use nifti::{
    Endianness, InMemNiftiObject, InMemNiftiVolume, NiftiError, NiftiHeader, NiftiObject, NiftiVolume,
    RandomAccessNiftiVolume, ReaderOptions,
};

use super::{MOST_VOXELS, Scan};

/// Size of a header of the first format, bytes, and its magic string where voxels are in another file.
const FIRST_BYTES: u64 = 348;
const FIRST_OF_PAIR: &[u8; 4] = b"ni1\0";
/// Size of a header of the second format, bytes.
const SECOND_BYTES: usize = 540;
/// Start of its magic string in a file of header and voxels, and in one of a pair.
const SECOND: &[u8] = b"n+2\0";
const SECOND_OF_PAIR: &[u8] = b"ni2\0";

/// What the library that decompresses says of bytes that are not those that were compressed.
const CHECKSUM: &str = "checksum";

/// Reads the Hounsfield units in a file of either format.
///
/// # Errors
/// [`Error::Content`] for an unusable volume.
pub(super) fn read(path: &Path) -> Result<Scan> {
    let stored = Stored::read(path)?;
    let mut hu = Vec::with_capacity(stored.size.iter().product());
    let filled = stored.each(|_, value| {
        hu.push(value);
        Ok(())
    });
    filled.map_err(|reason| Error::content(path, reason))?;
    Ok(Scan { size: stored.size, axes: stored.axes, origin_mm: stored.origin_mm, hu })
}

/// The volume of a file, as it is stored.
pub(super) struct Stored {
    pub(super) size: [usize; 3],
    /// Voxel (i, j, k) is at `origin_mm` + `axes` · (i, j, k), in LPS.
    pub(super) axes: Matrix3<f64>,
    pub(super) origin_mm: Vec3,
    volume: InMemNiftiVolume,
}

/// Why the library cannot read a file, in words.
fn reason(error: &NiftiError) -> String {
    match error {
        NiftiError::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            "is no NIfTI volume: it is empty, or ends within its header; copy or download it again".into()
        }
        NiftiError::Io(error) if error.to_string().contains(CHECKSUM) => {
            "is damaged: what it holds does not fit its checksum; copy or download it again".into()
        }
        NiftiError::Io(error) => format!("is no NIfTI volume: {error}"),
        other => format!("is no NIfTI volume: {other}"),
    }
}

/// The same behind its header.
fn reason_of_voxels(error: &NiftiError) -> String {
    // No more bytes are read than the header says.
    let is_cut = match error {
        NiftiError::Io(error) => error.kind() == io::ErrorKind::UnexpectedEof,
        other => matches!(other, NiftiError::IncompatibleLength(..)),
    };
    if is_cut {
        return "is cut off: it holds fewer voxels than its header says; copy or download it again"
            .to_owned();
    }
    reason(error)
}

impl Stored {
    /// Reads a file of either format.
    ///
    /// # Errors
    /// [`Error::Content`] for an unusable volume.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let bad = |reason: String| Error::content(path, reason);
        let unreadable = |error: NiftiError| bad(reason(&error));
        let cut = |error: NiftiError| bad(reason_of_voxels(&error));
        named(path).map_err(bad)?;
        let header = second(path).map_err(bad)?;
        let (header, placed, volume) = match header {
            Some((mut header, placed, offset)) => {
                check_size(&header).map_err(bad)?;
                scaled(&mut header).map_err(bad)?;
                let mut voxels = plain(path).map_err(|e| unreadable(e.into()))?;
                io::copy(&mut (&mut voxels).take(offset), &mut io::sink()).map_err(|e| cut(e.into()))?;
                let volume = loaded(voxels, &header).map_err(cut)?;
                (header, placed, volume)
            }
            None => {
                // The header first: it gives the memory the volume needs.
                let mut voxels = plain(path).map_err(|e| unreadable(e.into()))?;
                let mut header = NiftiHeader::from_reader(&mut voxels).map_err(unreadable)?;
                check_size(&header).map_err(bad)?;
                let is_scaled = scaled(&mut header).map_err(bad)?;
                let placed = Placed::first(&header);
                if &header.magic != FIRST_OF_PAIR {
                    let offset = (header.vox_offset as u64).saturating_sub(FIRST_BYTES);
                    io::copy(&mut (&mut voxels).take(offset), &mut io::sink()).map_err(|e| cut(e.into()))?;
                    let volume = loaded(voxels, &header).map_err(cut)?;
                    return Self::new(volume, &placed, &header).map_err(bad);
                }
                let object: InMemNiftiObject = ReaderOptions::new().read_file(path).map_err(unreadable)?;
                let read = object.into_volume();
                // The library applies the file's scaling.
                let volume = match is_scaled {
                    true => read,
                    false => {
                        InMemNiftiVolume::from_raw_data(&header, read.into_raw_data()).map_err(unreadable)?
                    }
                };
                (header, placed, volume)
            }
        };
        Self::new(volume, &placed, &header).map_err(bad)
    }

    fn new(
        volume: InMemNiftiVolume,
        placed: &Placed,
        header: &NiftiHeader,
    ) -> std::result::Result<Self, String> {
        let [nx, ny, nz] = match volume.dim() {
            [x, y, z] | [x, y, z, 1] => [*x, *y, *z],
            other => return Err(format!("a volume has three dimensions, not {other:?}")),
        };
        let (axes, origin_mm) = placed.in_lps(header.xyzt_units)?;
        Ok(Self { size: [nx, ny, nz].map(usize::from), axes, origin_mm, volume })
    }

    /// Calls `take` with the place and the value of each voxel, scaled as the file says, the first index fastest.
    pub(super) fn each(
        &self,
        mut take: impl FnMut([usize; 3], f32) -> std::result::Result<(), String>,
    ) -> std::result::Result<(), String> {
        let dimensions = self.volume.dim().len();
        let [nx, ny, nz] = self.size.map(|n| n as u16);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let value = self.volume.get_f32(&[x, y, z, 0][..dimensions]);
                    let value = value.map_err(|e| format!("voxel [{x}, {y}, {z}] cannot be read: {e}"))?;
                    take([x, y, z].map(usize::from), value)?;
                }
            }
        }
        Ok(())
    }
}

/// The volume of the bytes that follow. Memory grows with what is read: a header may promise anything.
fn loaded(voxels: impl Read, header: &NiftiHeader) -> std::result::Result<InMemNiftiVolume, NiftiError> {
    let dims = usize::from(header.dim[0]).clamp(1, 7);
    let voxel = header.data_type()?.size_of() as u64;
    let bytes = header.dim[1..=dims].iter().fold(voxel, |product, n| product.saturating_mul(u64::from(*n)));
    let mut raw = Vec::new();
    let mut voxels = voxels.take(bytes);
    voxels.read_to_end(&mut raw)?;
    // The checksum of what was decompressed is looked at behind its last byte.
    let end = voxels.into_inner().read(&mut [0]);
    if let Err(error) = end
        && error.to_string().contains(CHECKSUM)
    {
        return Err(error.into());
    }
    InMemNiftiVolume::from_raw_data(header, raw)
}

/// What a file is in place of NIfTI, if its first bytes leave no doubt.
fn named(path: &Path) -> std::result::Result<(), String> {
    const BEGINNING: u64 = 4096;
    let header = path.with_extension("hdr");
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("img")) && header.is_file() {
        return Err(format!("holds the voxels of a pair of files: give its header, {}", header.display()));
    }
    let mut bytes = Vec::new();
    // Unreadable files are reported by the reader of the first format.
    let read = File::open(path).and_then(|file| file.take(BEGINNING).read_to_end(&mut bytes));
    if read.is_err() || bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(());
    }
    let meta: [&[u8]; 3] = [b"ObjectType", b"NDims", b"Comment"];
    let other = if bytes.starts_with(b"NRRD") {
        Some("an NRRD volume")
    } else if meta.iter().any(|key| bytes.starts_with(key)) {
        Some("a MetaImage volume (.mha, .mhd)")
    } else if bytes.get(128..132) == Some(b"DICM") {
        return Err("is a single DICOM file: give the folder of its slices, one file each; of an enhanced file, which has all \
                    slices, write NIfTI (dcm2niix, or 3D Slicer: Save, .nii.gz)"
            .into());
    } else {
        None
    };
    match (other, endowire_core::file::foreign(&bytes)) {
        (Some(kind), _) => {
            Err(format!("is {kind}, and NIfTI is read: write it as .nii.gz (3D Slicer: Save, .nii.gz)"))
        }
        (None, Some(kind)) => Err(kind.into()),
        (None, None) => Ok(()),
    }
}

/// Whether values are to be scaled; a slope of 0 or NaN means that they are stored unscaled (as in nibabel), and
/// becomes 1.
fn scaled(header: &mut NiftiHeader) -> std::result::Result<bool, String> {
    if header.scl_slope == 0.0 || !header.scl_slope.is_finite() {
        (header.scl_slope, header.scl_inter) = (1.0, 0.0);
        return Ok(false);
    }
    match header.scl_inter.is_finite() {
        true => Ok(true),
        false => Err(format!("says scl_inter = {} beside a slope; mend its header", header.scl_inter)),
    }
}

/// A file's bytes, decompressed if needed; the file may be of several compressed parts.
fn plain(path: &Path) -> io::Result<Box<dyn Read>> {
    let mut file = BufReader::new(File::open(path)?);
    let compressed = file.fill_buf()?.starts_with(&[0x1f, 0x8b]);
    Ok(if compressed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) })
}

/// Rejects a volume too large for memory, and one whose header contradicts itself about the size of a voxel.
fn check_size(header: &NiftiHeader) -> std::result::Result<(), String> {
    let bits = header.data_type().map_or(header.bitpix, |kind| 8 * kind.size_of() as i16);
    if header.bitpix != bits {
        return Err(format!(
            "says bitpix = {} of voxels that have {bits} bits; mend its header",
            header.bitpix
        ));
    }
    let dims = usize::from(header.dim[0]).clamp(1, 7);
    let voxels = header.dim[1..=dims].iter().fold(1_u64, |product, n| product.saturating_mul(u64::from(*n)));
    if voxels <= MOST_VOXELS {
        return Ok(());
    }
    Err(format!(
        "has {voxels} voxels (dim = {:?}), at most {MOST_VOXELS} are read: crop it or make it coarser",
        &header.dim[1..=dims]
    ))
}

/// The header of a file of the second format converted to the first, with the placement and the offset of its voxels;
/// `None` for any other file.
fn second(path: &Path) -> std::result::Result<Option<(NiftiHeader, Placed, u64)>, String> {
    let mut bytes = Vec::with_capacity(SECOND_BYTES);
    // Unreadable files are reported by the reader of the first format.
    let read = plain(path).and_then(|file| file.take(SECOND_BYTES as u64).read_to_end(&mut bytes));
    if read.is_err() || bytes.len() < SECOND_BYTES {
        return Ok(None);
    }
    if &bytes[4..8] == SECOND_OF_PAIR {
        return Err("is the header of a NIfTI-2 pair; join header and voxels in one .nii file".into());
    }
    let header = [Endianness::Little, Endianness::Big].map(|order| Fields { bytes: &bytes, order });
    let Some(of) = header.into_iter().find(|of| of.i32(0) == SECOND_BYTES as i32) else { return Ok(None) };
    if &bytes[4..8] != SECOND {
        return Ok(None);
    }
    let mut dim = [0; 8];
    for (k, n) in dim.iter_mut().enumerate() {
        let side = of.i64(16 + 8 * k);
        // Sizes beyond the last dimension are meaningless.
        *n = match u16::try_from(side) {
            Ok(side) => side,
            Err(_) if (k as i64) > of.i64(16) => 1,
            Err(_) => return Err(format!("dim[{k}] = {side}: at most {} a side are read", u16::MAX)),
        };
    }
    let offset = of.i64(168);
    let begins = u64::try_from(offset).ok().filter(|begins| *begins >= SECOND_BYTES as u64);
    let begins = begins.ok_or_else(|| format!("its voxels begin at vox_offset = {offset}, in its header"))?;
    let header = NiftiHeader {
        dim,
        datatype: of.i16(12),
        bitpix: of.i16(14),
        scl_slope: of.f64(176) as f32,
        scl_inter: of.f64(184) as f32,
        xyzt_units: of.i32(500) as u8,
        endianness: of.order,
        ..NiftiHeader::default()
    };
    let placed = Placed {
        sform: (of.i32(348) > 0)
            .then(|| [400, 432, 464].map(|row| std::array::from_fn(|k| of.f64(row + 8 * k)))),
        qform: (of.i32(344) > 0)
            .then(|| [[352, 360, 368], [376, 384, 392]].map(|at| at.map(|at| of.f64(at)))),
        spacing: [112, 120, 128].map(|at| of.f64(at)),
        flipped: of.f64(104) < 0.0,
    };
    Ok(Some((header, placed, begins)))
}

/// Numbers of a header at their offsets.
struct Fields<'a> {
    bytes: &'a [u8],
    order: Endianness,
}

impl Fields<'_> {
    fn at<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.bytes[at..at + N]);
        if self.order == Endianness::Big {
            bytes.reverse();
        }
        bytes
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.at(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.at(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.at(at))
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.at(at))
    }
}

/// Placement of voxels, as given by headers of both formats.
struct Placed {
    /// Rows of an affine map.
    sform: Option<[[f64; 4]; 3]>,
    /// Three parts of a quaternion, and the origin.
    qform: Option<[[f64; 3]; 2]>,
    spacing: [f64; 3],
    flipped: bool,
}

impl Placed {
    fn first(header: &NiftiHeader) -> Self {
        let rows = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
        let quaternion = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let origin = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
        Self {
            sform: (header.sform_code > 0).then_some(rows),
            qform: (header.qform_code > 0).then_some([quaternion, origin]),
            spacing: [1, 2, 3].map(|k| f64::from(header.pixdim[k])),
            flipped: header.pixdim[0] < 0.0,
        }
    }

    /// Axes and origin of voxel indices in LPS millimetres: left and posterior change sign.
    fn in_lps(&self, units: u8) -> std::result::Result<(Matrix3<f64>, Vec3), String> {
        let rows = self.sform.unwrap_or_else(|| {
            // Method 2 of the standard: a quaternion, or with no code the spacing alone.
            let [[b, c, d], origin] = self.qform.unwrap_or_default();
            let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
            let rotation = [
                [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
                [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
                [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
            ];
            let flip = if self.flipped { -1.0 } else { 1.0 };
            let [dx, dy, dz] = self.spacing;
            [0, 1, 2].map(|r| {
                let [x, y, z] = rotation[r];
                [x * dx, y * dy, z * dz * flip, origin[r]]
            })
        });
        if rows.iter().flatten().any(|x| !x.is_finite()) {
            return Err("its affine is not finite; mend its sform or qform".into());
        }
        // Spatial units in the lower three bits: metre, millimetre, micrometre; unknown counts as millimetre.
        let unit = match units & 7 {
            1 => 1000.0,
            3 => 1e-3,
            _ => 1.0,
        };
        let sign = [-unit, -unit, unit];
        let axes = Matrix3::from_fn(|r, c| sign[r] * rows[r][c]);
        Ok((axes, Vec3::from_fn(|r, _| sign[r] * rows[r][3])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_affine_is_read_in_patient_axes() {
        let header = NiftiHeader {
            sform_code: 1,
            srow_x: [-0.5, 0.0, 0.0, 100.0],
            srow_y: [0.0, 0.6, 0.0, -50.0],
            srow_z: [0.0, 0.0, 2.0, 7.0],
            xyzt_units: 2,
            ..NiftiHeader::default()
        };
        let (axes, origin) = Placed::first(&header).in_lps(header.xyzt_units).unwrap();
        assert_eq!(origin, Vec3::new(-100.0, 50.0, 7.0));
        assert!(
            (axes[(0, 0)] - 0.5).abs() < 1e-6 && (axes[(1, 1)] + 0.6).abs() < 1e-6 && axes[(2, 2)] == 2.0
        );
    }
}
