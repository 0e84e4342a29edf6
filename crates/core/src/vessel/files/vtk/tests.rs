//! Files of VTK in all of their encodings, written here as VTK 9 does.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::super::scalar::Order;
use super::*;
use crate::vessel::SurfaceMesh;

/// Points of a strip of squares; no polygon uses the last but one.
const POINTS: [f32; 18] =
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5, 0.0, 2.0, 0.0, 1.0, 2.0, -1.5];
/// A quadrilateral, a triangle, and a strip of two triangles.
const POLYGONS: [i64; 7] = [0, 1, 3, 2, 2, 3, 5];
const ENDS: [i64; 2] = [4, 7];
const STRIP: [i64; 4] = [2, 3, 4, 5];
const TRIANGLES: [[u32; 3]; 5] = [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 3, 4], [4, 3, 5]];

fn is_right(mesh: &SurfaceMesh) -> bool {
    let points: Vec<f32> = mesh.vertices_mm.iter().flatten().map(|c| *c as f32).collect();
    points == POINTS && mesh.triangles == TRIANGLES
}

fn base64(bytes: &[u8]) -> String {
    let digits: Vec<char> = ('A'..='Z').chain('a'..='z').chain('0'..='9').chain(['+', '/']).collect();
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word =
            three.iter().fold(0_u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        let four = (0..4).map(|k| digits[(word >> (18 - 6 * k) & 63) as usize]);
        text.extend(four.enumerate().map(|(k, digit)| if k <= three.len() { digit } else { '=' }));
    }
    text
}

/// LZ4 without compression: literals alone.
fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut packed = vec![(bytes.len().min(15) << 4) as u8];
    if let Some(mut more) = bytes.len().checked_sub(15) {
        while more >= 255 {
            packed.push(255);
            more -= 255;
        }
        packed.push(more as u8);
    }
    packed.extend(bytes);
    packed
}

/// Encoding of arrays.
#[derive(Debug, Clone, Copy)]
struct Kept {
    order: Order,
    wide: bool,
    compressor: &'static str,
    place: &'static str,
}

impl Kept {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for order in [Order::Little, Order::Big] {
            for wide in [false, true] {
                for compressor in ["", "vtkZLibDataCompressor", "vtkLZ4DataCompressor"] {
                    for place in ["binary", "raw", "base64"] {
                        all.push(Self { order, wide, compressor, place });
                    }
                }
            }
        }
        all
    }

    fn number<const N: usize>(self, mut lowest_first: [u8; N]) -> [u8; N] {
        if self.order == Order::Big {
            lowest_first.reverse();
        }
        lowest_first
    }

    fn counts(self, counts: &[usize]) -> Vec<u8> {
        let count = |n: &usize| match self.wide {
            true => self.number((*n as u64).to_le_bytes()).to_vec(),
            false => self.number((*n as u32).to_le_bytes()).to_vec(),
        };
        counts.iter().flat_map(count).collect()
    }

    /// An array with its header.
    fn packed(self, bytes: &[u8]) -> [Vec<u8>; 2] {
        /// Small, so that arrays have several blocks.
        const BLOCK: usize = 16;
        if self.compressor.is_empty() {
            return [[self.counts(&[bytes.len()]), bytes.to_vec()].concat(), Vec::new()];
        }
        let blocks: Vec<Vec<u8>> = bytes
            .chunks(BLOCK)
            .map(|block| match self.compressor {
                "vtkZLibDataCompressor" => {
                    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
                    encoder.write_all(block).unwrap();
                    encoder.finish().unwrap()
                }
                _ => lz4(block),
            })
            .collect();
        let mut header = vec![blocks.len(), BLOCK, bytes.len() % BLOCK];
        header.extend(blocks.iter().map(Vec::len));
        [self.counts(&header), blocks.concat()]
    }

    /// The file.
    fn file(self) -> Vec<u8> {
        let points: Vec<u8> = POINTS.iter().flat_map(|c| self.number(c.to_le_bytes())).collect();
        let whole =
            |numbers: &[i64]| numbers.iter().flat_map(|n| self.number(n.to_le_bytes())).collect::<Vec<u8>>();
        let mut appended = Vec::new();
        let mut array = |kind: &str, name: &str, bytes: &[u8]| {
            let [header, body] = self.packed(bytes);
            let begin = format!("<DataArray type=\"{kind}\" Name=\"{name}\"");
            let texts = base64(&header) + &base64(&body);
            let offset = appended.len();
            match self.place {
                "binary" => return format!("{begin} format=\"binary\">\n  {texts}\n</DataArray>\n"),
                "raw" => appended.extend([header, body].concat()),
                _ => appended.extend(texts.bytes()),
            }
            format!("{begin} format=\"appended\" offset=\"{offset}\"><InformationKey/></DataArray>\n")
        };
        let order = if self.order == Order::Big { "BigEndian" } else { "LittleEndian" };
        let header = if self.wide { "UInt64" } else { "UInt32" };
        let mut file = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"{order}\" header_type=\"{header}\" \
             compressor=\"{}\"><PolyData><Piece NumberOfPoints=\"6\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"1\" \
             NumberOfPolys=\"2\">\n<Points>{}</Points><Verts></Verts><Strips>{}{}</Strips><Polys>{}{}</Polys></Piece></PolyData>",
            self.compressor,
            array("Float32", "Points", &points),
            array("Int64", "connectivity", &whole(&STRIP)),
            array("Int64", "offsets", &whole(&[4])),
            array("Int64", "connectivity", &whole(&POLYGONS)),
            array("Int64", "offsets", &whole(&ENDS)),
        )
        .into_bytes();
        if self.place != "binary" {
            file.extend(format!("<AppendedData encoding=\"{}\">\n  _", self.place).bytes());
            file.extend(&appended);
            file.extend(b"\n</AppendedData>");
        }
        file.extend(b"</VTKFile>");
        file
    }
}

#[test]
fn xml_is_read_in_every_encoding() {
    for kept in Kept::all() {
        let parsed = parse_xml(&kept.file()).unwrap_or_else(|why| panic!("{kept:?}: {why}"));
        assert!(is_right(&parsed.mesh), "{kept:?}: {:?}", parsed.mesh);
    }
    // Counter-check: bytes in another order are another surface, or none.
    let little = Kept { order: Order::Little, wide: false, compressor: "", place: "raw" }.file();
    let at = little.windows(12).position(|window| window == b"LittleEndian").unwrap();
    let mut wrong = little.clone();
    wrong.splice(at..at + 12, b"BigEndian".iter().copied());
    assert!(parse_xml(&wrong).is_err());
}

#[test]
fn damaged_xml_gives_reasons_and_never_panics() {
    for kept in Kept::all() {
        let file = kept.file();
        for cut in (0..file.len()).step_by(7) {
            let _ = parse_xml(&file[..cut]);
        }
        for at in (0..file.len()).step_by(3) {
            for byte in [0, 0x7f, 0xff, file[at] ^ 1] {
                let mut damaged = file.clone();
                damaged[at] = byte;
                let _ = parse_xml(&damaged);
            }
        }
    }
}

#[test]
fn what_is_no_surface_is_reported() {
    let file = |kind: &str, content: &str| {
        format!(
            "<VTKFile type=\"{kind}\"><{kind}><Piece NumberOfLines=\"3\">{content}</Piece></{kind}></VTKFile>"
        )
    };
    let numbers = |name: &str, text: &str| {
        format!("<DataArray type=\"Int32\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    let polys = |corners: &str, ends: &str| {
        let (points, corners, ends) =
            (numbers("P", "0 0 0"), numbers("connectivity", corners), numbers("offsets", ends));
        file("PolyData", &format!("<Points>{points}</Points><Polys>{corners}{ends}</Polys>"))
    };
    for (text, why) in [
        (file("UnstructuredGrid", ""), "\"UnstructuredGrid\", not PolyData: extract its surface"),
        (file("PolyData", ""), "no triangles: 1 pieces, 3 lines"),
        (polys("0 0 1", "3"), "piece 0: polygon 0 names vertex 1"),
        (polys("0 0 0", "4"), "offset 0 is 4, and must be 0 to 3"),
        (polys("0 0 x", "3"), "array \"connectivity\": \"x\" is no number"),
        ("<svg></svg>".to_owned(), "begins with <svg>"),
        ("<VTKFile".to_owned(), "no XML that can be read"),
        (
            file("PolyData", "").replace("<VTKFile", "<VTKFile compressor=\"vtkLZMADataCompressor\""),
            "ZLib and LZ4 are read",
        ),
    ] {
        let reason = parse_xml(text.as_bytes()).unwrap_err();
        assert!(reason.contains(why), "{why}: {reason}");
    }
    for (text, why) in [
        ("DATASET STRUCTURED_POINTS\n", "line 4: a \"STRUCTURED_POINTS\" is no surface"),
        ("DATASET POLYDATA\nLINES 1 3\n2 0 1\n", "no triangles: 1 lines"),
        ("DATASET POLYDATA\nPOINTS 2 float\n0 0 0\n", "line 7: \"\" is no number"),
        ("DATASET POLYDATA\nPOLYGONS 2 4\n3 0 1 2\n", "cell 1 of 2 has no corners"),
        ("DATASET POLYDATA\nPOLYGONS 99999999999 4\n3 0 1 2\n", "cell 1 of 99999999999 has no corners"),
        ("DATASET POLYDATA\nPOINTS 99999999999999 float\n", "more than are left"),
        ("DATASET POLYDATA\nGARBAGE\n", "line 5: \"GARBAGE\" is no keyword"),
        (
            "DATASET UNSTRUCTURED_GRID\nPOINTS 4 int\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
            "cell 0 is of type 10, which is no surface",
        ),
    ] {
        let reason =
            parse_legacy(format!("# vtk DataFile Version 3.0\nt\nASCII\n{text}").as_bytes()).unwrap_err();
        assert!(reason.contains(why), "{why}: {reason}");
    }
}

/// A legacy file with cells as in versions before 5, or since.
fn legacy(is_binary: bool, is_new: bool) -> Vec<u8> {
    let mut file = format!(
        "# vtk DataFile Version {}\ntitle\n{}\nDATASET POLYDATA\n",
        if is_new { "5.1" } else { "4.2" },
        if is_binary { "BINARY" } else { "ASCII" }
    )
    .into_bytes();
    let mut put = |line: &str, numbers: &[f64], bytes: fn(f64) -> Vec<u8>| {
        file.extend(format!("{line}\n").bytes());
        match is_binary {
            true => numbers.iter().for_each(|n| file.extend(bytes(*n))),
            false => numbers.iter().for_each(|n| file.extend(format!("{n} ").bytes())),
        }
        file.push(b'\n');
    };
    let int = |n: f64| (n as i32).to_be_bytes().to_vec();
    let long = |n: f64| (n as i64).to_be_bytes().to_vec();
    let polygons: Vec<f64> = POLYGONS.iter().map(|c| *c as f64).collect();
    let strip: Vec<f64> = STRIP.iter().map(|c| *c as f64).collect();
    put("FIELD FieldData 1\nt 1 2 double", &[0.5, 1.5], |n| n.to_be_bytes().to_vec());
    put("POINTS 6 float", &POINTS.map(f64::from), |n| (n as f32).to_be_bytes().to_vec());
    put("METADATA\nINFORMATION 1\nNAME a LOCATION b\nDATA 1 2\n", &[], int);
    if is_new {
        put("POLYGONS 3 7\nOFFSETS vtktypeint64", &[0.0, 4.0, 7.0], long);
        put("CONNECTIVITY vtktypeint64", &polygons, long);
        put("TRIANGLE_STRIPS 2 4\nOFFSETS vtktypeint64", &[0.0, 4.0], long);
        put("CONNECTIVITY vtktypeint64", &strip, long);
    } else {
        put("POLYGONS 2 9", &[&[4.0], &polygons[..4], &[3.0], &polygons[4..]].concat(), int);
        put("TRIANGLE_STRIPS 1 5", &[&[4.0], &strip[..]].concat(), int);
    }
    put("POINT_DATA 6\nSCALARS anything", &[f64::NAN], long);
    file
}

#[test]
fn legacy_files_are_read_as_text_and_bytes_of_either_version_and_damage_never_panics() {
    for (is_binary, is_new) in [(false, false), (false, true), (true, false), (true, true)] {
        let file = legacy(is_binary, is_new);
        let parsed = parse_legacy(&file).unwrap_or_else(|why| panic!("{is_binary} {is_new}: {why}"));
        assert!(is_right(&parsed.mesh), "{is_binary} {is_new}: {:?}", parsed.mesh);
        for at in 0..file.len() {
            let _ = parse_legacy(&file[..at]);
            for byte in [0, b' ', 0x7f, 0xff, file[at] ^ 1] {
                let mut damaged = file.clone();
                damaged[at] = byte;
                let _ = parse_legacy(&damaged);
            }
        }
    }
}

#[test]
fn surface_cells_of_unstructured_grids_are_read() {
    let grid = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n\
                CELLS 5 20\n4 0 1 2 3\n3 0 1 2\n3 1 2 3\n4 0 1 3 2\n1 0\nCELL_TYPES 5\n8\n5\n6\n9\n1\n";
    let mesh = parse_legacy(grid.as_bytes()).unwrap().mesh;
    assert_eq!(mesh.triangles, [[0, 1, 3], [0, 3, 2], [0, 1, 2], [1, 2, 3], [0, 1, 3], [0, 3, 2]]);
}
