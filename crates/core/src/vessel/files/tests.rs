use proptest::prelude::*;

use super::*;

/// A surface of arbitrary triangles; coordinates are exactly representable in 32 bits, so that STL preserves them.
fn any_surface() -> impl Strategy<Value = SurfaceMesh> {
    let vertex = prop::array::uniform3(-1000.0f32..1000.0).prop_map(|c| Vec3::from(c.map(f64::from)));
    prop::collection::vec(vertex, 3..20).prop_flat_map(|vertices_mm| {
        let index = 0..vertices_mm.len() as u32;
        prop::collection::vec(prop::array::uniform3(index), 1..30)
            .prop_map(move |triangles| SurfaceMesh { vertices_mm: vertices_mm.clone(), triangles })
    })
}

fn soup(mesh: &SurfaceMesh) -> Vec<[Vec3; 3]> {
    (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect()
}

fn ascii_stl(mesh: &SurfaceMesh) -> String {
    let facet = |c: &[Vec3; 3]| {
        let vertices: String = c.iter().map(|v| format!("vertex {} {} {}\n", v.x, v.y, v.z)).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    format!("solid\n{}endsolid\n", soup(mesh).iter().map(facet).collect::<String>())
}

fn ply_variant(mesh: &SurfaceMesh, big_endian: bool) -> Vec<u8> {
    let format = if big_endian { "binary_big_endian" } else { "ascii" };
    let mut out = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar quality\nelement face {}\nproperty list int int vertex_index\nend_header\n",
        mesh.vertices_mm.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for v in &mesh.vertices_mm {
        if big_endian {
            v.iter().for_each(|c| out.extend_from_slice(&(*c as f32).to_be_bytes()));
            out.push(7);
        } else {
            out.extend_from_slice(format!("{} {} {} 7\n", v.x, v.y, v.z).as_bytes());
        }
    }
    for t in &mesh.triangles {
        if big_endian {
            [3, t[0], t[1], t[2]].iter().for_each(|i| out.extend_from_slice(&i.to_be_bytes()));
        } else {
            out.extend_from_slice(format!("3 {} {} {}\n", t[0], t[1], t[2]).as_bytes());
        }
    }
    out
}

proptest! {
    #![proptest_config(crate::vessel::tests::steady(64))]
    #[test]
    fn every_format_reads_back_what_was_written(mesh in any_surface()) {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.stl", "a.OBJ", "a.Ply"] {
            let path = folder.path().join(name);
            mesh.write(&path).unwrap();
            let back = SurfaceMesh::read(&path, 1.0).unwrap();
            prop_assert_eq!(soup(&back), soup(&mesh));
            let scaled = SurfaceMesh::read(&path, 2.0).unwrap();
            prop_assert_eq!(scaled.vertices_mm[0], back.vertices_mm[0] * 2.0);
            // Counter-check: this comparison detects a moved vertex.
            let mut moved = mesh.clone();
            moved.vertices_mm[mesh.triangles[0][0] as usize].x += 0.125;
            prop_assert_ne!(soup(&back), soup(&moved));
        }
    }

    #[test]
    fn foreign_variants_read_to_the_same_surface(mesh in any_surface()) {
        let same = |format, bytes: &[u8]| soup(&parse(format, bytes).unwrap().mesh) == soup(&mesh);
        prop_assert!(same(Format::Stl, ascii_stl(&mesh).as_bytes()));
        prop_assert!(same(Format::Stl, ascii_stl(&mesh).to_ascii_uppercase().as_bytes()));
        let mut misleading = stl::bytes(&mesh);
        misleading[..11].copy_from_slice(b"solid facet");
        prop_assert!(same(Format::Stl, &misleading));
        prop_assert!(same(Format::Ply, &ply_variant(&mesh, false)));
        prop_assert!(same(Format::Ply, &ply_variant(&mesh, true)));
    }

    #[test]
    fn damaged_files_give_errors_or_meshes_but_never_panic(
        mesh in any_surface(), cut in 0.0..1.0, at in 0.0..1.0, byte: u8,
    ) {
        let files: [(Format, Vec<u8>); 6] = [
            (Format::Stl, stl::bytes(&mesh)), (Format::Stl, ascii_stl(&mesh).into_bytes()), (Format::Obj, obj::bytes(&mesh)),
            (Format::Ply, ply::bytes(&mesh)), (Format::Ply, ply_variant(&mesh, false)), (Format::Ply, ply_variant(&mesh, true)),
        ];
        for (k, (format, bytes)) in files.into_iter().enumerate() {
            let _ = parse(format, &bytes[..(bytes.len() as f64 * cut) as usize]);
            let mut changed = bytes.clone();
            changed[(bytes.len() as f64 * at) as usize] = byte;
            let read = parse(format, &changed);
            // What takes long is made of one of them.
            if let (Ok(surface), true) = (read, k == usize::from(byte) % 6) {
                let _ = crate::vessel::Wall::from_surface(&surface.mesh);
            }
        }
    }

    #[test]
    fn noise_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400), text in "(ply|solid|v|f|facet|[ 0-9\n-])*") {
        for format in [Format::Stl, Format::Obj, Format::Ply, Format::Vtp, Format::Vtk] {
            let _ = parse(format, &bytes);
            let _ = parse(format, text.as_bytes());
        }
    }
}

#[test]
fn absurd_counts_end_at_once_with_a_reason() {
    let mut stl = stl::bytes(&SurfaceMesh::default());
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(parse(Format::Stl, &stl).unwrap_err().contains("4294967295 triangles"));
    for element in ["vertex 99999999999999", "empty 99999999999999"] {
        let ply = format!("ply\nformat ascii 1.0\nelement {element}\nproperty float x\nend_header\n");
        assert!(parse(Format::Ply, ply.as_bytes()).unwrap_err().contains("99999999999999"));
    }
    let list = b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n\xff\xff\xff\xff";
    assert!(parse(Format::Ply, list).is_err());
}

#[test]
fn polygons_become_fans_and_negative_indices_count_back() {
    let quad = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2//2 3/3/3 -1 # a square\n";
    assert_eq!(parse(Format::Obj, quad).unwrap().mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn faces_without_three_corners_are_counted_and_the_others_stay() {
    let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv nan 0 0\nf 1 2\nf 3\nf\nf 1 2 3\nf 2 2 3\n";
    let stl = b"solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nendfacet\nfacet\nendfacet\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendfacet\n";
    let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n2 0 1\n3 0 1 2\n";
    for (format, bytes, degenerate) in
        [(Format::Obj, &obj[..], 3), (Format::Stl, &stl[..], 1), (Format::Ply, &ply[..], 1)]
    {
        let surface = placed(parse(format, bytes).unwrap(), 2.0.into()).unwrap();
        let wall = crate::vessel::Wall::from_surface(&surface).unwrap();
        assert_eq!((wall.mesh().triangles.len(), wall.report().degenerate_removed), (1, degenerate));
    }
    // Counter-check: a vertex that is used must be finite.
    let used = parse(Format::Obj, b"v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n").unwrap();
    let reason = placed(used, 1.0.into()).unwrap_err();
    assert!(reason.contains("vertex 2 is at (NaN") && reason.contains("1 triangles"), "{reason}");
}

#[test]
fn errors_name_the_place_and_the_way_out() {
    let reason = |format, text: &str| parse(format, text.as_bytes()).unwrap_err();
    assert_eq!(reason(Format::Obj, "v 0 0 zero\n"), "line 1: \"zero\" is not a number");
    assert!(reason(Format::Obj, "v 0 0 0\nf 1 2 3\n").contains("line 2 names vertex 1"));
    assert!(reason(Format::Obj, "v 0 0 0\n").contains("no triangles"));
    assert!(reason(Format::Stl, "solid x\nfacet\nvertex 0 0\nendfacet\n").contains("line 3"));
    let unknown = SurfaceMesh::read(Path::new("wall.vtu"), 1.0).unwrap_err().to_string();
    assert!(unknown.contains(".vtu") && unknown.contains(".stl, .obj, .ply, .vtp or .vtk"), "{unknown}");
    let written = SurfaceMesh::default().write(Path::new("wall.vtp")).unwrap_err().to_string();
    assert!(written.contains("read, not written"), "{written}");
    for unit in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(SurfaceMesh::read(Path::new("a.stl"), unit).unwrap_err().to_string().starts_with("unit_mm"));
    }
    assert!(matches!(SurfaceMesh::read(Path::new("no such file.stl"), 1.0), Err(Error::File { .. })));
}

#[test]
fn errors_of_ply_files_are_one_line_with_place_cause_and_remedy() {
    let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let with = |rows: &str| format!("{head}{rows}");
    let long = format!("ply\n{}\n", "nonsense ".repeat(1000));
    let cases = [
        ("solid\n".to_owned(), "line 1, \"solid\": "),
        (long, "line 2, \"nonsense nonsense"),
        ("ply\nformat ascii 9.0\nelement nonsense\n".to_owned(), "line 3, \"element nonsense\": "),
        ("ply\nelement vertex 1\n".to_owned(), "line 3: "),
        (
            with("0 0 x\n"),
            "line 10, \"0 0 x\": \"x\" is no number, in row 0 of the 2 of element \"vertex\": mend it",
        ),
        (with("0 0\n"), "line 10, \"0 0\": has fewer values than its element has properties"),
        (with("0 0 0\n"), "line 11: the file ends here, in row 1 of the 2 of element \"vertex\""),
        (with("0 0 0\n1 0 0\n3 0 1\n"), "line 12, \"3 0 1\": has fewer values"),
        (with("0 0 0\n1 0 0\n3 0 1 7\n"), "face 0 names vertex 7"),
        (
            with("").replace("ascii", "binary_little_endian"),
            "the file ends here: it is cut off, in row 0 of the 2 of element \"vertex\"",
        ),
        (
            with("0 0 0\n1 0 0\n3 0 1 1\n").replace("float z", "float w"),
            "the element 'vertex' lacks x, y or z",
        ),
    ];
    for (text, begins) in cases {
        let reason = parse(Format::Ply, text.as_bytes()).unwrap_err();
        assert!(reason.starts_with(begins), "{begins}: {reason}");
        assert!(reason.lines().count() == 1 && reason.len() < 300, "{reason}");
        assert!(reason.contains("mend") || reason.contains("export the surface again"), "{reason}");
    }
}
