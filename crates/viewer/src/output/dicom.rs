//! X-ray angiographic images as DICOM: one multi-frame file per plane, with the geometry of the C-arm.
//!
//! The object follows the XA Image IOD (DICOM PS3.3, A.14), explicit VR little endian. Frames are as displayed, so
//! their intensities have no physical meaning (`DISP`), and there is no modality LUT; subtracted ones are derived. A
//! subtraction with its mask is stored as systems store it: the mask first, then the frames as they were read (`LOG`, with the LUT to intensities),
//! and the Mask Subtraction Sequence says which to subtract from which.
//! Identifiers are hashes of pixels and geometry, so equal frames give equal files and different ones different
//! identifiers; a simulation has no study date.

use std::io::{BufWriter, Write as _};
use std::path::Path;

use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, PrimitiveValue, Tag, VR, smallvec::SmallVec};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use endowire_core::file::whole::Part;
use endowire_core::{Error, Result};

use super::{Image, Pace, PixelFormat};
use crate::c_arm::CArm;
use crate::fingerprint::fingerprint;
use crate::fluoro::UNSUBTRACTED_LN;
use crate::spec::{Mode, reference_mm};
use crate::xray::{Exposure, Pulse};

/// Metadata of a file of angiographic frames.
#[derive(Debug, Clone)]
pub struct Angiogram<'a> {
    /// The geometry of all frames, or of the first if the C-arm turns.
    pub c_arm: &'a CArm,
    /// Rotation towards LAO from one frame to the next.
    pub turn_deg: f64,
    /// The exposure of the frames, or of the first if the C-arm turns.
    pub exposure: Exposure,
    /// The times of the frames.
    pub pace: Pace,
    /// The display mode.
    pub mode: Mode,
    /// The mask of frames that are not subtracted, both of [`crate::Renderer::unsubtracted`]; `None`: frames are as
    /// displayed.
    pub mask: Option<&'a Image>,
    /// Whether contrast medium is injected.
    pub contrast: bool,
    /// Name of the series.
    pub description: &'a str,
}

/// The plane of a pair in a file, with the hash of the other's content.
#[derive(Debug, Clone, Copy)]
enum Plane {
    Single,
    A(u128),
    B(u128),
}

impl Angiogram<'_> {
    /// Writes grey frames of one size and depth.
    ///
    /// # Errors
    /// [`Error::Parameter`] without frames or for frames that differ, [`Error::File`] where the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, frames: &[Image]) -> Result<()> {
        self.write_plane(path.as_ref(), frames, Plane::Single)
    }

    /// Writes the two planes of a biplane system, each into its own file; they refer to each other.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_biplane(planes: [&Self; 2], paths: [&Path; 2], frames: [&[Image]; 2]) -> Result<()> {
        let [a, b] = [0, 1].map(|k| planes[k].content(frames[k]));
        planes[0].write_plane(paths[0], frames[0], Plane::A(b))?;
        planes[1].write_plane(paths[1], frames[1], Plane::B(a))
    }

    fn write_plane(&self, path: &Path, frames: &[Image], plane: Plane) -> Result<()> {
        let first =
            frames.first().ok_or_else(|| Error::parameter("frames", 0, "a file needs at least one"))?;
        let shape = |i: &Image| (i.width(), i.height(), i.format());
        if first.format() == PixelFormat::Rgba8
            || self.mask.iter().copied().chain(frames).any(|f| shape(f) != shape(first))
        {
            return Err(Error::parameter(
                "frames",
                format!("{:?}", shape(first)),
                "must all be grey and alike",
            ));
        }
        let object = self.object(frames, first, plane);
        let failed =
            |error: &dyn std::fmt::Display| Error::file(path, std::io::Error::other(error.to_string()));
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
            .media_storage_sop_class_uid(uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
        let file = object.with_meta(meta).map_err(|e| failed(&e))?;
        let in_file = |error| Error::file(path, error);
        let mut part = Part::new(path).map_err(in_file)?;
        let mut bytes = BufWriter::new(part.file());
        file.write_all(&mut bytes).map_err(|e| failed(&e))?;
        bytes.flush().map_err(in_file)?;
        drop(bytes);
        part.finish().map_err(in_file)
    }

    /// A hash of pixels, geometry and other data.
    fn content(&self, frames: &[Image]) -> u128 {
        let opening = self.c_arm.opening_px().into_iter().flatten();
        let [current_ma, pulse_ms] = self.exposure.pulse.map_or([0.0; 2], |p| [p.current_ma, p.pulse_ms]);
        let numbers = opening
            .chain([self.exposure.kvp, current_ma, pulse_ms, self.pace.mean_s(), self.turn_deg])
            .chain(self.pace.intervals_s().iter().copied())
            .flat_map(f64::to_le_bytes);
        let size = frames.first().map_or([0; 2], |f| [f.width(), f.height()]);
        let frames = || self.mask.into_iter().chain(frames);
        let reported = numbers
            .chain(self.c_arm.fingerprint().to_le_bytes())
            .chain(size.into_iter().flat_map(u32::to_le_bytes))
            .chain([self.mode as u8, u8::from(self.contrast)])
            .chain(self.description.bytes());
        fingerprint(frames().flat_map(|f| f.data().iter().copied()).chain(reported))
    }

    fn object(&self, frames: &[Image], first: &Image, plane: Plane) -> InMemDicomObject {
        let own = self.content(frames);
        let mut object = InMemDicomObject::new_empty();
        identify(&mut object, own, plane);
        let all: Vec<&Image> = self.mask.into_iter().chain(frames).collect();
        self.describe(&mut object, plane, all.len());
        self.place(&mut object, first, all.len());
        self.time(&mut object, all.len());
        pixels(&mut object, &all, self.mask);
        object
    }

    /// Patient, study, series, equipment, image, contrast medium.
    fn describe(&self, object: &mut InMemDicomObject, plane: Plane, frames: usize) {
        let is_subtracted = self.mode == Mode::Dsa && self.mask.is_none();
        let origin = if is_subtracted { "DERIVED" } else { "ORIGINAL" };
        let (planes, number) = match plane {
            Plane::Single => ("SINGLE PLANE", "1"),
            Plane::A(_) => ("BIPLANE A", "1"),
            Plane::B(_) => ("BIPLANE B", "2"),
        };
        for (tag, vr, value) in [
            (tags::IMAGE_TYPE, VR::CS, format!("{origin}\\PRIMARY\\{planes}").as_str()),
            (tags::MODALITY, VR::CS, "XA"),
            (tags::MANUFACTURER, VR::LO, "endowire (simulation)"),
            (tags::SERIES_DESCRIPTION, VR::LO, self.description),
            (tags::PATIENT_NAME, VR::PN, "SIMULATION^ENDOWIRE"),
            (tags::PATIENT_ID, VR::LO, "SIMULATION"),
            (tags::PATIENT_BIRTH_DATE, VR::DA, ""),
            (tags::PATIENT_SEX, VR::CS, ""),
            (tags::STUDY_DATE, VR::DA, ""),
            (tags::STUDY_TIME, VR::TM, ""),
            (tags::STUDY_ID, VR::SH, ""),
            (tags::ACCESSION_NUMBER, VR::SH, ""),
            (tags::REFERRING_PHYSICIAN_NAME, VR::PN, ""),
            (tags::LATERALITY, VR::CS, ""),
            (tags::CONTENT_DATE, VR::DA, ""),
            (tags::CONTENT_TIME, VR::TM, ""),
            (tags::SERIES_NUMBER, VR::IS, "1"),
            (tags::INSTANCE_NUMBER, VR::IS, number),
            (tags::LOSSY_IMAGE_COMPRESSION, VR::CS, "00"),
            (tags::BURNED_IN_ANNOTATION, VR::CS, "NO"),
        ] {
            put(object, tag, vr, value);
        }
        if self.mask.is_some() {
            let mut mask = InMemDicomObject::new_empty();
            put(&mut mask, tags::MASK_OPERATION, VR::CS, "AVG_SUB");
            let last = u16::try_from(frames).unwrap_or(u16::MAX);
            for (tag, numbers) in [
                (tags::APPLICABLE_FRAME_RANGE, SmallVec::from_slice(&[2, last])),
                (tags::MASK_FRAME_NUMBERS, SmallVec::from_slice(&[1])),
            ] {
                mask.put(DataElement::new(tag, VR::US, PrimitiveValue::U16(numbers)));
            }
            sequence(object, tags::MASK_SUBTRACTION_SEQUENCE, mask);
            put(object, tags::RECOMMENDED_VIEWING_MODE, VR::CS, "SUB");
        } else if is_subtracted {
            put(object, tags::DERIVATION_DESCRIPTION, VR::ST, "ln(mask) - ln(frame)");
            let mut mask = InMemDicomObject::new_empty();
            put(&mut mask, tags::MASK_OPERATION, VR::CS, "NONE");
            put(
                &mut mask,
                tags::MASK_OPERATION_EXPLANATION,
                VR::ST,
                "The mask is subtracted from the stored frames.",
            );
            sequence(object, tags::MASK_SUBTRACTION_SEQUENCE, mask);
            put(object, tags::RECOMMENDED_VIEWING_MODE, VR::CS, "NAT");
        }
        if self.contrast {
            put(object, tags::CONTRAST_BOLUS_AGENT, VR::LO, "Iodine, 370 mg/ml");
        }
    }

    /// Tube, positioner, blades and detector.
    fn place(&self, object: &mut InMemDicomObject, first: &Image, frames: usize) {
        let [primary, secondary] = self.c_arm.angles_deg();
        let pitch = decimal(self.c_arm.pixel_mm());
        for (tag, value) in [
            (tags::KVP, decimal(self.exposure.kvp)),
            (tags::DISTANCE_SOURCE_TO_DETECTOR, decimal(self.c_arm.sid_mm())),
            (tags::DISTANCE_SOURCE_TO_PATIENT, decimal(self.c_arm.sod_mm())),
            (
                tags::ESTIMATED_RADIOGRAPHIC_MAGNIFICATION_FACTOR,
                decimal(self.c_arm.sid_mm() / self.c_arm.sod_mm()),
            ),
            (tags::POSITIONER_PRIMARY_ANGLE, decimal(primary)),
            (tags::POSITIONER_SECONDARY_ANGLE, decimal(secondary)),
            (tags::IMAGER_PIXEL_SPACING, format!("{pitch}\\{pitch}")),
        ] {
            put(object, tag, VR::DS, &value);
        }
        if self.turn_deg != 0.0 {
            // One value: the same between all frames.
            put(object, tags::POSITIONER_PRIMARY_ANGLE_INCREMENT, VR::DS, &decimal(self.turn_deg));
            put(object, tags::POSITIONER_SECONDARY_ANGLE_INCREMENT, VR::DS, "0");
        }
        let [columns, rows] = self.c_arm.directions();
        let turn = self.c_arm.rotation_deg();
        let pulse = self.exposure.pulse;
        let whole = |of: fn(&Pulse) -> f64| pulse.map_or_else(String::new, |p| of(&p).round().to_string());
        if let Some(Pulse { current_ma, pulse_ms }) = pulse {
            for (tag, value) in [
                (tags::X_RAY_TUBE_CURRENT_INU_A, current_ma * 1000.0),
                (tags::EXPOSURE_TIME_INU_S, pulse_ms * 1000.0),
                (tags::AVERAGE_PULSE_WIDTH, pulse_ms),
            ] {
                put(object, tag, VR::DS, &decimal(value));
            }
            let in_u_as = (current_ma * pulse_ms).round().to_string();
            put(object, tags::EXPOSURE_INU_AS, VR::IS, &in_u_as);
        }
        for (tag, vr, value) in [
            (tags::PATIENT_POSITION, VR::CS, "HFS"),
            (tags::PATIENT_ORIENTATION, VR::CS, &format!("{columns}\\{rows}")),
            (tags::RADIATION_SETTING, VR::CS, if self.mode == Mode::Fluoro { "SC" } else { "GR" }),
            (tags::X_RAY_TUBE_CURRENT, VR::IS, &whole(|p| p.current_ma)),
            (tags::EXPOSURE_TIME, VR::IS, &whole(|p| p.pulse_ms)),
            (tags::EXPOSURE, VR::IS, &whole(|p| p.current_ma * p.pulse_ms / 1000.0)),
            (tags::POSITIONER_MOTION, VR::CS, if self.turn_deg == 0.0 { "STATIC" } else { "DYNAMIC" }),
            (tags::FIELD_OF_VIEW_SHAPE, VR::CS, "RECTANGLE"),
        ] {
            put(object, tag, vr, value);
        }
        if turn % 90.0 == 0.0 {
            put(object, tags::FIELD_OF_VIEW_ROTATION, VR::DS, &decimal(turn.rem_euclid(360.0)));
        }
        put(
            object,
            tags::IMAGE_AND_FLUOROSCOPY_AREA_DOSE_PRODUCT,
            VR::DS,
            &decimal(self.area_dose_dgycm2(frames)),
        );
        let Some(opening) = self.c_arm.opening_px() else { return };
        let corners = self.c_arm.corners_px();
        if corners > 0.0 {
            put(object, tags::COLLIMATOR_SHAPE, VR::CS, "POLYGONAL");
            let middle = [first.width(), first.height()].map(|n| f64::from(n) / 2.0);
            let [w, h] = opening.map(|n| n / 2.0);
            let [u, v] = [w - corners, h - corners];
            let vertices = [[-u, -h], [u, -h], [w, -v], [w, v], [u, h], [-u, h], [-w, v], [-w, -v]];
            let at = |[x, y]: [f64; 2]| {
                [middle[1] + y, middle[0] + x].map(|n| (n.round() + 1.0).max(1.0).to_string()).join("\\")
            };
            let vertices = vertices.map(at).join("\\");
            put(object, tags::VERTICES_OF_THE_POLYGONAL_COLLIMATOR, VR::IS, &vertices);
            return;
        }
        let size = [first.width(), first.height()].map(f64::from);
        let edge = |k: usize, sign: f64| {
            (size[k] / 2.0 + sign * opening[k] / 2.0).clamp(0.0, size[k]).round().to_string()
        };
        put(object, tags::COLLIMATOR_SHAPE, VR::CS, "RECTANGULAR");
        for (tag, value) in [
            (tags::COLLIMATOR_LEFT_VERTICAL_EDGE, edge(0, -1.0)),
            (tags::COLLIMATOR_RIGHT_VERTICAL_EDGE, edge(0, 1.0)),
            (tags::COLLIMATOR_UPPER_HORIZONTAL_EDGE, edge(1, -1.0)),
            (tags::COLLIMATOR_LOWER_HORIZONTAL_EDGE, edge(1, 1.0)),
        ] {
            put(object, tag, VR::IS, &value);
        }
    }

    /// Kerma–area product of so many frames, dGy·cm²: air kerma at the entrance reference point times the area there
    /// that the blades leave open.
    fn area_dose_dgycm2(&self, frames: usize) -> f64 {
        let size_px = self.c_arm.size_px().map(f64::from);
        let open_px = self.c_arm.opening_px().map_or(size_px, |open| [0, 1].map(|k| open[k].min(size_px[k])));
        let nearer = reference_mm(self.c_arm.sod_mm()) / self.c_arm.sid_mm();
        let sides_cm = open_px.map(|n| n * self.c_arm.pixel_mm() * nearer / 10.0);
        let corners_cm = self.c_arm.corners_px() * self.c_arm.pixel_mm() * nearer / 10.0;
        let area_cm2 = sides_cm[0] * sides_cm[1] - 2.0 * corners_cm * corners_cm;
        // 1 dGy = 10⁸ nGy.
        frames as f64 * self.exposure.entrance_ngy * 1e-8 * area_cm2
    }

    /// Cine and multi-frame.
    fn time(&self, object: &mut InMemDicomObject, frames: usize) {
        put(object, tags::NUMBER_OF_FRAMES, VR::IS, &frames.to_string());
        // Whole numbers: rates below one per second cannot be represented.
        let rate = 1.0 / self.pace.mean_s();
        if rate >= 1.0 {
            let rate = rate.round().to_string();
            put(object, tags::CINE_RATE, VR::IS, &rate);
            put(object, tags::RECOMMENDED_DISPLAY_FRAME_RATE, VR::IS, &rate);
        }
        let time = match increments(self.mask.map(|_| self.pace.mean_s()), self.pace.intervals_s()) {
            Some(increments) => {
                put(object, tags::FRAME_TIME_VECTOR, VR::DS, &increments);
                tags::FRAME_TIME_VECTOR
            }
            None => {
                put(object, tags::FRAME_TIME, VR::DS, &decimal(1000.0 * self.pace.mean_s()));
                tags::FRAME_TIME
            }
        };
        let pointer = PrimitiveValue::Tags(SmallVec::from_slice(&[time]));
        object.put(DataElement::new(tags::FRAME_INCREMENT_POINTER, VR::AT, pointer));
    }
}

/// Identifiers, and the reference to the other plane.
fn identify(object: &mut InMemDicomObject, own: u128, plane: Plane) {
    // What both planes of a pair share.
    let common = match plane {
        Plane::Single => own,
        Plane::A(other) | Plane::B(other) => own ^ other,
    };
    put(object, tags::SOP_CLASS_UID, VR::UI, uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
    put(object, tags::SOP_INSTANCE_UID, VR::UI, &uid(own));
    put(object, tags::SERIES_INSTANCE_UID, VR::UI, &uid(common.wrapping_add(1)));
    put(object, tags::STUDY_INSTANCE_UID, VR::UI, &uid(common.wrapping_add(2)));
    if let Plane::A(other) | Plane::B(other) = plane {
        let mut purpose = InMemDicomObject::new_empty();
        put(&mut purpose, tags::CODE_VALUE, VR::SH, "121314");
        put(&mut purpose, tags::CODING_SCHEME_DESIGNATOR, VR::SH, "DCM");
        put(&mut purpose, tags::CODE_MEANING, VR::LO, "Other image of biplane pair");
        let mut reference = InMemDicomObject::new_empty();
        put(&mut reference, tags::REFERENCED_SOP_CLASS_UID, VR::UI, uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
        put(&mut reference, tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, &uid(other));
        sequence(&mut reference, tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, purpose);
        sequence(object, tags::REFERENCED_IMAGE_SEQUENCE, reference);
    }
}

/// Pixels, and the window that displays them unchanged, or all that is in a mask.
fn pixels(object: &mut InMemDicomObject, frames: &[&Image], mask: Option<&Image>) {
    let Some(first) = frames.first() else { return };
    let sixteen = first.format() == PixelFormat::Gray16;
    let bits: u16 = if sixteen { 16 } else { 8 };
    put(object, tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2");
    put(object, tags::PIXEL_INTENSITY_RELATIONSHIP, VR::CS, if mask.is_some() { "LOG" } else { "DISP" });
    let whole = [0.0, f64::from(1_u32 << bits)];
    let [low, high] = mask.map_or(whole, |mask| {
        // What is behind blades is 0.
        let open = words(mask).filter(|word| *word > 0).map(f64::from);
        let [low, high] = open.fold([f64::MAX, 0.0], |[low, high], v| [low.min(v), high.max(v)]);
        if low < high { [low, high] } else { whole }
    });
    if mask.is_some() {
        sequence(object, tags::MODALITY_LUT_SEQUENCE, intensities(high));
    }
    put(object, tags::WINDOW_CENTER, VR::DS, &decimal(f64::midpoint(low, high)));
    put(object, tags::WINDOW_WIDTH, VR::DS, &decimal(high - low));
    for (tag, value) in [
        (tags::SAMPLES_PER_PIXEL, 1),
        (tags::ROWS, first.height() as u16),
        (tags::COLUMNS, first.width() as u16),
        (tags::BITS_ALLOCATED, bits),
        (tags::BITS_STORED, bits),
        (tags::HIGH_BIT, bits - 1),
        (tags::PIXEL_REPRESENTATION, 0),
    ] {
        object.put(DataElement::new(tag, VR::US, PrimitiveValue::from(value)));
    }
    object.put(if sixteen {
        let words = frames.iter().flat_map(|frame| words(frame)).collect::<Vec<_>>();
        DataElement::new(tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(words.into()))
    } else {
        let mut bytes: Vec<u8> = frames.iter().flat_map(|f| f.data().iter().copied()).collect();
        // Values have an even number of bytes.
        if !bytes.len().is_multiple_of(2) {
            bytes.push(0);
        }
        DataElement::new(tags::PIXEL_DATA, VR::OB, PrimitiveValue::U8(bytes.into()))
    });
}

/// The table from logarithms to intensities, relative to the brightest pixel.
fn intensities(brightest: f64) -> InMemDicomObject {
    let of = |k: u32| 65535.0 * libm::exp(UNSUBTRACTED_LN * (f64::from(k) - brightest) / 65535.0);
    let values: Vec<u16> = (0..=65535).map(|k| of(k).min(65535.0).round() as u16).collect();
    let mut table = InMemDicomObject::new_empty();
    // As many entries as there are words, which the first number cannot say, from the word 0 on, of 16 bits.
    let descriptor = PrimitiveValue::U16(SmallVec::from_slice(&[0, 0, 16]));
    table.put(DataElement::new(tags::LUT_DESCRIPTOR, VR::US, descriptor));
    put(&mut table, tags::MODALITY_LUT_TYPE, VR::LO, "US");
    table.put(DataElement::new(tags::LUT_DATA, VR::OW, PrimitiveValue::U16(values.into())));
    table
}

/// Pixels of a frame of 16 bits.
fn words(frame: &Image) -> impl Iterator<Item = u16> {
    frame.data().chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]]))
}

fn put(object: &mut InMemDicomObject, tag: Tag, vr: VR, value: &str) {
    object.put(DataElement::new(tag, vr, PrimitiveValue::from(value)));
}

fn sequence(object: &mut InMemDicomObject, tag: Tag, item: InMemDicomObject) {
    object.put(DataElement::new(tag, VR::SQ, DataSetSequence::from(vec![item])));
}

fn uid(number: u128) -> String {
    format!("2.25.{number}")
}

/// Times of frames after the previous one, ms: 0 for the first, and that of the second after a mask before it. `None` for
/// equally spaced frames, or if there are too many for the element.
fn increments(after_mask_s: Option<f64>, intervals_s: &[f64]) -> Option<String> {
    // To the microsecond.
    let each = after_mask_s.iter().chain(intervals_s).map(|interval| decimal((1e6 * interval).round() / 1e3));
    let all = std::iter::once("0".to_owned()).chain(each).collect::<Vec<_>>().join("\\");
    (!intervals_s.is_empty() && all.len() < usize::from(u16::MAX)).then_some(all)
}

/// A decimal string of at most 16 characters.
fn decimal(value: f64) -> String {
    let whole = format!("{value}");
    if whole.len() <= 16 { whole } else { format!("{value:.9e}") }
}

#[cfg(test)]
#[path = "dicom_tests.rs"]
mod tests;
