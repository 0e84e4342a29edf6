//! Label maps in files of every kind, and the tomogram that belongs to one.

use std::io::Write;
use std::path::Path;

use endowire_core::Vec3;
use endowire_core::nalgebra::{Matrix3, Rotation3};
use endowire_core::vessel::{LabelMap, LabelOptions, LabelSurface, SurfaceMesh};
use flate2::Compression;
use flate2::write::GzEncoder;

use super::{Volume, read_label_map};
use crate::spec::CtSpec;

const SIZE: [usize; 3] = [16, 14, 12];

/// How numbers are stored: NIfTI's code, and their bytes.
#[derive(Clone, Copy)]
enum Kind {
    U8,
    I16,
    I32,
    F32,
    F64,
}

/// A NIfTI-1 file of these values at voxels placed by an affine in RAS; with a slope the stored numbers are (value −
/// intercept) / slope.
fn nifti(size: [usize; 3], values: &[f64], kind: Kind, scaling: [f32; 2], rows: &[[f64; 4]; 3]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, own: &[u8]| bytes[at..at + own.len()].copy_from_slice(own);
    put(0, &348_i32.to_le_bytes());
    let [nx, ny, nz] = size.map(|n| n as i16);
    for (k, n) in [3, nx, ny, nz, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * k, &n.to_le_bytes());
    }
    let (code, bits) = match kind {
        Kind::U8 => (2_i16, 8_i16),
        Kind::I16 => (4, 16),
        Kind::I32 => (8, 32),
        Kind::F32 => (16, 32),
        Kind::F64 => (64, 64),
    };
    put(70, &code.to_le_bytes());
    put(72, &bits.to_le_bytes());
    for k in 0..4 {
        put(76 + 4 * k, &1_f32.to_le_bytes());
    }
    put(108, &352_f32.to_le_bytes());
    put(112, &scaling[0].to_le_bytes());
    put(116, &scaling[1].to_le_bytes());
    put(123, &[2]);
    put(254, &1_i16.to_le_bytes());
    for (r, row) in rows.iter().enumerate() {
        for (c, x) in row.iter().enumerate() {
            put(280 + 16 * r + 4 * c, &(*x as f32).to_le_bytes());
        }
    }
    put(344, b"n+1\0");
    let [slope, inter] = scaling.map(f64::from);
    for value in values {
        let stored = if slope == 0.0 { *value } else { ((value - inter) / slope).round() };
        match kind {
            Kind::U8 => bytes.push(stored as u8),
            Kind::I16 => bytes.extend((stored as i16).to_le_bytes()),
            Kind::I32 => bytes.extend((stored as i32).to_le_bytes()),
            Kind::F32 => bytes.extend((*value as f32).to_le_bytes()),
            Kind::F64 => bytes.extend(value.to_le_bytes()),
        }
    }
    bytes
}

/// A file of [`nifti`] with a header of NIfTI-2, <https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h>.
fn second(first: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 544];
    let mut put = |at: usize, own: &[u8]| bytes[at..at + own.len()].copy_from_slice(own);
    let float = |at: usize| f64::from(f32::from_le_bytes(first[at..at + 4].try_into().unwrap()));
    put(0, &540_i32.to_le_bytes());
    put(4, b"n+2\0\r\n\x1a\n");
    put(12, &first[70..74]);
    for k in 0..8 {
        let side = i16::from_le_bytes(first[40 + 2 * k..42 + 2 * k].try_into().unwrap());
        put(16 + 8 * k, &i64::from(side).to_le_bytes());
        put(104 + 8 * k, &float(76 + 4 * k).to_le_bytes());
    }
    put(168, &544_i64.to_le_bytes());
    put(176, &float(112).to_le_bytes());
    put(184, &float(116).to_le_bytes());
    put(348, &1_i32.to_le_bytes());
    for k in 0..12 {
        put(400 + 8 * k, &float(280 + 4 * k).to_le_bytes());
    }
    put(500, &2_i32.to_le_bytes());
    bytes.extend(&first[352..]);
    bytes
}

/// The rows of an affine in RAS of voxels that lie so in LPS.
fn rows(axes: &Matrix3<f64>, origin_mm: &Vec3) -> [[f64; 4]; 3] {
    let sign = [-1.0, -1.0, 1.0];
    [0, 1, 2].map(|r| [axes[(r, 0)], axes[(r, 1)], axes[(r, 2)], origin_mm[r]].map(|x| sign[r] * x))
}

fn plain() -> [[f64; 4]; 3] {
    rows(&Matrix3::identity(), &Vec3::zeros())
}

/// Label 3 in a tube along the last axis, label 7 beyond its middle, and 0.
fn labels() -> Vec<f64> {
    let all = SIZE.iter().product();
    let value = |index: usize| {
        let [x, y, z] = [index % SIZE[0], index / SIZE[0] % SIZE[1], index / SIZE[0] / SIZE[1]];
        let is_in = (x as f64 - 6.3).powi(2) + (y as f64 - 7.2).powi(2) < 16.0;
        if !is_in {
            0.0
        } else if z < 6 {
            3.0
        } else {
            7.0
        }
    };
    (0..all).map(value).collect()
}

fn parts(bytes: &[u8], count: usize) -> Vec<u8> {
    let mut all = Vec::new();
    for part in bytes.chunks(bytes.len().div_ceil(count)) {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(part).unwrap();
        all.extend(encoder.finish().unwrap());
    }
    all
}

fn read(bytes: &[u8], name: &str) -> Result<LabelMap, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_label_map(&path).map_err(|error| error.to_string().replace(path.to_str().unwrap(), name))
}

#[test]
fn labels_are_the_same_in_every_type_of_number_bare_or_in_several_members() {
    let expected: Vec<u16> = labels().into_iter().map(|label| label as u16).collect();
    for kind in [Kind::U8, Kind::I16, Kind::I32, Kind::F32, Kind::F64] {
        let bytes = nifti(SIZE, &labels(), kind, [0.0, 0.0], &plain());
        for file in [bytes.clone(), parts(&bytes, 1), parts(&bytes, 3)] {
            let map = read(&file, "labels.nii.gz").unwrap();
            assert_eq!((map.size(), map.labels()), (SIZE, expected.as_slice()));
        }
    }
    // As nibabel writes decimal numbers into 16 bits: 3 becomes 2.9999.
    let slope = 7.0 / 65_535.0;
    let bytes = nifti(SIZE, &labels(), Kind::I16, [slope, 3.5], &plain());
    assert_eq!(read(&bytes, "scaled.nii").unwrap().labels(), expected);
    assert_eq!(read(&bytes, "scaled.nii").unwrap().counts().len(), 2);
}

#[test]
fn a_label_map_of_the_second_format_is_that_of_the_first() {
    for (kind, scaling) in [(Kind::U8, [1.0, 0.0]), (Kind::I16, [0.5, 0.0]), (Kind::F64, [0.0, 0.0])] {
        let first = nifti(SIZE, &labels(), kind, scaling, &plain());
        let expected = read(&first, "first.nii").unwrap();
        assert_eq!(read(&second(&first), "second.nii").unwrap(), expected);
        assert_eq!(read(&parts(&second(&first), 3), "second.nii.gz").unwrap(), expected);
        // The twin: another origin in its header is another map.
        let mut moved = second(&first);
        moved[424..432].copy_from_slice(&1.5_f64.to_le_bytes());
        assert_ne!(read(&moved, "moved.nii").unwrap(), expected);
    }
    // What is no label map is named in this format as well.
    let decimals =
        nifti(SIZE, &labels().iter().map(|x| 0.3 * x).collect::<Vec<_>>(), Kind::F64, [0.0; 2], &plain());
    let refused = read(&second(&decimals), "second.nii").unwrap_err();
    assert!(refused.contains("a value that is not whole"), "{refused}");
}

#[test]
fn what_is_no_label_map_is_named() {
    let with = |kind: Kind, change: &dyn Fn(usize, f64) -> f64| {
        let values: Vec<f64> = labels().into_iter().enumerate().map(|(k, value)| change(k, value)).collect();
        read(&nifti(SIZE, &values, kind, [0.0, 0.0], &plain()), "a.nii").unwrap_err()
    };
    let ct = with(Kind::I16, &|k, _| k as f64 - 1024.0);
    assert!(
        ct.starts_with("a.nii: is no label map: voxel [0, 0, 0] is -1024, a value that is no label"),
        "{ct}"
    );
    assert!(ct.contains("-1024 to 1663") && ct.contains("CT has to be segmented first"), "{ct}");
    let many = with(Kind::I16, &|k, _| k as f64);
    assert!(many.contains("has 2688 different values, 0 to 2687"), "{many}");
    let probability = with(Kind::F32, &|k, value| if k == 17 { 0.37 } else { value });
    assert!(
        probability.contains("voxel [1, 1, 0] is 0.37") && probability.contains("probabilities"),
        "{probability}"
    );
    let no_number = with(Kind::F64, &|k, value| if k == 2 { f64::NAN } else { value });
    assert!(no_number.contains("voxel [2, 0, 0] is NaN"), "{no_number}");
    let flat =
        read(&nifti([16, 14, 1], &labels()[..224], Kind::U8, [0.0, 0.0], &plain()), "a.nii").unwrap_err();
    assert!(flat.contains("single slice"), "{flat}");
    let folder = read_label_map(Path::new(".")).unwrap_err().to_string();
    assert!(folder.contains("is a folder"), "{folder}");
    let missing = read_label_map(Path::new("no/such.nii")).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.nii: "), "{missing}");
}

#[test]
fn a_header_that_promises_what_the_file_lacks_takes_no_memory() {
    let mut bytes = nifti(SIZE, &labels(), Kind::F64, [0.0, 0.0], &plain());
    for (k, n) in [600_i16, 600, 700].into_iter().enumerate() {
        bytes[42 + 2 * k..44 + 2 * k].copy_from_slice(&n.to_le_bytes());
    }
    for file in [bytes.clone(), parts(&bytes, 2)] {
        let message = read(&file, "short.nii.gz").unwrap_err();
        assert!(message.starts_with("short.nii.gz: ") && !message.contains('\n'), "{message}");
    }
    assert!(read(&[], "empty.nii.gz").unwrap_err().contains("it is empty, or ends within its header"));
    // Cut in the middle of its compressed voxels.
    let whole = parts(&nifti(SIZE, &labels(), Kind::F64, [0.0, 0.0], &plain()), 1);
    let message = read(&whole[..whole.len() - whole.len() / 8], "cut.nii.gz").unwrap_err();
    assert!(message.starts_with("cut.nii.gz: is cut off: it holds fewer voxels"), "{message}");
    // One that another byte of the checksum makes another file, and one with something behind it.
    let mut damaged = whole.clone();
    let checksum = damaged.len() - 8;
    damaged[checksum] ^= 1;
    assert!(read(&damaged, "damaged.nii.gz").unwrap_err().contains("does not fit its checksum"));
    assert_eq!(read(&[whole.clone(), vec![0; 64]].concat(), "padded.nii.gz"), read(&whole, "whole.nii.gz"));
    bytes[42..44].copy_from_slice(&32_000_i16.to_le_bytes());
    let message = read(&bytes, "huge.nii").unwrap_err();
    assert!(message.contains("at most 268435456 are read"), "{message}");
}

/// A tomogram of bone where the label is, with the same header.
#[test]
fn the_tomogram_of_a_label_map_fits_the_vessel_made_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let turn = Rotation3::from_euler_angles(0.3, -0.5, 0.8).into_inner();
    let sides = Matrix3::from_diagonal(&Vec3::new(0.9, 0.9, 1.6));
    let flip = Matrix3::from_diagonal(&Vec3::new(1.0, -1.0, 1.0));
    let origin = Vec3::new(-40.0, 25.0, 130.0);
    for axes in [sides, turn * sides, turn * sides * flip, sides * flip] {
        let placed = rows(&axes, &origin);
        let hu: Vec<f64> =
            labels().into_iter().map(|label| if label > 0.0 { 1500.0 } else { -100.0 }).collect();
        let [map, ct] = ["labels.nii", "ct.nii"].map(|name| folder.path().join(name));
        std::fs::write(&map, nifti(SIZE, &labels(), Kind::U8, [0.0, 0.0], &placed)).unwrap();
        std::fs::write(&ct, nifti(SIZE, &hu, Kind::I16, [0.0, 0.0], &placed)).unwrap();
        let surface = LabelSurface::of(&read_label_map(&map).unwrap(), &LabelOptions::of(&[3, 7])).unwrap();
        assert_eq!(surface.report.ends.len(), 2);
        let volume = Volume::read(&CtSpec { file: ct, offset_mm: [0.0; 3] }, &surface.mesh).unwrap();
        assert!(volume.vessel_held() > 0.99, "{}", volume.vessel_held());
        assert!(bone_part(&volume, &surface.mesh, -1.2) > 0.97);
        assert!(bone_part(&volume, &surface.mesh, 1.2) < 0.03);
        // Axes that are taken for others, left for right, are found out.
        let mut other = surface.mesh.clone();
        let middle = other.vertices_mm.iter().sum::<Vec3>() / other.vertices_mm.len() as f64;
        other.vertices_mm.iter_mut().for_each(|x| *x -= Vec3::x() * 2.0 * (x.x - middle.x) + Vec3::x() * 3.0);
        assert!(bone_part(&volume, &other, -1.2) < 0.9, "the twin");
    }
}

/// The part of the vertices, moved outwards by so many millimetres, that lie in bone.
fn bone_part(volume: &Volume, mesh: &SurfaceMesh, outwards_mm: f64) -> f64 {
    let normals = mesh.vertex_normals();
    let is_bone = |(x, normal): (&Vec3, &Vec3)| {
        let at = volume.into * (x + normal * outwards_mm - volume.origin_mm);
        volume.value([at.x as f32, at.y as f32, at.z as f32])[1] > 0.4
    };
    mesh.vertices_mm.iter().zip(&normals).filter(|pair| is_bone(*pair)).count() as f64 / normals.len() as f64
}
