//! Every reader of files, given valid files with faults from a seed: it reads them or says on one line what is wrong and where,
//! and never panics.

use std::path::{Path, PathBuf};

use endowire_core::Result;
use endowire_core::insertion::Command;
use endowire_core::vessel::SurfaceMesh;
use endowire_tests::damage::damaged;
use endowire_tests::noise::Noise;
use endowire_tests::readers;

/// Damaged files in all from each kind of file.
const ROUNDS: usize = 5_000;

/// Longest message: a few lines of a terminal.
const LONGEST: usize = 1_000;

/// Reads `ROUNDS` damaged copies of `files`. `places`: one of these is in every message, and tells where the fault is.
fn reads_or_refuses(files: &[Vec<u8>], places: &[&str], mut read: impl FnMut(&[u8]) -> Result<()>) {
    let mut noise = Noise::new(1);
    for file in files {
        read(file).unwrap();
    }
    let mut refused = 0;
    for round in 0..ROUNDS {
        let bytes = damaged(&files[round % files.len()], &mut noise);
        let Err(error) = read(&bytes) else { continue };
        refused += 1;
        let message = error.to_string();
        let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(2_000)]).into_owned();
        assert!(error.is_input(), "round {round}: {message}\n{shown}");
        assert!(!message.contains('\n'), "round {round}: several lines: {message}\n{shown}");
        assert!(message.len() <= LONGEST, "round {round}: {} bytes: {message}\n{shown}", message.len());
        assert!(
            places.iter().any(|place| message.contains(place)),
            "round {round}: no place: {message}\n{shown}"
        );
    }
    // The twin: most damage is noticed somewhere, else nothing was tried.
    println!("{refused} of {ROUNDS} refused");
    assert!(refused > ROUNDS / 20, "{refused} of {ROUNDS} refused");
}

/// The files of a folder in assets/ with an extension, in the order of their names.
fn assets(folder: &str, extension: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(folder);
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == extension));
    paths.sort();
    assert!(!paths.is_empty());
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// The first triangles of a vessel: faults should hit headers too, and whole vessels have hundreds of kilobytes of numbers.
fn patch() -> SurfaceMesh {
    let stl = &assets("vessels", "stl")[0];
    let mut mesh = SurfaceMesh::from_bytes(stl, Path::new("a.stl"), 1.0).unwrap();
    mesh.triangles.truncate(20);
    mesh.vertices_mm.truncate(60);
    mesh
}

/// A patch as the program writes it.
fn written(extension: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("damaged.{extension}"));
    patch().write(&path).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn damaged_obj_files() {
    let places = ["line ", "vertex ", "no triangles", "is empty", "mm across"];
    reads_or_refuses(&[written("obj")], &places, readers::obj);
}

#[test]
fn damaged_stl_files() {
    let mut text = String::from("solid a\n");
    let mesh = patch();
    for triangle in 0..mesh.triangles.len() {
        text += "facet normal 0 0 1\nouter loop\n";
        for v in mesh.corners(triangle) {
            text += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
        }
        text += "endloop\nendfacet\n";
    }
    text += "endsolid a\n";
    let places = [
        "line ",
        "vertex ",
        "no triangles",
        "is empty",
        "mm across",
        "declares ",
        "not an STL",
        "the last facet",
    ];
    reads_or_refuses(&[written("stl"), text.into_bytes()], &places, readers::stl);
}

#[test]
fn damaged_ply_files() {
    let mesh = patch();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices_mm.len(),
        mesh.triangles.len()
    );
    mesh.vertices_mm.iter().for_each(|v| text += &format!("{} {} {}\n", v.x, v.y, v.z));
    mesh.triangles.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    // A fault between the rows of a binary file has no line; its cause and remedy are reported.
    let places =
        ["line ", "vertex ", "face ", "no triangles", "is empty", "mm across", "declares ", "mend it"];
    reads_or_refuses(&[written("ply"), text.into_bytes()], &places, readers::ply);
}

/// What every format of VTK tells of a fault.
const VTK: [&str; 9] =
    ["line ", "vertex ", "no triangles", "is empty", "mm across", "cut off", "array ", "offset ", "PolyData"];

#[test]
fn damaged_vtp_files() {
    let mesh = patch();
    let ends = (1..=mesh.triangles.len()).map(|k| 3 * k as u32);
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let (mut text, mut bytes) = (Vec::new(), Vec::new());
    let mut array = |name: &str, kind: &str, words: String, raw: Vec<u8>| {
        text.push(format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{words}</DataArray>"));
        let head = format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{}\"/>",
            bytes.len()
        );
        bytes.extend((raw.len() as u32).to_le_bytes());
        bytes.extend(raw);
        head
    };
    let coordinates: Vec<f64> = mesh.vertices_mm.iter().flatten().copied().collect();
    let of = |numbers: &[u32]| {
        let words: Vec<String> = numbers.iter().map(u32::to_string).collect();
        (words.join(" "), numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>())
    };
    let words: Vec<String> = coordinates.iter().map(f64::to_string).collect();
    let raw = coordinates.iter().flat_map(|c| c.to_le_bytes()).collect();
    let ((corner_words, corner_bytes), (end_words, end_bytes)) =
        (of(&corners), of(&ends.collect::<Vec<_>>()));
    let heads = [
        array("Points", "Float64", words.join("\n"), raw),
        array("connectivity", "UInt32", corner_words, corner_bytes),
        array("offsets", "UInt32", end_words, end_bytes),
    ];
    let file = |arrays: &[String], tail: &[u8]| {
        let head = format!(
            "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData>\n<Piece NumberOfPolys=\"{}\">\n<Points>{}</Points>\n\
             <Polys>{}\n{}</Polys>\n</Piece></PolyData>",
            mesh.triangles.len(),
            arrays[0],
            arrays[1],
            arrays[2]
        );
        [head.as_bytes(), tail, b"</VTKFile>"].concat()
    };
    let appended = [&b"<AppendedData encoding=\"raw\">_"[..], &bytes, b"</AppendedData>"].concat();
    let places = [&VTK[..], &["no XML", "begins with", "is not known", "piece "]].concat();
    reads_or_refuses(&[file(&text, b""), file(&heads, &appended)], &places, readers::vtp);
}

#[test]
fn damaged_vtk_files() {
    let mesh = patch();
    let file = |kind: &str, number: &dyn Fn(f64) -> Vec<u8>, whole: &dyn Fn(u32) -> Vec<u8>| {
        let mut bytes = format!(
            "# vtk DataFile Version 3.0\na\n{kind}\nDATASET POLYDATA\nPOINTS {} double\n",
            mesh.vertices_mm.len()
        )
        .into_bytes();
        mesh.vertices_mm.iter().flatten().for_each(|c| bytes.extend(number(*c)));
        let count = mesh.triangles.len();
        bytes.extend(format!("\nPOLYGONS {count} {}\n", 4 * count).bytes());
        mesh.triangles.iter().for_each(|t| [3].iter().chain(t).for_each(|n| bytes.extend(whole(*n))));
        bytes.push(b'\n');
        bytes
    };
    let files = [
        file("ASCII", &|c| format!("{c}\n").into_bytes(), &|n| format!("{n} ").into_bytes()),
        file("BINARY", &|c| c.to_be_bytes().to_vec(), &|n| n.to_be_bytes().to_vec()),
    ];
    let places =
        [&VTK[..], &["has no corners", "is no keyword", "is no count", "is no surface", "is no type"]]
            .concat();
    reads_or_refuses(&files, &places, readers::vtk);
}

#[test]
fn sessions() {
    let text = r#"{"scene_file": "a.toml", "set": [], "record": {"samples": [{"time_s": 0.5, "tip_mm": [1.0, 2.0, 3.0],
        "hands": [{"advance_mm": 1.0, "rotate_rad": 0.0, "inserted_mm": 1.0, "push_force_n": null, "torque_nmm": 0.0}],
        "wall_force_n": 0.1, "tip_force_n": 0.0, "jumped": false}],
        "injections": [{"time_s": 0.1, "volume_ml": 2.0, "rate_ml_per_s": 1.0}],
        "beam": [{"time_s": 0.0, "on": true, "frames_per_s": 7.5, "dose_ngy": 30.0, "field_mm2": 1e4, "primary_deg": 0.0,
        "secondary_deg": 0.0}]}}"#;
    reads_or_refuses(&[text.as_bytes().to_vec()], &["a.session.json"], readers::session);
}

#[test]
fn damaged_centre_lines() {
    let places = ["line ", "centre-line points"];
    reads_or_refuses(&assets("vessels", "csv"), &places, readers::centreline);
}

/// A line, or a key with its value.
const TOML: [&str; 3] = ["line ", " = ", "is no text"];

#[test]
fn damaged_scenes() {
    reads_or_refuses(&assets("scenes", "toml"), &TOML, readers::scene);
}

#[test]
fn damaged_subjects() {
    reads_or_refuses(&assets("subjects", "toml"), &TOML, readers::subject);
}

#[test]
fn damaged_rod_cases() {
    reads_or_refuses(&assets("cases", "toml"), &TOML, readers::rod_case);
}

#[test]
fn damaged_sidecars() {
    let files = [
        "unit_mm = [1, 3.0]\nlength_mm = 20.0\ndevice_radius_mm = 0.3\n[sheath]\nopening = 2\ndepth_mm = 1.5\n",
        "unit_mm = 10\ndevice_radius_mm = [0.2, 0.45]\n[sheath]\nposition_mm = [0, 1.5, -2]\ndirection = [0, 0, 1]\n",
    ];
    reads_or_refuses(&files.map(|text| text.as_bytes().to_vec()), &TOML, readers::sidecar);
}

#[test]
fn damaged_states() {
    let mut simulation = readers::simulation().unwrap();
    (0..10).for_each(|_| drop(simulation.step(Command::advance(2.0)).unwrap().clone()));
    let saved = postcard::to_allocvec(&simulation.state()).unwrap();
    reads_or_refuses(&[saved], &["state"], |bytes| readers::state(&mut simulation, bytes));
}

/// A tomogram of 3 × 2 × 2 voxels of 10 mm, placed by its affine or, with a code of 0, by its spacing.
fn nifti(affine: i16, data_type: i16, voxels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, data: &[u8]| bytes[at..at + data.len()].copy_from_slice(data);
    put(0, &348_i32.to_le_bytes());
    (0..).zip([3_i16, 3, 2, 2, 1, 1, 1, 1]).for_each(|(k, n)| put(40 + 2 * k, &n.to_le_bytes()));
    put(70, &data_type.to_le_bytes());
    put(72, &(voxels.len() as i16 / 12 * 8).to_le_bytes());
    (0..4).for_each(|k| put(76 + 4 * k, &10_f32.to_le_bytes()));
    put(108, &352_f32.to_le_bytes());
    put(112, &1_f32.to_le_bytes());
    put(123, &[2]);
    put(254, &affine.to_le_bytes());
    (0..3).for_each(|k| put(280 + 20 * k, &10_f32.to_le_bytes()));
    put(344, b"n+1\0");
    bytes.extend(voxels);
    bytes
}

#[test]
fn damaged_tomograms() {
    let units = (0..12_i16).map(|k| 60 * k - 200);
    let short: Vec<u8> = units.clone().flat_map(i16::to_le_bytes).collect();
    let float: Vec<u8> = units.flat_map(|hu| f32::from(hu).to_le_bytes()).collect();
    let places = [
        "is no NIfTI volume",
        "voxel",
        "bitpix",
        "dimensions",
        "its axes",
        "its affine",
        "dim[",
        "pair",
        "its values",
        "scl_inter",
        "nothing of the vessel",
    ];
    let files = [nifti(1, 4, &short), nifti(0, 16, &float), second_nifti(&short)];
    reads_or_refuses(&files, &places, readers::tomogram);
}

#[test]
fn damaged_label_maps() {
    // The header of a tomogram, with eight voxels of twelve labelled; as bytes and as decimal numbers.
    let labels = (0..12_u8).map(|k| u8::from(k < 9));
    let bytes: Vec<u8> = labels.clone().collect();
    let float: Vec<u8> = labels.flat_map(|label| f32::from(label).to_le_bytes()).collect();
    let places = [
        "is no NIfTI volume",
        "voxel",
        "bitpix",
        "dimensions",
        "its affine",
        "dim[",
        "pair",
        "scl_inter",
        "no volume",
        "axes_mm",
        "label",
        "mesh",
    ];
    let files = [nifti(1, 2, &bytes), nifti(1, 16, &float)];
    reads_or_refuses(&files, &places, readers::label_map);
}

/// The tomogram of [`nifti`] in the second format.
fn second_nifti(voxels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 544];
    let mut put = |at: usize, data: &[u8]| bytes[at..at + data.len()].copy_from_slice(data);
    put(0, &540_i32.to_le_bytes());
    put(4, b"n+2\0\r\n\x1a\n");
    put(12, &4_i16.to_le_bytes());
    put(14, &16_i16.to_le_bytes());
    (0..).zip([3_i64, 3, 2, 2, 1, 1, 1, 1]).for_each(|(k, n)| put(16 + 8 * k, &n.to_le_bytes()));
    (0..4).for_each(|k| put(104 + 8 * k, &10_f64.to_le_bytes()));
    put(168, &544_i64.to_le_bytes());
    put(176, &1_f64.to_le_bytes());
    put(348, &1_i32.to_le_bytes());
    (0..3).for_each(|k| put(400 + 40 * k, &10_f64.to_le_bytes()));
    put(500, &2_i32.to_le_bytes());
    bytes.extend(voxels);
    bytes
}

/// A slice of 2 × 2 pixels of 10 mm at a height, explicit VR little endian.
fn slice(z_mm: u8) -> Vec<u8> {
    let element = |group: u16, number: u16, kind: &str, value: &[u8]| {
        let mut bytes = [group.to_le_bytes(), number.to_le_bytes()].concat();
        bytes.extend(kind.bytes());
        match kind {
            "OW" | "OB" => bytes.extend([&[0, 0], &(value.len() as u32).to_le_bytes()[..]].concat()),
            _ => bytes.extend((value.len() as u16).to_le_bytes()),
        }
        bytes.extend(value);
        bytes
    };
    let meta = [
        element(2, 0x02, "UI", b"1.2.840.10008.5.1.4.1.1.2\0"),
        element(2, 0x03, "UI", format!("2.25.{}", 10 + z_mm / 10).as_bytes()),
        element(2, 0x10, "UI", b"1.2.840.10008.1.2.1\0"),
        element(2, 0x12, "UI", b"2.25"),
    ]
    .concat();
    let word = |number, value: u16| element(0x28, number, "US", &value.to_le_bytes());
    let position = format!("-5\\-5\\{z_mm:03} ");
    let pixels: Vec<u8> = [-800_i16, -30, 40, 300].into_iter().flat_map(i16::to_le_bytes).collect();
    let elements = [
        element(0x08, 0x16, "UI", b"1.2.840.10008.5.1.4.1.1.2\0"),
        element(0x08, 0x60, "CS", b"CT"),
        element(0x20, 0x0e, "UI", b"2.25.7"),
        element(0x20, 0x32, "DS", position.as_bytes()),
        element(0x20, 0x37, "DS", b"1\\0\\0\\0\\1\\0 "),
        [word(0x02, 1), word(0x10, 2), word(0x11, 2)].concat(),
        element(0x28, 0x30, "DS", b"10\\10 "),
        [word(0x100, 16), word(0x101, 16), word(0x102, 15), word(0x103, 1)].concat(),
        element(0x28, 0x1052, "DS", b"0 "),
        element(0x28, 0x1053, "DS", b"1 "),
        element(0x7fe0, 0x10, "OW", &pixels),
    ];
    let length = element(2, 0, "UL", &(meta.len() as u32).to_le_bytes());
    [&[0; 128], &b"DICM"[..], &length, &meta, &elements.concat()].concat()
}

#[test]
fn damaged_slices() {
    let places = ["a.dcm", "b.dcm", "slices", "voxel", "its axes", "its values", "nothing of the vessel"];
    reads_or_refuses(&[[slice(0), slice(10)].concat()], &places, readers::slices);
}
