//! X-ray angiographic images as DICOM: one multi-frame file with the geometry of the C-arm.
//!
//! The object follows the XA Image IOD (DICOM PS3.3, A.14), explicit VR little endian. Identifiers are made from the content, so
//! the same frames give the same file; a simulation has no date of study.

use std::path::Path;

use dicom_core::{DataElement, PrimitiveValue, Tag, VR, smallvec::SmallVec};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use endowire_core::{Error, Result};

use super::{Image, PixelFormat};
use crate::c_arm::CArm;

/// What a file of angiographic frames tells beside the pixels.
#[derive(Debug, Clone)]
pub struct Angiogram<'a> {
    /// The geometry all frames share.
    pub c_arm: &'a CArm,
    /// Peak voltage of the tube.
    pub kvp: f64,
    /// Frames a second.
    pub frames_per_s: f64,
    /// What the series is called.
    pub description: &'a str,
}

impl Angiogram<'_> {
    /// Writes grey frames of one size and depth.
    ///
    /// # Errors
    /// [`Error::Parameter`] without frames or for frames that differ, [`Error::File`] where the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, frames: &[Image]) -> Result<()> {
        let path = path.as_ref();
        let first =
            frames.first().ok_or_else(|| Error::parameter("frames", 0, "a file needs at least one"))?;
        let shape = |i: &Image| (i.width(), i.height(), i.format());
        if first.format() == PixelFormat::Rgba8 || frames.iter().any(|f| shape(f) != shape(first)) {
            return Err(Error::parameter(
                "frames",
                format!("{:?}", shape(first)),
                "must all be grey and alike",
            ));
        }
        let object = self.object(frames, first);
        let failed =
            |error: &dyn std::fmt::Display| Error::file(path, std::io::Error::other(error.to_string()));
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
            .media_storage_sop_class_uid(uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
        let file = object.with_meta(meta).map_err(|e| failed(&e))?;
        file.write_to_file(path).map_err(|e| failed(&e))
    }

    fn object(&self, frames: &[Image], first: &Image) -> InMemDicomObject {
        let sixteen = first.format() == PixelFormat::Gray16;
        let bits: u16 = if sixteen { 16 } else { 8 };
        let content = frames.iter().flat_map(|f| f.data().iter().copied());
        let hash = fingerprint(content.chain(self.description.bytes()));
        let uid = |salt: u128| format!("2.25.{}", hash.wrapping_add(salt));
        let mut object = InMemDicomObject::new_empty();
        let mut text = |tag: Tag, vr: VR, value: &str| {
            object.put(DataElement::new(tag, vr, PrimitiveValue::from(value)));
        };
        text(tags::SOP_CLASS_UID, VR::UI, uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
        for (tag, salt) in
            [(tags::SOP_INSTANCE_UID, 0), (tags::SERIES_INSTANCE_UID, 1), (tags::STUDY_INSTANCE_UID, 2)]
        {
            text(tag, VR::UI, &uid(salt));
        }
        for (tag, vr, value) in [
            (tags::IMAGE_TYPE, VR::CS, "ORIGINAL\\PRIMARY\\SINGLE PLANE"),
            (tags::MODALITY, VR::CS, "XA"),
            (tags::MANUFACTURER, VR::LO, "endowire (simulation)"),
            (tags::SERIES_DESCRIPTION, VR::LO, self.description),
            (tags::PATIENT_NAME, VR::PN, "SIMULATION^ENDOWIRE"),
            (tags::PATIENT_ID, VR::LO, "SIMULATION"),
            (tags::PATIENT_BIRTH_DATE, VR::DA, ""),
            (tags::PATIENT_SEX, VR::CS, ""),
            (tags::PATIENT_POSITION, VR::CS, "HFS"),
            (tags::STUDY_DATE, VR::DA, ""),
            (tags::STUDY_TIME, VR::TM, ""),
            (tags::STUDY_ID, VR::SH, ""),
            (tags::ACCESSION_NUMBER, VR::SH, ""),
            (tags::REFERRING_PHYSICIAN_NAME, VR::PN, ""),
            (tags::RADIATION_SETTING, VR::CS, "GR"),
            (tags::POSITIONER_MOTION, VR::CS, "STATIC"),
            (tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2"),
            (tags::PIXEL_INTENSITY_RELATIONSHIP, VR::CS, "LOG"),
            (tags::LOSSY_IMAGE_COMPRESSION, VR::CS, "00"),
            (tags::SERIES_NUMBER, VR::IS, "1"),
            (tags::INSTANCE_NUMBER, VR::IS, "1"),
        ] {
            text(tag, vr, value);
        }
        let [primary, secondary] = self.c_arm.angles_deg();
        let pitch = decimal(self.c_arm.pixel_mm());
        for (tag, value) in [
            (tags::KVP, decimal(self.kvp)),
            (tags::DISTANCE_SOURCE_TO_DETECTOR, decimal(self.c_arm.sid_mm())),
            (tags::DISTANCE_SOURCE_TO_PATIENT, decimal(self.c_arm.sod_mm())),
            (
                tags::ESTIMATED_RADIOGRAPHIC_MAGNIFICATION_FACTOR,
                decimal(self.c_arm.sid_mm() / self.c_arm.sod_mm()),
            ),
            (tags::POSITIONER_PRIMARY_ANGLE, decimal(primary)),
            (tags::POSITIONER_SECONDARY_ANGLE, decimal(secondary)),
            (tags::IMAGER_PIXEL_SPACING, format!("{pitch}\\{pitch}")),
            (tags::FRAME_TIME, decimal(1000.0 / self.frames_per_s)),
            (tags::WINDOW_CENTER, decimal(f64::from(1_u32 << (bits - 1)))),
            (tags::WINDOW_WIDTH, decimal(f64::from(1_u32 << bits))),
        ] {
            text(tag, VR::DS, &value);
        }
        let rate = self.frames_per_s.round().max(1.0).to_string();
        text(tags::NUMBER_OF_FRAMES, VR::IS, &frames.len().to_string());
        text(tags::CINE_RATE, VR::IS, &rate);
        text(tags::RECOMMENDED_DISPLAY_FRAME_RATE, VR::IS, &rate);
        if let Some(opening) = self.c_arm.opening_px() {
            let size = [first.width(), first.height()].map(f64::from);
            let edge = |k: usize, sign: f64| {
                (size[k] / 2.0 + sign * opening[k] / 2.0).clamp(0.0, size[k]).round().to_string()
            };
            text(tags::COLLIMATOR_SHAPE, VR::CS, "RECTANGULAR");
            text(tags::COLLIMATOR_LEFT_VERTICAL_EDGE, VR::IS, &edge(0, -1.0));
            text(tags::COLLIMATOR_RIGHT_VERTICAL_EDGE, VR::IS, &edge(0, 1.0));
            text(tags::COLLIMATOR_UPPER_HORIZONTAL_EDGE, VR::IS, &edge(1, -1.0));
            text(tags::COLLIMATOR_LOWER_HORIZONTAL_EDGE, VR::IS, &edge(1, 1.0));
        }
        let mut number = |tag: Tag, value: u16| {
            object.put(DataElement::new(tag, VR::US, PrimitiveValue::from(value)));
        };
        for (tag, value) in [
            (tags::SAMPLES_PER_PIXEL, 1),
            (tags::ROWS, first.height() as u16),
            (tags::COLUMNS, first.width() as u16),
            (tags::BITS_ALLOCATED, bits),
            (tags::BITS_STORED, bits),
            (tags::HIGH_BIT, bits - 1),
            (tags::PIXEL_REPRESENTATION, 0),
        ] {
            number(tag, value);
        }
        let pointer = PrimitiveValue::Tags(SmallVec::from_slice(&[tags::FRAME_TIME]));
        object.put(DataElement::new(tags::FRAME_INCREMENT_POINTER, VR::AT, pointer));
        let pixels = if sixteen {
            let words = frames.iter().flat_map(|f| f.data().chunks_exact(2));
            let words = words.map(|b| u16::from_be_bytes([b[0], b[1]])).collect::<Vec<_>>();
            DataElement::new(tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(words.into()))
        } else {
            let mut bytes: Vec<u8> = frames.iter().flat_map(|f| f.data().iter().copied()).collect();
            // Values have an even number of bytes.
            if !bytes.len().is_multiple_of(2) {
                bytes.push(0);
            }
            DataElement::new(tags::PIXEL_DATA, VR::OB, PrimitiveValue::U8(bytes.into()))
        };
        object.put(pixels);
        object
    }
}

/// A decimal string of at most 16 characters.
fn decimal(value: f64) -> String {
    let whole = format!("{value}");
    if whole.len() <= 16 { whole } else { format!("{value:.9e}") }
}

/// 128-bit FNV-1a.
fn fingerprint(bytes: impl Iterator<Item = u8>) -> u128 {
    bytes.fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |hash, byte| {
        (hash ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
    })
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;
    use endowire_core::vessel::SurfaceMesh;

    use super::*;
    use crate::spec::CArmSpec;

    #[test]
    fn geometry_and_pixels_read_back() {
        let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
        let spec = CArmSpec {
            primary_deg: -30.0,
            secondary_deg: 20.0,
            pixel_mm: Some(0.3),
            collimation_mm: Some([0.6, 5.0]),
            ..CArmSpec::default()
        };
        let c_arm = CArm::new(&spec, [4, 2], &wall).unwrap();
        let frame = |k: u8| Image::new(4, 2, PixelFormat::Gray16, (0..16).map(|i| 16 * k + i).collect());
        let frames = [frame(1), frame(2), frame(3)];
        let angiogram = Angiogram { c_arm: &c_arm, kvp: 80.0, frames_per_s: 12.5, description: "test" };
        let path = std::env::temp_dir().join(format!("endowire-{}.dcm", std::process::id()));
        angiogram.write(&path, &frames).unwrap();
        let read = dicom_object::open_file(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let float = |tag| read.element(tag).unwrap().to_float64().unwrap();
        assert_eq!(float(tags::POSITIONER_PRIMARY_ANGLE), -30.0);
        assert_eq!(float(tags::POSITIONER_SECONDARY_ANGLE), 20.0);
        assert_eq!(float(tags::DISTANCE_SOURCE_TO_DETECTOR), 1100.0);
        assert_eq!(float(tags::DISTANCE_SOURCE_TO_PATIENT), 750.0);
        assert_eq!(float(tags::FRAME_TIME), 80.0);
        assert_eq!(read.element(tags::IMAGER_PIXEL_SPACING).unwrap().to_multi_float64().unwrap(), [0.3, 0.3]);
        assert_eq!(float(tags::NUMBER_OF_FRAMES), 3.0);
        assert_eq!(float(tags::COLLIMATOR_LEFT_VERTICAL_EDGE), 1.0);
        let pixels = read.element(tags::PIXEL_DATA).unwrap().to_multi_int::<u16>().unwrap();
        assert_eq!(pixels.len(), 24);
        assert_eq!(pixels[9], u16::from_be_bytes([34, 35]));
        assert!(angiogram.write(&path, &[]).is_err());
    }
}
