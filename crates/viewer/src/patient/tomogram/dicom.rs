//! A series of CT slices: a folder of DICOM files, one per slice.
//!
//! CT Image IOD (DICOM PS3.3, A.3), native pixels of 16 bits in any uncompressed transfer syntax. With rows along
//! **r**, columns along **c** (`ImageOrientationPatient`), the centre of the first pixel at **p**
//! (`ImagePositionPatient`) and the distances Δc between columns and Δr between rows (`PixelSpacing`, which gives
//! that of rows first), pixel (i, j) of a slice is at **p** + i Δc **r** + j Δr **c** (C.7.6.2.1.1), in the scene's
//! axes: left, posterior, superior. Slices are sorted along **r** × **c** and must be equally spaced; those of a
//! tilted gantry are sheared uniformly, which an affine map represents.

use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use dicom_core::value::{PrimitiveValue, Value};
use dicom_core::{Tag, header::HasLength};
use dicom_dictionary_std::{tags, uids};
use dicom_object::mem::InMemElement;
use dicom_object::{DefaultDicomObject, FileMetaTable, OpenFileOptions};
use dicom_parser::dataset::LazyDataToken;
use dicom_parser::dataset::lazy_read::LazyDataSetReader;
use dicom_transfer_syntax_registry::{TransferSyntax, TransferSyntaxIndex, TransferSyntaxRegistry};
use endowire_core::nalgebra::Matrix3;
use endowire_core::{Error, Result, Vec3};

use super::{MOST_VOXELS, Scan};

/// Transfer syntaxes with native pixels.
const NATIVE: [&str; 3] =
    [uids::IMPLICIT_VR_LITTLE_ENDIAN, uids::EXPLICIT_VR_LITTLE_ENDIAN, "1.2.840.10008.1.2.2"];
/// Tolerance of directions within a series, and of their being orthonormal.
const DIRECTION: f64 = 1e-3;
/// Largest displacement of a slice, as a fraction of the distance between slices.
const UNEVEN: f64 = 0.02;
/// Largest number of consecutive missing slices that is reported as a gap, including the one behind it.
const MOST_MISSING: f64 = 20.0;
/// Number of missing slices named in messages.
const NAMED: usize = 5;
/// Largest relative difference of spacings between slices: numbers are written with at most 16 characters.
const SPACING: f64 = 1e-4;
/// Value that replaces padding: air.
const PADDED_HU: f32 = -1000.0;

/// The data of a slice.
struct Slice {
    path: PathBuf,
    series: String,
    size: [usize; 2],
    /// Along rows and along columns.
    directions: [Vec3; 2],
    /// Between columns and between rows.
    spacing_mm: [f64; 2],
    position_mm: Vec3,
    hu: Vec<f32>,
}

/// Reads the series in a folder; other files, and subfolders, are skipped.
///
/// # Errors
/// [`Error::Content`] for a slice that does not belong to a tomogram, and slices that are not one equally spaced
/// series; [`Error::File`] for unreadable files.
pub(super) fn read(folder: &Path) -> Result<Scan> {
    let mut slices = Vec::new();
    let mut voxels = 0;
    for path in files(folder)? {
        let Some(slice) = slice(&path).map_err(|why| Error::content(&path, why))? else { continue };
        voxels += slice.hu.len() as u64;
        if voxels > MOST_VOXELS {
            let why = format!("has more than {MOST_VOXELS} voxels: take out slices or make it coarser");
            return Err(Error::content(folder, why));
        }
        slices.push(slice);
    }
    joined(slices).map_err(|why| Error::content(folder, why))
}

/// Files of a folder with the signature of DICOM, in the order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |error| Error::file(&path, error)
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        let path = entry.map_err(failed(folder))?.path();
        if !path.is_file() {
            continue;
        }
        let mut begin = Vec::with_capacity(132);
        let file = std::fs::File::open(&path).map_err(failed(&path))?;
        file.take(132).read_to_end(&mut begin).map_err(failed(&path))?;
        if begin.ends_with(b"DICM") && begin.len() == 132 {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

type Parsed<T> = std::result::Result<T, String>;

/// A slice; `None` for a DICOMDIR.
fn slice(path: &Path) -> Parsed<Option<Slice>> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let Some(object) = object(&bytes)? else { return Ok(None) };
    let class = text(&object, tags::SOP_CLASS_UID, "SOPClassUID").unwrap_or_default();
    let modality = text(&object, tags::MODALITY, "Modality")?;
    if modality != "CT" {
        return Err(format!(
            "is of modality {modality:?}, whose numbers are no Hounsfield units; take it out of the folder"
        ));
    }
    if class == uids::ENHANCED_CT_IMAGE_STORAGE
        || number(&object, tags::NUMBER_OF_FRAMES).is_ok_and(|n| n > 1.0)
    {
        return Err(
            "holds many frames, and one slice a file is read; export it as single slices, or as NIfTI".into(),
        );
    }
    let whole = |tag, name: &str, [least, most]: [u16; 2]| -> Parsed<u16> {
        let value = number(&object, tag).map_err(|why| format!("{name} {why}"))?;
        let fits = value.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&value);
        if fits { Ok(value as u16) } else { Err(format!("{name} = {value}: must be {least} to {most}")) }
    };
    let [rows, columns] =
        [whole(tags::ROWS, "Rows", [2, u16::MAX])?, whole(tags::COLUMNS, "Columns", [2, u16::MAX])?];
    whole(tags::SAMPLES_PER_PIXEL, "SamplesPerPixel", [1, 1])?;
    whole(tags::BITS_ALLOCATED, "BitsAllocated", [16, 16])?;
    let bits = whole(tags::BITS_STORED, "BitsStored", [1, 16])?;
    whole(tags::HIGH_BIT, "HighBit", [bits - 1, bits - 1])?;
    let signed = whole(tags::PIXEL_REPRESENTATION, "PixelRepresentation", [0, 1])? == 1;
    let [slope, intercept] =
        [(tags::RESCALE_SLOPE, "RescaleSlope"), (tags::RESCALE_INTERCEPT, "RescaleIntercept")].map(
            |(tag, name)| {
                number(&object, tag)
                    .map_err(|why| format!("{name} {why}: its numbers are no Hounsfield units without it"))
            },
        );
    let [slope, intercept] = [slope?, intercept?];
    if let Ok(kind) = text(&object, tags::RESCALE_TYPE, "RescaleType")
        && !matches!(kind.as_str(), "HU" | "")
    {
        return Err(format!("RescaleType = {kind:?}: its numbers are no Hounsfield units"));
    }
    let [rx, ry, rz, cx, cy, cz] =
        numbers(&object, tags::IMAGE_ORIENTATION_PATIENT, "ImageOrientationPatient")?;
    let directions = [Vec3::new(rx, ry, rz), Vec3::new(cx, cy, cz)];
    let off = directions
        .map(|d| (d.norm() - 1.0).abs())
        .into_iter()
        .chain([directions[0].dot(&directions[1]).abs()]);
    if off.fold(0.0, f64::max) > DIRECTION {
        return Err("ImageOrientationPatient is not two directions at right angles".into());
    }
    let [between_rows, between_columns] = numbers(&object, tags::PIXEL_SPACING, "PixelSpacing")?;
    let position: [f64; 3] = numbers(&object, tags::IMAGE_POSITION_PATIENT, "ImagePositionPatient")?;
    let padding = number(&object, tags::PIXEL_PADDING_VALUE).ok();
    let stored = pixels(&object, usize::from(rows) * usize::from(columns))?;
    let spare = 16 - u32::from(bits);
    let value = |raw: u16| {
        // Bits above the stored ones do not belong to the pixel.
        let up = raw << spare;
        f64::from(if signed { i32::from(up as i16 >> spare) } else { i32::from(up >> spare) })
    };
    let hu = stored.into_iter().map(|raw| match value(raw) {
        value if padding == Some(value) => PADDED_HU,
        value => (value * slope + intercept) as f32,
    });
    Ok(Some(Slice {
        path: path.to_path_buf(),
        series: text(&object, tags::SERIES_INSTANCE_UID, "SeriesInstanceUID")?,
        size: [usize::from(columns), usize::from(rows)],
        directions,
        spacing_mm: [between_columns, between_rows],
        position_mm: position.into(),
        hu: hu.collect(),
    }))
}

/// The object in a file; `None` for a DICOMDIR.
fn object(bytes: &[u8]) -> Parsed<Option<DefaultDicomObject>> {
    let explicit = TransferSyntaxRegistry.get(uids::EXPLICIT_VR_LITTLE_ENDIAN).ok_or("cannot be read")?;
    let mut rest = bytes.get(128..).unwrap_or_default();
    check_lengths(rest.get(4..).unwrap_or_default(), explicit, |tag| tag.0 == 2)?;
    let meta = FileMetaTable::from_reader(&mut rest).map_err(|e| unreadable(&e))?;
    if meta.media_storage_sop_class_uid() == uids::MEDIA_STORAGE_DIRECTORY_STORAGE {
        return Ok(None);
    }
    let name = meta.transfer_syntax();
    let syntax = TransferSyntaxRegistry.get(name).filter(|_| NATIVE.contains(&name)).ok_or_else(|| {
        let name: String = name.chars().filter(|c| !c.is_control()).take(64).collect();
        format!("is compressed (transfer syntax {name}); decompress it first, as with `gdcmconv --raw` or `dcmdjpeg`")
    })?;
    check_lengths(rest, syntax, |_| true)?;
    OpenFileOptions::new().from_reader(bytes).map(Some).map_err(|e| unreadable(&e))
}

/// Rejects a file with an element longer than the file, in the elements up to the first that is not `wanted`: a
/// reader allocates before it reads.
fn check_lengths(bytes: &[u8], syntax: &TransferSyntax, wanted: impl Fn(Tag) -> bool) -> Parsed<()> {
    let mut tokens =
        LazyDataSetReader::new_with_ts(Cursor::new(bytes), syntax).map_err(|e| unreadable(&e))?;
    while let Some(token) = tokens.advance() {
        let token = token.map_err(|e| unreadable(&e))?;
        let length = match &token {
            LazyDataToken::ElementHeader(header) if !wanted(header.tag) => return Ok(()),
            LazyDataToken::LazyValue { header, .. } => header.len.get().unwrap_or(0),
            LazyDataToken::LazyItemValue { len, .. } => *len,
            _ => 0,
        };
        if length as usize > bytes.len() {
            return Err(format!(
                "has an element of {length} bytes, more than are in it: it is damaged or cut off"
            ));
        }
        token.skip().map_err(|e| unreadable(&e))?;
    }
    Ok(())
}

fn unreadable(error: &dyn std::error::Error) -> String {
    format!("is no DICOM file that can be read: {}", chain(error))
}

/// The words of a slice's pixels.
fn pixels(object: &DefaultDicomObject, count: usize) -> Parsed<Vec<u16>> {
    let element = element(object, tags::PIXEL_DATA).ok_or("has no PixelData")?;
    let words = match element.value() {
        Value::Primitive(PrimitiveValue::U16(words)) => words.to_vec(),
        Value::Primitive(PrimitiveValue::U8(bytes)) => {
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
        }
        _ => return Err("PixelData is compressed; decompress it first, as with `gdcmconv --raw`".into()),
    };
    if words.len() != count {
        return Err(format!(
            "PixelData holds {} pixels ({:?} bytes), not the {count} of its rows and columns",
            words.len(),
            element.length().get()
        ));
    }
    Ok(words)
}

fn element(object: &DefaultDicomObject, tag: Tag) -> Option<&InMemElement> {
    object.element_opt(tag).ok().flatten()
}

fn text(object: &DefaultDicomObject, tag: Tag, name: &str) -> Parsed<String> {
    let element = element(object, tag).ok_or_else(|| format!("has no {name}"))?;
    let text = element.to_str().map_err(|error| format!("{name}: {}", chain(&error)))?;
    Ok(text.trim_matches(|c: char| c.is_whitespace() || c == '\0').chars().take(100).collect())
}

fn number(object: &DefaultDicomObject, tag: Tag) -> Parsed<f64> {
    let element = element(object, tag).ok_or("is absent")?;
    let number = element.to_float64().map_err(|error| format!("is no number: {}", chain(&error)))?;
    if number.is_finite() { Ok(number) } else { Err(format!("is {number}")) }
}

fn numbers<const N: usize>(object: &DefaultDicomObject, tag: Tag, name: &str) -> Parsed<[f64; N]> {
    let element = element(object, tag).ok_or_else(|| format!("has no {name}"))?;
    let all = element.to_multi_float64().map_err(|error| format!("{name}: {}", chain(&error)))?;
    let all: [f64; N] =
        all.try_into().map_err(|all: Vec<f64>| format!("{name} has {} numbers, not {N}", all.len()))?;
    if all.iter().all(|x| x.is_finite()) { Ok(all) } else { Err(format!("{name} is not finite")) }
}

/// An error with its causes, on one line.
fn chain(error: &dyn std::error::Error) -> String {
    let mut reported = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        reported = format!("{reported}: {error}");
        source = error.source();
    }
    reported.chars().map(|c| if c.is_control() { ' ' } else { c }).take(300).collect()
}

/// Whether spacings are equal up to rounding.
fn alike(a: [f64; 2], b: [f64; 2]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SPACING * b.abs())
}

/// Positions of missing slices in an otherwise equally spaced series, along the normal, mm; `None` for an irregular
/// one. `at`: positions along the normal, in order.
fn missing(at: &[f64]) -> Option<Vec<f64>> {
    let apart: Vec<f64> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = apart.len().checked_sub(1)? / 2;
    let step = *apart.clone().select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut missing = Vec::new();
    for (before, apart) in at.iter().zip(&apart) {
        let steps = (*apart / step).round();
        if !(1.0..=MOST_MISSING).contains(&steps) || (*apart - steps * step).abs() > UNEVEN * step {
            return None;
        }
        missing.extend((1..steps as u32).map(|k| before + f64::from(k) * step));
    }
    Some(missing)
}

/// One volume of slices.
fn joined(mut slices: Vec<Slice>) -> Parsed<Scan> {
    let name = |slice: &Slice| {
        slice.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    };
    if slices.len() < 2 {
        return Err(format!(
            "holds {} slices of a CT series (files that begin as DICOM files do); at least 2 are needed",
            slices.len()
        ));
    }
    for other in &slices[1..] {
        let first = &slices[0];
        let turned = (0..2).any(|k| (other.directions[k] - first.directions[k]).norm() > DIRECTION);
        let differs = match () {
            () if other.series != first.series => "are of two series (SeriesInstanceUID)",
            () if other.size != first.size => "have other rows or columns",
            () if !alike(other.spacing_mm, first.spacing_mm) => "have another PixelSpacing",
            () if turned => "have another ImageOrientationPatient, as a scout has",
            () => continue,
        };
        return Err(format!(
            "{} and {} {differs}: leave the slices of one volume in the folder",
            name(first),
            name(other)
        ));
    }
    let [along_rows, along_columns] = slices[0].directions;
    let normal = along_rows.cross(&along_columns);
    slices.sort_by(|a, b| a.position_mm.dot(&normal).total_cmp(&b.position_mm.dot(&normal)));
    let count = slices.len();
    let origin_mm = slices[0].position_mm;
    let step = (slices[count - 1].position_mm - origin_mm) / (count - 1) as f64;
    let apart = |pair: &[Slice]| (pair[1].position_mm - pair[0].position_mm).dot(&normal);
    for pair in slices.windows(2) {
        if apart(pair) < UNEVEN * step.norm() || apart(pair) == 0.0 {
            return Err(format!(
                "{} and {} are of one place: leave one of them in the folder",
                name(&pair[0]),
                name(&pair[1])
            ));
        }
    }
    for (k, slice) in slices.iter().enumerate() {
        let off = (slice.position_mm - origin_mm - step * k as f64).norm();
        if off > UNEVEN * step.norm() {
            let distances = slices.windows(2).map(apart);
            let (least, most) = distances.fold((f64::MAX, 0.0_f64), |(l, m), d| (l.min(d), m.max(d)));
            let at: Vec<f64> = slices.iter().map(|slice| slice.position_mm.dot(&normal)).collect();
            if let Some(missing) = missing(&at).filter(|missing| !missing.is_empty()) {
                let gaps: Vec<String> = missing
                    .iter()
                    .take(NAMED)
                    .map(|mm| {
                        let behind = at.partition_point(|at| at < mm);
                        format!(
                            "{mm:.2} mm (between {} and {})",
                            name(&slices[behind - 1]),
                            name(&slices[behind])
                        )
                    })
                    .collect();
                let more = if missing.len() > NAMED { ", …" } else { "" };
                return Err(format!(
                    "{} of {} slices are missing, which are {least:.3} mm apart: along their normal at {}{more}; add them, or resample the series, as to NIfTI",
                    missing.len(),
                    count + missing.len(),
                    gaps.join(", ")
                ));
            }
            return Err(format!(
                "{} is {off:.3} mm off its place in an even row of {count} slices, which are {least:.3} to {most:.3} mm apart; resample the series, as to NIfTI",
                name(slice)
            ));
        }
    }
    let [dx, dy] = slices[0].spacing_mm;
    let axes = Matrix3::from_columns(&[along_rows * dx, along_columns * dy, step]);
    let size = [slices[0].size[0], slices[0].size[1], count];
    Ok(Scan { size, axes, origin_mm, hu: slices.into_iter().flat_map(|slice| slice.hu).collect() })
}
