//! VTK's XML format of polygonal data (`.vtp`), all pieces as one surface.

use roxmltree::{Document, Node};

use super::super::faces::Faces;
use super::super::frame::ToldAxes;
use super::super::{Parsed, Reason};
use super::arrays::Encoding;
use super::{Cells, EXTRACT};
use crate::Vec3;
use crate::text::shown;
use crate::vessel::SurfaceMesh;

/// The element with appended data, which are not XML.
const APPENDED: &[u8] = b"<AppendedData";

/// Points of a line, each with its radius if there is one.
pub(crate) type Line = Vec<(Vec3, Option<f64>)>;

/// A file that is read: its polygonal data and the arrays in it.
struct Open<'a, 'i> {
    data: Node<'a, 'i>,
    encoding: Encoding<'a>,
    axes: ToldAxes,
}

impl<'a, 'i> Open<'a, 'i> {
    fn pieces(&self) -> impl Iterator<Item = Node<'a, 'i>> {
        self.data.children().filter(|node| node.has_tag_name("Piece"))
    }
}

/// The XML of a file, and the data appended to it.
fn parts(bytes: &[u8]) -> (String, Option<&[u8]>) {
    let appended = bytes.windows(APPENDED.len()).position(|window| window == APPENDED);
    let (head, tail) = bytes.split_at(appended.unwrap_or(bytes.len()));
    // Comments may be in any encoding; only ASCII matters.
    let mut text = String::from_utf8_lossy(head).into_owned();
    if appended.is_some() {
        text += "</VTKFile>";
    }
    (text, appended.map(|_| tail))
}

fn open<'a, 'i>(document: &'a Document<'i>, appended: Option<&'a [u8]>) -> Result<Open<'a, 'i>, Reason> {
    let file = document.root_element();
    if file.tag_name().name() != "VTKFile" {
        return Err(format!(
            "begins with <{}>, and a .vtp file with <VTKFile>",
            shown(file.tag_name().name())
        ));
    }
    let kind = file.attribute("type").unwrap_or_default();
    let data = child(file, "PolyData").ok_or_else(|| match kind {
        "PolyData" => "has no element PolyData: it is cut off".to_owned(),
        other => format!("holds data of type {:?}, not PolyData: {EXTRACT}", shown(other)),
    })?;
    let encoding = Encoding::new(file, appended.and_then(data_in))?;
    let mut axes = ToldAxes::default();
    if let Some(space) = child(data, "FieldData").and_then(|field| named(field, "SPACE")) {
        let letters = encoding.numbers(space)?;
        axes.say(
            &letters.iter().map(|c| char::from(*c as u8)).take_while(|c| *c != '\0').collect::<String>(),
        );
    }
    Ok(Open { data, encoding, axes })
}

/// The lines of a file in the axes of scenes; `is_radius` tells the name of the array with their radii.
pub(crate) fn parse_lines(bytes: &[u8], is_radius: impl Fn(&str) -> bool) -> Result<Vec<Line>, Reason> {
    let (text, appended) = parts(bytes);
    let document = Document::parse(&text).map_err(|e| format!("is no XML that can be read: {e}"))?;
    let file = open(&document, appended)?;
    let axes = file.axes.axes()?;
    let mut lines = Vec::new();
    for piece in file.pieces() {
        let at = |name: &str| child(piece, name);
        let points = at("Points").and_then(|points| child(points, "DataArray"));
        let points = points.map_or_else(|| Ok(Vec::new()), |points| file.encoding.numbers(points))?;
        let radii = at("PointData")
            .and_then(|data| data.children().find(|array| array.attribute("Name").is_some_and(&is_radius)));
        let radii = radii.map(|radii| file.encoding.numbers(radii)).transpose()?;
        for line in cells(piece, "Lines", &file.encoding)?.iter() {
            let point = |number: &i64| {
                let index = usize::try_from(*number).ok();
                let place = index.and_then(|index| points.chunks_exact(3).nth(index));
                let place =
                    place.ok_or_else(|| format!("a line names point {number}, which is not there"))?;
                let radius = radii.as_ref().zip(index).and_then(|(radii, index)| radii.get(index).copied());
                Ok((axes.to_lps(Vec3::new(place[0], place[1], place[2])), radius))
            };
            lines.push(line.iter().map(point).collect::<Result<Line, Reason>>()?);
        }
    }
    match lines.is_empty() {
        true => Err("holds no lines: a centre line is a line of points".into()),
        false => Ok(lines),
    }
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Parsed, Reason> {
    let (text, appended) = parts(bytes);
    let document = Document::parse(&text).map_err(|e| format!("is no XML that can be read: {e}"))?;
    let Open { data, encoding, axes } = open(&document, appended)?;
    let mut parsed = Parsed { axes, ..Parsed::default() };
    let (mut others, mut pieces) = (0, 0);
    for node in data.children().filter(|node| node.has_tag_name("Piece")) {
        let piece = surface(node, &encoding).map_err(|why| format!("piece {pieces}: {why}"))?;
        // Each piece counts its own points from 0.
        let first = u32::try_from(parsed.mesh.vertices_mm.len()).map_err(|_| "has too many points")?;
        parsed.mesh.vertices_mm.extend(piece.vertices_mm);
        parsed.mesh.triangles.extend(piece.triangles.iter().map(|t| t.map(|v| v.saturating_add(first))));
        others += ["NumberOfLines", "NumberOfVerts"]
            .iter()
            .filter_map(|name| node.attribute(*name)?.trim().parse::<usize>().ok())
            .fold(0, usize::saturating_add);
        pieces += 1;
    }
    if parsed.mesh.triangles.is_empty() {
        return Err(format!("holds no triangles: {pieces} pieces, {others} lines and lone points"));
    }
    Ok(parsed)
}

/// The triangles of a piece.
fn surface(piece: Node<'_, '_>, encoding: &Encoding<'_>) -> Result<SurfaceMesh, Reason> {
    let (mut mesh, mut faces) = (SurfaceMesh::default(), Faces::default());
    if let Some(points) = child(piece, "Points").and_then(|points| child(points, "DataArray")) {
        let points = encoding.numbers(points)?;
        mesh.vertices_mm.extend(points.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])));
    }
    cells(piece, "Polys", encoding)?.add_polygons(&mut faces);
    cells(piece, "Strips", encoding)?.add_strips(&mut faces);
    faces.fill(&mut mesh, |number| format!("polygon {number}"))?;
    Ok(mesh)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The array with this name.
fn named<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.attribute("Name") == Some(name))
}

/// The data appended in `AppendedData`, after its initial underscore, and whether they are base64.
fn data_in(element: &[u8]) -> Option<(&[u8], bool)> {
    let end = element.iter().position(|byte| *byte == b'>')?;
    let is_raw = element[..end].windows(3).any(|window| window == b"raw");
    let begin = end + element[end..].iter().position(|byte| *byte == b'_')?;
    Some((&element[begin + 1..], !is_raw))
}

/// Cells of a kind; empty if a piece has none.
fn cells(piece: Node<'_, '_>, kind: &str, encoding: &Encoding<'_>) -> Result<Cells, Reason> {
    let Some(list) = child(piece, kind) else { return Ok(Cells::default()) };
    // If the count is zero, arrays may contain anything.
    if piece.attribute(format!("NumberOf{kind}").as_str()).is_some_and(|count| count.trim() == "0") {
        return Ok(Cells::default());
    }
    let (Some(corners), Some(ends)) = (named(list, "connectivity"), named(list, "offsets")) else {
        return Ok(Cells::default());
    };
    Cells::from_ends(&encoding.numbers(corners)?, &encoding.numbers(ends)?)
        .map_err(|why| format!("{kind}: {why}"))
}
