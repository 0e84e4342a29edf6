//! Files as other programs write them, all with the same small surface.

use super::*;

/// A square of two triangles, on a third one that stands on its side.
fn expected() -> Vec<[f64; 9]> {
    vec![[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.5], [0.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 1.0, 0.0]]
}

fn corners(mesh: &SurfaceMesh) -> Vec<[f64; 9]> {
    let flat = |k: usize| {
        let [a, b, c] = mesh.corners(k);
        [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
    };
    (0..mesh.triangles.len()).map(flat).collect()
}

/// The triangles in `bytes` of a file with that name.
fn read(name: &str, bytes: &[u8]) -> Result<Vec<[f64; 9]>> {
    SurfaceMesh::from_bytes(bytes, Path::new(name), 1.0).map(|mesh| corners(&mesh))
}

fn is_read(name: &str, bytes: &[u8]) {
    let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(300)]).into_owned();
    assert_eq!(read(name, bytes).unwrap_or_else(|e| panic!("{e}\n{shown}")), expected(), "{shown}");
}

fn is_refused(name: &str, bytes: &[u8], why: &str) {
    let reported = read(name, bytes).unwrap_err().to_string();
    assert!(reported.contains(why), "{why}: {reported}");
}

const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0.5\nendloop\nendfacet\n\
                   facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0.5\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

const OBJ: &str = "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n";

const PLY: &str = "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n4 0 1 2 3\n";

const VTK: &str = "# vtk DataFile Version 3.0\na square\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0.5\n0 1 0\n\
                   POLYGONS 1 5\n4 0 1 2 3\n";

const VTP: &str = r#"<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="4" NumberOfPolys="1">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0.5 0 1 0</DataArray></Points>
<Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4</DataArray></Polys></Piece></PolyData></VTKFile>"#;

const ALL: [(&str, &str); 5] =
    [("a.stl", STL), ("a.obj", OBJ), ("a.ply", PLY), ("a.vtk", VTK), ("a.vtp", VTP)];

#[test]
fn every_format_is_read_with_any_line_end_and_mark() {
    for (name, text) in ALL {
        is_read(name, text.as_bytes());
        is_read(name, text.replace('\n', "\r\n").as_bytes());
        is_read(name, text.replace('\n', "\r").as_bytes());
        is_read(name, &[b"\xef\xbb\xbf", text.as_bytes()].concat());
        let units = |of: fn(u16) -> [u8; 2]| -> Vec<u8> {
            std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(of).collect()
        };
        is_read(name, &units(u16::to_le_bytes));
        is_read(name, &units(u16::to_be_bytes));
    }
}

#[test]
fn comments_and_titles_hold_any_bytes() {
    for (name, text, word) in [
        ("a.stl", STL, "a"),
        ("a.obj", OBJ, "a square"),
        ("a.ply", PLY, "a square"),
        ("a.vtk", VTK, "a square"),
    ] {
        let at = text.find(word).unwrap();
        let (before, after) = text.split_at(at);
        let strange: &[u8] = b"\xe9\x80\xff\x01 ";
        is_read(name, &[before.as_bytes(), strange, after.as_bytes()].concat());
    }
    let vtp = format!("<?xml version=\"1.0\"?><!-- {} -->{VTP}", "é");
    let latin: Vec<u8> = vtp.chars().map(|c| c as u8).collect();
    is_read("a.vtp", &latin);
}

#[test]
fn text_goes_on_where_its_lines_end() {
    is_read("a.stl", STL.replace('\n', " ").as_bytes());
    is_read("a.stl", STL.replace("solid a\n", "solid vertex 1 of a facet\n").as_bytes());
    is_read("a.stl", STL.replacen("facet normal", "\n\n facet\tnormal nan -nan(ind) 1e5\n", 1).as_bytes());
    is_read("a.obj", OBJ.replace("f 1 2 3 4", "f 1 2 \\\n 3 \\ \n 4").as_bytes());
    // The end of a comment does not belong to the next line.
    is_read("a.obj", OBJ.replace("# a square", "# C:\\scans\\").as_bytes());
    is_read("a.ply", PLY.replace("0 0 0\n1 0 0\n1 1 0.5\n", "0 0 0 1 0\n0 1 1\n0.5 ").as_bytes());
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    is_refused("a.stl", format!("solid a\n{facet}{}", &facet[..30]).as_bytes(), "cut off");
    is_refused("a.obj", OBJ.replace("4\n", "4 \\\n").trim_end().as_bytes(), "cut off");
    // A wrong number of values must be detected.
    is_refused("a.ply", PLY.replace("0 0 0\n1 0 0\n", "0 0 0 1\n0 0\n9 ").as_bytes(), "line ");
    is_refused("a.stl", STL.replacen("endfacet\n", "", 1).as_bytes(), "before the last one is closed");
}

/// [`STL`] as bytes.
fn binary_stl() -> Vec<u8> {
    stl::bytes(&SurfaceMesh::from_bytes(STL.as_bytes(), Path::new("a.stl"), 1.0).unwrap())
}

#[test]
fn the_size_of_a_binary_stl_says_what_its_count_does_not() {
    let with_count = |count: u32, more: &[u8]| {
        let mut bytes = binary_stl();
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        bytes.extend_from_slice(more);
        bytes
    };
    for (count, more) in [(2, &b""[..]), (2, b"trailing"), (0, b""), (u32::MAX, b"")] {
        is_read("a.stl", &with_count(count, more));
    }
    is_refused("a.stl", &with_count(0, b"trailing"), "declares 0 triangles");
    is_refused("a.stl", &with_count(3, b""), "declares 3 triangles");
    let mut misleading = binary_stl();
    misleading[..25].copy_from_slice(b"solid facet normal vertex");
    is_read("a.stl", &misleading);
}

#[test]
fn plies_have_strips_unused_values_and_other_names() {
    let strip = PLY.replace("element face 1", "element tristrips 1").replace("4 0 1 2 3", "7 1 2 0 -1 0 2 3");
    let turned = read("a.ply", strip.as_bytes()).unwrap();
    assert_eq!(turned.len(), 2);
    let strip = PLY.replace("element face 1", "element tristrips 1").replace("4 0 1 2 3", "4 1 2 0 3");
    let mesh = SurfaceMesh::from_bytes(strip.as_bytes(), Path::new("a.ply"), 1.0).unwrap();
    assert_eq!(mesh.triangles, [[1, 2, 0], [0, 2, 3]]);
    // Where a strip turns back, corners are repeated.
    let strip = strip.replace("4 1 2 0 3", "6 1 2 0 0 0 3");
    let mesh = SurfaceMesh::from_bytes(strip.as_bytes(), Path::new("a.ply"), 1.0).unwrap();
    assert_eq!(mesh.triangles, [[1, 2, 0]]);
    let with_quality = PLY
        .replace(
            "property float z\n",
            "property float z\nproperty float quality\nproperty list uchar float texture\n",
        )
        .replace("0 0 0\n", "0 0 0 nan 2 -nan(ind) inf\n")
        .replace("1 0 0\n", "1 0 0 1.#QNAN 0\n")
        .replace("1 1 0.5\n", "1 1 0.5 x 1 7\n")
        .replace("0 1 0\n", "0 1 0 0 0\n");
    is_read("a.ply", with_quality.as_bytes());
    for (from, to) in [
        ("vertex_indices", "vertex_index"),
        ("vertex_indices", "vertices"),
        ("property list uchar int", "property list uint8 float32"),
        ("float x", "float64 X"),
        ("element face 1", "element edge 0\nproperty int a\nelement face 1"),
    ] {
        is_read("a.ply", PLY.replace(from, to).as_bytes());
    }
    is_refused("a.ply", PLY.replace("4 0 1 2 3", "4 0 1 2 2.5").as_bytes(), "face 0 names vertex");
    is_refused("a.ply", PLY.replace("float x", "quad x").as_bytes(), "no property with a type of PLY");
}

#[test]
fn axes_are_those_of_the_header_or_of_the_caller() {
    let stl = binary_stl();
    let mut reported = stl.clone();
    reported[26..48].copy_from_slice(b"3D Slicer. SPACE=RAS  ");
    let field = |format: &str| {
        format!(
            "<PolyData><FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" {format}</Array></FieldData>"
        )
    };
    let letters = "format=\"ascii\">82 65 83 0";
    let said = [
        ("a.stl", reported),
        ("a.stl", STL.replace("solid a", "solid a SPACE=RAS").into_bytes()),
        ("a.ply", PLY.replace("comment a", "comment SPACE=RAS a").into_bytes()),
        ("a.obj", OBJ.replace("# a", "# SPACE=RAS; a").into_bytes()),
        ("a.vtk", VTK.replace("a square", "3D Slicer output. SPACE=RAS").into_bytes()),
        (
            "a.vtk",
            VTK.replace("POINTS", "FIELD FieldData 2\nn 1 1 int\n7\nSPACE 1 1 string\nRAS\nPOINTS")
                .into_bytes(),
        ),
        ("a.vtp", VTP.replacen("<PolyData>", &field(letters), 1).into_bytes()),
    ];
    let lps = |[a, b, c, d, e, f, g, h, i]: [f64; 9]| [-a, -b, c, -d, -e, f, -g, -h, i];
    let turned: Vec<[f64; 9]> = expected().into_iter().map(lps).collect();
    for (name, bytes) in &said {
        assert_eq!(read(name, bytes).unwrap(), turned, "{}", String::from_utf8_lossy(bytes));
        // The caller's axes take precedence.
        let frame = SurfaceFrame { unit_mm: 1.0, axes: Some(PatientAxes::Lps) };
        let mesh = SurfaceMesh::from_bytes(bytes, Path::new(name), frame).unwrap();
        assert_eq!(corners(&mesh), expected());
    }
    let frame = SurfaceFrame { unit_mm: 2.0, axes: Some("ras".parse().unwrap()) };
    let mesh = SurfaceMesh::from_bytes(&stl, Path::new("a.stl"), frame).unwrap();
    assert_eq!(corners(&mesh), turned.iter().map(|t| t.map(|c| 2.0 * c)).collect::<Vec<_>>());
    is_read("a.stl", STL.replace("solid a", "solid a SPACE=LPS").as_bytes());
    is_read("a.stl", STL.replace("solid a", "solid AIRSPACE=RAS").as_bytes());
    is_refused("a.stl", STL.replace("solid a", "solid SPACE=scanner").as_bytes(), "SPACE=scanner");
    assert!("LAS".parse::<PatientAxes>().unwrap_err().to_string().contains("LPS"));
}

#[test]
fn a_file_under_a_wrong_name_is_reported_what_it_seems_to_be() {
    for (name, bytes, seems) in [
        ("a.stl", PLY.as_bytes(), "PLY files"),
        ("a.obj", VTP.as_bytes(), "VTK's XML files"),
        ("a.vtp", VTK.as_bytes(), "legacy VTK files"),
        ("a.ply", &b"\x1f\x8b\x08\0"[..], "gzip"),
    ] {
        is_refused(name, bytes, seems);
    }
    let plain = read("a.ply", b"ply\nformat none\n").unwrap_err().to_string();
    assert!(!plain.contains("it begins"), "{plain}");
}
