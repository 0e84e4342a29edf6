//! One phantom in every format: the same volume, and what each reader rejects.

use std::io::Write;
use std::path::{Path, PathBuf};

use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use endowire_core::Vec3;
use endowire_core::nalgebra::Matrix3;
use endowire_core::vessel::SurfaceMesh;

use super::Volume;
use crate::spec::CtSpec;

const SIZE: [usize; 3] = [5, 4, 3];
const ORIGIN_MM: [f64; 3] = [-20.0, 12.5, 30.0];

/// A coronal stack: rows to the left, columns to the feet, slices to the back. All its numbers are exact in single precision.
fn axes() -> Matrix3<f64> {
    Matrix3::new(0.75, 0.0, 0.0, 0.0, 0.0, 1.25, 0.0, -0.5, 0.0)
}

/// Hounsfield units, no two alike.
fn hu() -> Vec<i16> {
    (0..60).map(|i| 37 * i - 1000).collect()
}

fn wall() -> SurfaceMesh {
    SurfaceMesh { vertices_mm: vec![Vec3::from(ORIGIN_MM)], triangles: vec![] }
}

fn read(file: &Path) -> std::result::Result<Volume, String> {
    Volume::read(&CtSpec { file: file.into(), offset_mm: [0.0; 3] }, &wall()).map_err(|e| e.to_string())
}

/// What two volumes must share, to the bit.
fn reported(volume: &Volume) -> ([usize; 3], Matrix3<f64>, Vec3, &[[f32; 2]]) {
    (volume.size, volume.into, volume.origin_mm, &volume.voxels)
}

/// How a NIfTI file gives the positions of its voxels.
#[derive(Clone, Copy, PartialEq)]
enum Placing {
    Affine,
    Quaternion,
}

/// A NIfTI file of either format and byte order.
fn nifti(second: bool, big: bool, placing: Placing) -> Vec<u8> {
    let [length, begin] = if second { [540, 544] } else { [348, 352] };
    let mut bytes = vec![0; begin];
    let mut put = |at: usize, little: &[u8]| {
        let own = &mut bytes[at..at + little.len()];
        own.copy_from_slice(little);
        if big {
            own.reverse();
        }
    };
    // Whole numbers of the dimensions, and decimal ones, are two and four times as long in the second format.
    let whole = |n: i64| if second { n.to_le_bytes().to_vec() } else { (n as i16).to_le_bytes().to_vec() };
    let code = |n: i32| if second { n.to_le_bytes().to_vec() } else { (n as i16).to_le_bytes().to_vec() };
    let real = |x: f64| if second { x.to_le_bytes().to_vec() } else { (x as f32).to_le_bytes().to_vec() };
    let places = if second {
        [16, 12, 14, 104, 168, 176, 184, 500, 344, 348, 352, 376, 400]
    } else {
        [40, 70, 72, 76, 108, 112, 116, 123, 252, 254, 256, 268, 280]
    };
    let [dim, kind, bits, spacing, offset, slope, inter, units, q_code, s_code, quaternion, q_origin, rows] =
        places;
    put(0, &(length as i32).to_le_bytes());
    for (k, n) in [3, 5, 4, 3, 1, 1, 1, 1].into_iter().enumerate() {
        put(dim + k * whole(n).len(), &whole(n));
    }
    put(kind, &4_i16.to_le_bytes());
    put(bits, &16_i16.to_le_bytes());
    let side = real(0.0).len();
    for (k, x) in [1.0, 0.75, 0.5, 1.25].into_iter().enumerate() {
        put(spacing + k * side, &real(x));
    }
    put(offset, &if second { whole(begin as i64) } else { real(begin as f64) });
    put(slope, &real(2.0));
    put(inter, &real(-1024.0));
    put(units, &if second { 2_i32.to_le_bytes().to_vec() } else { vec![2] });
    put(q_code, &code(i32::from(placing == Placing::Quaternion)));
    put(s_code, &code(i32::from(placing == Placing::Affine)));
    // Right and anterior have the opposite sign. The quaternion is a third of a turn about (1, 1, 1), exact in single
    // precision.
    let sign = [-1.0, -1.0, 1.0];
    (0..3).for_each(|k| put(quaternion + k * side, &real(0.5)));
    for r in 0..3 {
        put(q_origin + r * side, &real(sign[r] * ORIGIN_MM[r]));
        for c in 0..4 {
            let x = if c == 3 { ORIGIN_MM[r] } else { axes()[(r, c)] };
            put(rows + (4 * r + c) * side, &real(sign[r] * x));
        }
    }
    // Slope and intercept define the stored numbers.
    let stored = hu().into_iter().map(|hu| (hu + 1024) / 2);
    let voxels: Vec<u8> = stored.flat_map(|n| if big { n.to_be_bytes() } else { n.to_le_bytes() }).collect();
    bytes[if second { 4..12 } else { 344..348 }].copy_from_slice(if second {
        b"n+2\0\r\n\x1a\n"
    } else {
        b"n+1\0"
    });
    bytes.extend(voxels);
    bytes
}

/// Every number that [`nifti`] can store: even ones.
fn even(volume: &Volume) -> Vec<[f32; 2]> {
    let expected = hu().into_iter().map(|hu| super::materials(f32::from((hu + 1024) / 2 * 2 - 1024)));
    assert_eq!(volume.voxels.len(), 60);
    expected.collect()
}

#[test]
fn both_formats_of_nifti_are_one_volume_in_either_byte_order_bare_or_compressed() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let first = read(&write("first.nii", &nifti(false, false, Placing::Affine))).unwrap();
    assert_eq!((first.size, first.origin_mm), (SIZE, Vec3::from(ORIGIN_MM)));
    assert_eq!(first.into, axes().try_inverse().unwrap());
    assert_eq!(first.voxels, even(&first));
    for (name, second, big) in
        [("big.nii", false, true), ("second.nii", true, false), ("both.nii", true, true)]
    {
        let bytes = nifti(second, big, Placing::Affine);
        assert_eq!(reported(&read(&write(name, &bytes)).unwrap()), reported(&first), "{name}");
        let mut packed = flate2::write::GzEncoder::new(vec![], flate2::Compression::fast());
        packed.write_all(&bytes).unwrap();
        let path = write(&format!("{name}.gz"), &packed.finish().unwrap());
        assert_eq!(reported(&read(&path).unwrap()), reported(&first), "{name}.gz");
    }
    let turned = Matrix3::new(0.0, 0.0, -1.25, -0.75, 0.0, 0.0, 0.0, 0.5, 0.0);
    for second in [false, true] {
        let path = write("turned.nii", &nifti(second, false, Placing::Quaternion));
        let volume = read(&path).unwrap();
        assert_eq!((volume.into, volume.origin_mm), (turned.try_inverse().unwrap(), first.origin_mm));
    }
    // Counter-check: an affine map that is off by the last digit of the second format differs.
    let mut off = nifti(true, false, Placing::Affine);
    off[424] ^= 1;
    assert_ne!(reported(&read(&write("off.nii", &off)).unwrap()), reported(&first));
}

#[test]
fn headers_of_the_second_format_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nii");
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = nifti(true, false, Placing::Affine);
        change(&mut bytes);
        std::fs::write(&path, bytes).unwrap();
        read(&path).unwrap_err()
    };
    for (change, said) in [
        (
            &(|b: &mut Vec<u8>| b[24..32].copy_from_slice(&70_000_i64.to_le_bytes()))
                as &dyn Fn(&mut Vec<u8>),
            "dim[1] = 70000",
        ),
        (&|b| b[24..32].copy_from_slice(&(-5_i64).to_le_bytes()), "dim[1] = -5"),
        (&|b| b[168..176].copy_from_slice(&100_i64.to_le_bytes()), "vox_offset = 100"),
        (&|b| b[14..16].copy_from_slice(&8_i16.to_le_bytes()), "bitpix = 8"),
        (&|b| b[4..8].copy_from_slice(b"ni2\0"), "NIfTI-2 pair"),
        (&|b| b.truncate(600), "is cut off: it holds fewer voxels"),
        (&|b| b[400..408].copy_from_slice(&f64::NAN.to_le_bytes()), "affine is not finite"),
        (
            &|b| (0..3).for_each(|k| b[24 + 8 * k..32 + 8 * k].copy_from_slice(&60_000_i64.to_le_bytes())),
            "at most 268435456",
        ),
        (&|b| b[176..184].copy_from_slice(&1e5_f64.to_le_bytes()), "Hounsfield units are -32768 to 65535"),
        (&|b| b[184..192].copy_from_slice(&24_f64.to_le_bytes()), "none is below 0"),
        (&|b| b[176..184].copy_from_slice(&1e-3_f64.to_le_bytes()), "all is air"),
        (
            &|b| {
                b[176..184].copy_from_slice(&1e-3_f64.to_le_bytes());
                b[184..192].copy_from_slice(&[0; 8]);
            },
            "scaled to one",
        ),
        (&|b| b[424..432].copy_from_slice(&500_f64.to_le_bytes()), "offset_mm"),
    ] {
        let error = refused(change);
        assert!(error.contains(said) && error.contains("a.nii"), "{said}: {error}");
    }
}

type Change<'a> = &'a dyn Fn(usize, &mut InMemDicomObject);

fn put(object: &mut InMemDicomObject, tag: Tag, vr: VR, value: &str) {
    object.put(DataElement::new(tag, vr, PrimitiveValue::from(value)));
}

fn put_word(object: &mut InMemDicomObject, tag: Tag, value: u16) {
    object.put(DataElement::new(tag, VR::US, PrimitiveValue::from(value)));
}

/// The phantom as a series in a new folder, each slice modified by `change`; names are not in the order of positions.
fn series(syntax: &str, change: Change) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..SIZE[2] {
        let mut object = InMemDicomObject::new_empty();
        let at = Vec3::from(ORIGIN_MM) + axes() * Vec3::z() * k as f64;
        for (tag, vr, value) in [
            (tags::SOP_CLASS_UID, VR::UI, uids::CT_IMAGE_STORAGE),
            (tags::SOP_INSTANCE_UID, VR::UI, &format!("2.25.{k}")),
            (tags::SERIES_INSTANCE_UID, VR::UI, "2.25.77"),
            (tags::MODALITY, VR::CS, "CT"),
            (tags::IMAGE_POSITION_PATIENT, VR::DS, &format!("{}\\{}\\{}", at.x, at.y, at.z)),
            (tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0\\0\\-1"),
            // Between rows, then between columns.
            (tags::PIXEL_SPACING, VR::DS, "0.5\\0.75"),
            (tags::RESCALE_SLOPE, VR::DS, "2"),
            (tags::RESCALE_INTERCEPT, VR::DS, "-1024"),
            (tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2"),
        ] {
            put(&mut object, tag, vr, value);
        }
        for (tag, value) in [
            (tags::SAMPLES_PER_PIXEL, 1),
            (tags::ROWS, 4),
            (tags::COLUMNS, 5),
            (tags::BITS_ALLOCATED, 16),
            (tags::BITS_STORED, 12),
            (tags::HIGH_BIT, 11),
            (tags::PIXEL_REPRESENTATION, 0),
        ] {
            put_word(&mut object, tag, value);
        }
        let words: Vec<u16> = hu()[20 * k..20 * k + 20].iter().map(|hu| ((hu + 1024) / 2) as u16).collect();
        object.put(DataElement::new(tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(words.into())));
        change(k, &mut object);
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(syntax)
            .media_storage_sop_class_uid(uids::CT_IMAGE_STORAGE);
        object
            .with_meta(meta)
            .unwrap()
            .write_to_file(folder.path().join(format!("{}.dcm", (k + 2) % 3)))
            .unwrap();
    }
    folder
}

#[test]
fn a_series_of_slices_is_the_volume_that_a_nifti_file_is() {
    let file = tempfile::tempdir().unwrap();
    let path = file.path().join("a.nii");
    std::fs::write(&path, nifti(true, false, Placing::Affine)).unwrap();
    let expected = read(&path).unwrap();
    for syntax in [uids::EXPLICIT_VR_LITTLE_ENDIAN, uids::IMPLICIT_VR_LITTLE_ENDIAN, "1.2.840.10008.1.2.2"] {
        let folder = series(syntax, &|_, _| ());
        std::fs::write(folder.path().join("notes.txt"), "not a slice").unwrap();
        assert_eq!(reported(&read(folder.path()).unwrap()), reported(&expected), "{syntax}");
    }
    // Signed numbers, with other bits above the stored ones.
    let signed = series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &|k, object| {
        let stored = hu().into_iter().skip(20 * k).take(20).map(|hu| (hu + 1024) / 2 - 512);
        let words: Vec<u16> = stored.map(|n| n as u16 & 0x0fff | 0x5000).collect();
        object.put(DataElement::new(tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(words.into())));
        put_word(object, tags::PIXEL_REPRESENTATION, 1);
        put(object, tags::RESCALE_INTERCEPT, VR::DS, "0");
    });
    assert_eq!(reported(&read(signed.path()).unwrap()), reported(&expected));
    // Counter-checks: another intercept, and rows for columns.
    let other =
        series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &|_, o| put(o, tags::RESCALE_INTERCEPT, VR::DS, "-1023"));
    assert_ne!(reported(&read(other.path()).unwrap()), reported(&expected));
    let turned =
        series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &|_, o| put(o, tags::PIXEL_SPACING, VR::DS, "0.75\\0.5"));
    assert_ne!(reported(&read(turned.path()).unwrap()), reported(&expected));
    // Padding becomes air, and a tilted gantry shears.
    let padded = series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &|k, object| {
        put_word(object, tags::PIXEL_PADDING_VALUE, ((hu()[59] + 1024) / 2) as u16);
        put(
            object,
            tags::IMAGE_POSITION_PATIENT,
            VR::DS,
            &format!("-20\\{}\\{}", 12.5 + 1.25 * k as f64, 30.0 - 0.25 * k as f64),
        );
    });
    let padded = read(padded.path()).unwrap();
    assert_eq!((padded.voxels[59], expected.voxels[59][1] > 0.0), ([0.0; 2], true));
    let sheared = padded.into.try_inverse().unwrap() - axes();
    assert!((sheared[(2, 2)] + 0.25).abs() < 1e-12 && (sheared.norm() - 0.25).abs() < 1e-12, "{sheared}");
}

#[test]
fn what_is_not_one_even_series_of_tomograms_is_refused_with_its_file_and_the_remedy() {
    let place = |k: usize, y: f64| {
        move |of: usize, o: &mut InMemDicomObject| {
            if of == k {
                put(o, tags::IMAGE_POSITION_PATIENT, VR::DS, &format!("-20\\{y}\\30"));
            }
        }
    };
    let of_one = |tag: Tag, vr: VR, value: &'static str| {
        move |k: usize, o: &mut InMemDicomObject| {
            if k == 1 {
                put(o, tag, vr, value);
            }
        }
    };
    let none = |tag: Tag| {
        move |_: usize, o: &mut InMemDicomObject| {
            o.remove_element(tag);
        }
    };
    let word = |tag: Tag, value: u16| move |_: usize, o: &mut InMemDicomObject| put_word(o, tag, value);
    let cases: [(Change, &str); 17] = [
        (&place(2, 16.0), "mm off its place"),
        (&place(2, 16.25), "1 of 4 slices are missing"),
        (&place(1, 12.5), "are of one place"),
        (&of_one(tags::SERIES_INSTANCE_UID, VR::UI, "2.25.78"), "two series"),
        (&of_one(tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0\\1\\0"), "as a scout has"),
        (&of_one(tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\1\\0\\0"), "right angles"),
        (&of_one(tags::PIXEL_SPACING, VR::DS, "0.5\\0.8"), "another PixelSpacing"),
        (&of_one(tags::PIXEL_SPACING, VR::DS, "0.5"), "PixelSpacing has 1 numbers"),
        (&of_one(tags::MODALITY, VR::CS, "MR"), "modality \"MR\""),
        (&of_one(tags::NUMBER_OF_FRAMES, VR::IS, "40"), "many frames"),
        (&of_one(tags::RESCALE_TYPE, VR::LO, "US"), "RescaleType"),
        (&none(tags::RESCALE_INTERCEPT), "RescaleIntercept is absent"),
        (&none(tags::IMAGE_POSITION_PATIENT), "no ImagePositionPatient"),
        (&none(tags::PIXEL_DATA), "no PixelData"),
        (&word(tags::ROWS, 3), "not the 15 of its rows and columns"),
        (&word(tags::BITS_ALLOCATED, 8), "BitsAllocated = 8"),
        (&word(tags::HIGH_BIT, 15), "HighBit = 15"),
    ];
    for (change, said) in cases {
        let folder = series(uids::EXPLICIT_VR_LITTLE_ENDIAN, change);
        let error = read(folder.path()).unwrap_err();
        assert!(error.contains(said) && !error.contains('\n'), "{said}: {error}");
    }
    // The gap is described by the slices beside it: names are not in the order of positions.
    let folder = series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &place(2, 17.5));
    let error = read(folder.path()).unwrap_err();
    let named = "2 of 5 slices are missing, which are 1.250 mm apart: along their normal at 15.00 mm (between 0.dcm and 1.dcm), 16.25 mm";
    assert!(error.contains(named), "{error}");
    // Spacings are compared up to rounding.
    let rounded = of_one(tags::PIXEL_SPACING, VR::DS, "0.50000001\\0.74999999");
    assert!(read(series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &rounded).path()).is_ok());
    let packed = series("1.2.840.10008.1.2.4.70", &|_, _| ());
    let error = read(packed.path()).unwrap_err();
    assert!(error.contains("compressed") && error.contains("1.2.840.10008.1.2.4.70"), "{error}");
    let one = series(uids::EXPLICIT_VR_LITTLE_ENDIAN, &|_, _| ());
    (0..2).for_each(|k| std::fs::remove_file(one.path().join(format!("{k}.dcm"))).unwrap());
    assert!(read(one.path()).unwrap_err().contains("holds 1 slices"));
}
