//! The centre line of a vessel tree: points with radii, each joined to its parent.
//!
//! As a table, one point per line: `x y z radius parent`, separated by blanks, tabs, commas or semicolons;
//! millimetres; `parent` is the row (counted from 0, without comments and header) of an earlier point, −1 for the
//! root. Words after it name the point as a target; the word `closed` alone, or after a name, closes the vessel there
//! with a dome, like the sac of an aneurysm. `#` starts a comment, and the first line that is not a comment may be a
//! header of words. The words `joins 17` there join the last point of a branch to row 17, where two branches meet again
//! ([`super::CentrelineLink`]). Lists of points without parents can be read too if the header names their columns
//! ([`super::point_lists`]).

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::links::{JOINS, split_link};
use super::point_lists::{self, Columns};
use super::{CentrelineLink, line_files, swc};
use crate::error::nearest_name;
use crate::file::{FileSystem, Files, foreign};
use crate::{Error, Result, Vec3, text};

/// A point of a centre line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CentrelineNode {
    /// Position in mm.
    pub position_mm: Vec3,
    /// Lumen radius in mm.
    pub radius_mm: f64,
    /// The node before it, towards the root; `None` for the root.
    pub parent: Option<usize>,
}

/// A tree of centre-line points: one root, parents before their children, no two joined points coincident.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CentrelineTree {
    nodes: Vec<CentrelineNode>,
    /// Leaves where the vessel is closed by a dome, ascending.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    closed: Vec<usize>,
    /// Leaves that go on to other points, ascending.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) links: Vec<CentrelineLink>,
    /// Not part of the vessel's shape: the wall does not depend on names.
    #[serde(skip)]
    targets: Vec<Target>,
}

/// A named point of a tree: a place to navigate to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Its name.
    pub name: String,
    /// Its row.
    pub row: usize,
}

/// Whether a name is that of an opening in a centre line that was computed.
fn is_opening(name: &str) -> bool {
    name.strip_prefix("opening ").is_some_and(|number| number.parse::<usize>().is_ok())
}

impl CentrelineTree {
    /// A tree of `nodes`.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the row if a number is not finite, a radius is below 10⁻⁶ mm, a parent is not an earlier
    /// row, a point coincides with its parent or is farther than 2 m or 250 radii from it, or there is not exactly one root with at least one child.
    pub fn new(nodes: Vec<CentrelineNode>) -> Result<Self> {
        for row in 0..nodes.len() {
            check_row(&nodes, row).map_err(|(column, value, remedy)| {
                Error::parameter(format!("centreline row {row}, {column}"), value, remedy)
            })?;
        }
        if nodes.len() < 2 {
            return Err(Error::parameter("centreline rows", nodes.len(), "a vessel needs at least 2 points"));
        }
        Ok(Self { nodes, closed: Vec::new(), links: Vec::new(), targets: Vec::new() })
    }

    /// The tree with these rows named, replacing earlier names.
    ///
    /// # Errors
    /// A nonexistent row, and a name that a table cannot contain: empty, a number, given twice, with commas,
    /// semicolons, `#` or repeated blanks.
    pub fn with_targets(mut self, targets: Vec<Target>) -> Result<Self> {
        for (index, target) in targets.iter().enumerate() {
            if target.row >= self.nodes.len() {
                let remedy = format!("the tree has {} rows, counted from 0", self.nodes.len());
                return Err(Error::parameter(format!("target {:?}, row", target.name), target.row, remedy));
            }
            check_name(&target.name, &targets[..index])
                .map_err(|remedy| Error::parameter("target", format!("{:?}", target.name), remedy))?;
        }
        self.targets = targets;
        Ok(self)
    }

    /// The tree with the vessel closed at these leaves, replacing earlier ones: by a hemisphere of the leaf's radius,
    /// like the end of an aneurysm's sac.
    ///
    /// # Errors
    /// A nonexistent row, or one that is not a leaf: the root and points with children continue.
    pub fn with_closed_ends(mut self, mut rows: Vec<usize>) -> Result<Self> {
        rows.sort_unstable();
        rows.dedup();
        let children = self.children();
        if let Some(row) =
            rows.iter().find(|row| **row == 0 || !children.get(**row).is_some_and(Vec::is_empty))
        {
            let remedy = "must be the last point of a branch: elsewhere the vessel goes on";
            return Err(Error::parameter("closed end, row", row, remedy));
        }
        if let Some(row) = rows.iter().find(|row| self.joined_by(**row).is_some()) {
            let remedy = "must be the last point of a branch: elsewhere the vessel goes on";
            return Err(Error::parameter("closed end, row", row, remedy));
        }
        self.closed = rows;
        Ok(self)
    }

    /// Rows of the leaves where the vessel is closed by a dome, ascending.
    pub fn closed_ends(&self) -> &[usize] {
        &self.closed
    }

    /// For each row whether it and all its descendants end in closed ends: the sacs of the tree.
    pub(crate) fn in_sacs(&self) -> Vec<bool> {
        let children = self.children();
        let mut inside = vec![false; self.nodes.len()];
        for row in (1..self.nodes.len()).rev() {
            inside[row] = match children[row].as_slice() {
                [] => self.closed.binary_search(&row).is_ok(),
                behind => behind.iter().all(|child| inside[*child]),
            };
        }
        inside
    }

    /// The named points, in the order of the table.
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// The point of this name.
    ///
    /// # Errors
    /// An unknown name, with the most similar one.
    pub fn target(&self, name: &str) -> Result<&Target> {
        self.targets.iter().find(|target| target.name == name).ok_or_else(|| {
            // One number is as near as another: a computed centre line has all openings but those.
            let known: Vec<&str> = self.targets.iter().map(|target| target.name.as_str()).collect();
            if is_opening(name) && known.iter().any(|name| is_opening(name)) {
                let remedy = format!(
                    "the centre line begins at this opening, or does not lead to it; its targets are {}",
                    known.join(", ")
                );
                return Error::parameter("target", format!("{name:?}"), remedy);
            }
            let remedy = match nearest_name(self.targets.iter().map(|target| target.name.as_str()), name) {
                Some(nearest) => format!("did you mean {nearest:?}?"),
                None => {
                    "the vessel names no targets: write them behind the rows of its centre-line table".into()
                }
            };
            Error::parameter("target", format!("{name:?}"), remedy)
        })
    }

    /// The row nearest to a position, or the one behind it: the row at the end of the segment on which the nearest
    /// point of the line is, and that point; on the segment of a link, the row that joins another.
    pub fn nearest(&self, place_mm: &Vec3) -> (usize, Vec3) {
        let on_segment = |(row, to, from): (usize, Vec3, Vec3)| {
            let piece = to - from;
            let part = ((place_mm - from).dot(&piece) / piece.norm_squared()).clamp(0.0, 1.0);
            let on = if part == 1.0 { to } else { from + piece * part };
            (row, on, (on - place_mm).norm())
        };
        let at = |row: usize| self.nodes[row].position_mm;
        let sides = (1..self.nodes.len()).filter_map(|row| Some((row, at(row), at(self.nodes[row].parent?))));
        let links = self.links.iter().map(|link| (link.row, at(link.joins), at(link.row)));
        let nearest = sides.chain(links).map(on_segment).min_by(|a, b| a.2.total_cmp(&b.2));
        nearest.map_or((0, self.nodes[0].position_mm), |(row, on, _)| (row, on))
    }

    /// Reads a table.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read; [`Error::Content`] with line and value for what [`CentrelineTree::new`]
    /// rejects and for what is not a number.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_of(&FileSystem, path)
    }

    /// As [`Self::read`], for a table in `files`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_of(files: &dyn Files, path: &Path) -> Result<Self> {
        Self::from_bytes(&files.read(path, SIZE_LIMIT)?, path)
    }

    /// Reads a table from the bytes of a file; errors name it `path`.
    ///
    /// # Errors
    /// As [`Self::read`], except those of reading the file.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let bad = |reason| Error::content(path, reason);
        if let Some(kind) = foreign(bytes) {
            return Err(bad(kind.to_owned()));
        }
        if swc::is_swc(path) {
            let nodes = swc::parse(&String::from_utf8_lossy(&text::without_mark(bytes)));
            return nodes.and_then(Self::of_nodes).map_err(bad);
        }
        line_files::check_built(path)?;
        match line_files::read(bytes, path) {
            Some(lines) => lines.and_then(|lines| Self::of_lines(&lines)).map_err(bad),
            None => Self::parse(&String::from_utf8_lossy(&text::without_mark(bytes))).map_err(bad),
        }
    }

    /// The tree of lines of points, which begin or end where the first begins.
    fn of_lines(lines: &[Vec<CentrelineNode>]) -> std::result::Result<Self, String> {
        for (number, line) in lines.iter().enumerate() {
            for (index, node) in line.iter().enumerate() {
                check_numbers(node).map_err(|(column, value, remedy)| {
                    format!("line {number}, point {index}: {column} = {value}: {remedy}")
                })?;
            }
        }
        Self::of_nodes(point_lists::joined(lines)?)
    }

    /// The tree of points.
    fn of_nodes(nodes: Vec<CentrelineNode>) -> std::result::Result<Self, String> {
        if nodes.len() < 2 {
            return Err(format!("{} centre-line points; a vessel needs at least 2", nodes.len()));
        }
        Self::new(nodes).map_err(|error| error.to_string())
    }

    /// Reads the text of a table; the error names line and value.
    fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut nodes: Vec<CentrelineNode> = Vec::new();
        let mut targets: Vec<Target> = Vec::new();
        // Closed rows, and their lines.
        let mut closed: Vec<(usize, usize)> = Vec::new();
        // Links, and their lines.
        let mut links: Vec<(CentrelineLink, usize)> = Vec::new();
        let mut may_be_header = true;
        let mut columns: Option<Columns> = None;
        for (index, line) in text.lines().enumerate() {
            let words: Vec<&str> = line
                .split('#')
                .next()
                .unwrap_or_default()
                .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
                .filter(|word| !word.is_empty())
                .collect();
            if words.is_empty() {
                continue;
            }
            let is_header = may_be_header && words.iter().all(|word| word.parse::<f64>().is_err());
            may_be_header = false;
            if is_header {
                columns = Columns::of_header(&words);
                continue;
            }
            // A header may name only the first four columns.
            if nodes.is_empty() && columns.is_some_and(|columns| columns.count != words.len()) {
                columns = None;
            }
            if let Some(columns) = columns {
                let reported = |reason| format!("line {}: {reason}", index + 1);
                if words.len() != columns.count {
                    return Err(reported(format!(
                        "{} values; the header has {}",
                        words.len(),
                        columns.count
                    )));
                }
                let node = columns.point(&words).map_err(reported)?;
                check_numbers(&node)
                    .map_err(|(column, value, remedy)| reported(format!("{column} = {value}: {remedy}")))?;
                nodes.push(node);
                continue;
            }
            let (row, name) = words.split_at(words.len().min(COLUMNS));
            nodes.push(parse_row(row).map_err(|reason| format!("line {}: {reason}", index + 1))?);
            let (name, joins) = split_link(name);
            links.extend(joins.map(|joins| (CentrelineLink { row: nodes.len() - 1, joins }, index + 1)));
            let is_closed = name.last() == Some(&CLOSED);
            closed.extend(is_closed.then(|| (nodes.len() - 1, index + 1)));
            let name = &name[..name.len() - usize::from(is_closed)];
            if !name.is_empty() {
                let name = name.join(" ");
                check_name(&name, &targets)
                    .map_err(|remedy| format!("line {}: target = {name:?}: {remedy}", index + 1))?;
                targets.push(Target { name, row: nodes.len() - 1 });
            }
            check_row(&nodes, nodes.len() - 1).map_err(|(column, value, remedy)| {
                format!("line {}: {column} = {value}: {remedy}", index + 1)
            })?;
        }
        if columns.is_some() {
            nodes = point_lists::tree(&nodes)?;
        }
        if nodes.len() < 2 {
            return Err(format!("{} centre-line points; a vessel needs at least 2", nodes.len()));
        }
        let goes_on = |row: usize| row == 0 || nodes.iter().any(|node| node.parent == Some(row));
        if let Some((_, line)) = closed.iter().find(|(row, _)| goes_on(*row)) {
            return Err(format!(
                "line {line}: closed: must be the last point of a branch: elsewhere the vessel goes on"
            ));
        }
        let closed = closed.into_iter().map(|(row, _)| row).collect();
        let tree = Self { nodes, closed, links: Vec::new(), targets };
        let line_of = |row: &str| {
            let found = links.iter().find(|(link, _)| row == link.row.to_string());
            found.map_or(0, |(_, line)| *line)
        };
        let given = links.iter().map(|(link, _)| *link).collect();
        tree.with_links(given).map_err(|error| match error {
            // The first of several of this value.
            Error::Parameter { name, value, remedy } if name == "link, joins" => {
                let of = links.iter().find(|(link, _)| value == link.joins.to_string());
                format!("line {}: joins = {value}: {remedy}", of.map_or(0, |(_, line)| *line))
            }
            Error::Parameter { value, remedy, .. } => format!("line {}: joins: {remedy}", line_of(&value)),
            other => other.to_string(),
        })
    }

    /// Writes the table below `comment`. Reading it back gives the same bits.
    ///
    /// # Errors
    /// [`Error::File`] if writing fails.
    pub fn write(&self, path: &Path, comment: &str) -> Result<()> {
        crate::file::whole::write_bytes(path, self.table(comment).as_bytes())
            .map_err(|e| Error::file(path, e))
    }

    /// The table as text.
    pub fn table(&self, comment: &str) -> String {
        let mut out: String = comment.lines().map(|line| format!("# {line}\n")).collect();
        out.push_str("x,y,z,radius,parent");
        let is_plain = self.targets.is_empty() && self.closed.is_empty() && self.links.is_empty();
        out.push_str(if is_plain { "\n" } else { ",target\n" });
        for (row, node) in self.nodes.iter().enumerate() {
            let (p, parent) = (node.position_mm, node.parent.map_or(-1, |row| row as i64));
            let name = self.targets.iter().find(|target| target.row == row);
            let closed = self.closed.binary_search(&row).is_ok().then_some(CLOSED);
            let joined = self.joined_by(row).map(|row| format!("{JOINS} {row}"));
            let words = name.map(|target| target.name.as_str()).into_iter().chain(closed);
            let words = words.chain(joined.as_deref()).collect::<Vec<_>>();
            let name = if words.is_empty() { String::new() } else { format!(",{}", words.join(" ")) };
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{},{},{},{},{parent}{name}", p.x, p.y, p.z, node.radius_mm);
        }
        out
    }

    /// The points, parents before children; the first is the root.
    pub fn nodes(&self) -> &[CentrelineNode] {
        &self.nodes
    }

    /// The children of each node, in order.
    pub fn children(&self) -> Vec<Vec<usize>> {
        let mut children = vec![Vec::new(); self.nodes.len()];
        for (row, node) in self.nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                children[parent].push(row);
            }
        }
        children
    }
}

/// Number of values of a row without a name.
const COLUMNS: usize = 5;
/// The last word of a row that closes the vessel.
const CLOSED: &str = "closed";

/// Why a name is invalid as that of a target beside others; `Ok` if it is valid.
fn check_name(name: &str, others: &[Target]) -> std::result::Result<(), String> {
    let words = name.split(|c: char| c.is_whitespace() || c == ',' || c == ';');
    if name.contains('#') || words.clone().any(str::is_empty) || words.collect::<Vec<_>>().join(" ") != name {
        return Err("a name is words with a blank between them, without commas, semicolons and #".into());
    }
    if name.split(' ').next_back() == Some(CLOSED) {
        return Err("ends in the word that closes a vessel in a table: call it otherwise".into());
    }
    if split_link(&name.split(' ').collect::<Vec<_>>()).1.is_some() {
        return Err("ends in the words that join a row to another in a table: call it otherwise".into());
    }
    if name.split(' ').all(|word| word.parse::<f64>().is_ok()) {
        return Err("is a number: a row is x y z radius parent, and a name if the point has one".into());
    }
    match others.iter().any(|other| other.name == name) {
        true => Err("is the name of an earlier row: names are given once".into()),
        false => Ok(()),
    }
}

/// A whole number, possibly written as a decimal: `numpy.savetxt` writes `3.000000000000000000e+00`.
fn whole(word: &str) -> Option<i64> {
    let as_decimal = || word.parse().ok().filter(|number: &f64| number.fract() == 0.0 && number.abs() < 1e15);
    word.parse().ok().or_else(|| as_decimal().map(|number| number as i64))
}

fn parse_row(words: &[&str]) -> std::result::Result<CentrelineNode, String> {
    let [x, y, z, radius, parent] = words else {
        return Err(format!("{} values; expected 5: x y z radius parent", words.len()));
    };
    let number = |name: &str, word: &str| {
        word.parse::<f64>().map_err(|_| format!("{name} = {word:?} is not a number"))
    };
    let parent = whole(parent).ok_or_else(|| format!("parent = {parent:?} is not a whole number"))?;
    Ok(CentrelineNode {
        position_mm: Vec3::new(number("x", x)?, number("y", y)?, number("z", z)?),
        radius_mm: number("radius", radius)?,
        // A negative number other than −1 becomes an impossible row, which is then rejected.
        parent: (parent != -1).then(|| usize::try_from(parent).unwrap_or(usize::MAX)),
    })
}

/// Largest table in bytes: a million points.
const SIZE_LIMIT: u64 = 64 << 20;

/// Largest usable number: distances and their squares stay well inside f64, and no vessel is a kilometre long.
const LARGEST_MM: f64 = 1e6;
/// Distance up to which two points are the same, mm.
pub(super) const COINCIDENT_MM: f64 = 1e-9;
/// Longest distance from a point to its parent, mm, the length of a body; and in radii of the wider of the two, since
/// no vessel is straight for longer. Otherwise a single wrong number would create a vessel that takes minutes, or
/// that intersects itself.
const LONGEST_SEGMENT_MM: f64 = 2000.0;
pub(super) const LONGEST_SEGMENT_RADII: f64 = 250.0;

/// Smallest radius, mm: its powers, as used for flow, stay finite, and no vessel is thinner than a molecule.
const LEAST_RADIUS_MM: f64 = 1e-6;

/// Checks a row against the rows before it; an error is (column, value, correction).
fn check_row(
    nodes: &[CentrelineNode],
    row: usize,
) -> std::result::Result<(), (&'static str, String, String)> {
    let node = &nodes[row];
    check_numbers(node)?;
    match node.parent {
        None if row == 0 => Ok(()),
        None => Err(("parent", "-1".into(), "only the first row is a root; name an earlier row".into())),
        Some(_) if row == 0 => {
            Err(("parent", describe(node.parent), "the first row is the root; its parent is -1".into()))
        }
        Some(parent) if parent >= row => {
            Err(("parent", describe(node.parent), format!("must be an earlier row: this is row {row}")))
        }
        Some(parent) if (nodes[parent].position_mm - node.position_mm).norm() <= COINCIDENT_MM => {
            Err(("parent", describe(node.parent), "the point lies on its parent; remove one of them".into()))
        }
        Some(parent) => {
            let length_mm = (nodes[parent].position_mm - node.position_mm).norm();
            let radius_mm = nodes[parent].radius_mm.max(node.radius_mm);
            let most = if length_mm > LONGEST_SEGMENT_MM {
                format!("{LONGEST_SEGMENT_MM} mm from its parent: check the unit, or points between them")
            } else if length_mm > LONGEST_SEGMENT_RADII * radius_mm {
                format!(
                    "{LONGEST_SEGMENT_RADII} radii from its parent: check its numbers, or give points between them"
                )
            } else {
                return Ok(());
            };
            Err(("parent", describe(node.parent), format!("the point is more than {most}")))
        }
    }
}

/// Checks a single point.
fn check_numbers(node: &CentrelineNode) -> std::result::Result<(), (&'static str, String, String)> {
    for (name, value) in ["x", "y", "z"].into_iter().zip(node.position_mm.iter()) {
        if value.is_nan() || value.abs() > LARGEST_MM {
            return Err((name, value.to_string(), format!("must be finite and at most {LARGEST_MM} mm")));
        }
    }
    if !(LEAST_RADIUS_MM..=LARGEST_MM).contains(&node.radius_mm) {
        let remedy = format!("must be {LEAST_RADIUS_MM} to {LARGEST_MM} mm");
        return Err(("radius", crate::error::number(node.radius_mm), remedy));
    }
    Ok(())
}

fn describe(parent: Option<usize>) -> String {
    parent.map_or("-1".into(), |p| if p == usize::MAX { "a negative row".into() } else { p.to_string() })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn blanks_commas_comments_and_a_header_read_to_the_same_tree() {
        let plain = CentrelineTree::parse("0 0 0 2 -1\n0 0 5 1.5 0\n0 0 9 1 1\n0 3 9 1 1\n").unwrap();
        let dressed = "# a vessel\n\nx,y,z,radius,parent\n0,0,0,2,-1\n0, 0, 5, 1.5, 0 # bend\r\n0;0;9;1;1\n0\t3\t9\t1\t1";
        assert_eq!(CentrelineTree::parse(dressed).unwrap(), plain);
        assert_eq!(plain.children(), [vec![1], vec![2, 3], vec![], vec![]]);
    }

    #[test]
    fn every_error_names_line_and_value() {
        for (table, expected) in [
            ("0 0 0 1 -1\n0 0 nan 1 0", "line 2: z = NaN"),
            ("0 0 0 1 -1\n0 0 inf 1 0", "line 2: z = inf"),
            ("0 0 0 0 -1", "line 1: radius = 0"),
            ("0 0 0 1e-300 -1", "line 1: radius = 1e-300: must be 0.000001 to 1000000 mm"),
            ("# c\n0 0 0 1 -1\n0 0 1 -2 0", "line 3: radius = -2"),
            ("0 0 0 1 -1\n0 0 1 1 7", "line 2: parent = 7"),
            ("0 0 0 1 -1\n0 0 1 1 1", "line 2: parent = 1"),
            ("0 0 0 1 -1\n0 0 1 1 -3", "line 2: parent = a negative row"),
            ("0 0 0 1 -1\n0 0 1 1 -1", "line 2: parent = -1: only the first"),
            ("0 0 0 1 0", "line 1: parent = 0: the first"),
            ("0 0 0 1 -1\n0 0 0 1 0", "line 2: parent = 0: the point lies on its parent"),
            ("0 0 0 1 -1\n0 0 9999 1 0", "line 2: parent = 0: the point is more than 2000 mm"),
            ("0 0 0 1 -1\n0 0 251 1 0", "line 2: parent = 0: the point is more than 250 radii"),
            ("0 0 0 1 -1\n0 0 1 1 0.5", "line 2: parent = \"0.5\""),
            ("0 0 0 1 -1\n0 0 one 1 0", "line 2: z = \"one\""),
            ("0 0 0 1 -1\n0 0 1 1", "line 2: 4 values"),
            ("0 0 0 1 -1\n0 0 1 1 0 7", "line 2: target = \"7\": is a number"),
            ("0 0 0 1 -1 end\n0 0 1 1 0 end", "line 2: target = \"end\": is the name of an earlier row"),
            ("0 0 0 1 -1\n0 0 1 1 0 closed\n0 0 2 1 1", "line 2: closed: must be the last point"),
            ("", "0 centre-line points"),
            ("0 0 0 1 -1", "1 centre-line points"),
        ] {
            let reason = CentrelineTree::parse(table).unwrap_err();
            assert!(reason.starts_with(expected), "{table:?}: {reason}");
        }
    }

    #[test]
    fn a_row_may_close_the_vessel_with_a_name_or_without() {
        let table =
            "0 0 0 2 -1\n0 0 9 2 0\n0 0 20 2 1 distal\n0 3 9 2 1\n0 6 9 3 3 dome closed\n0 -3 9 2 1 closed\n";
        let tree = CentrelineTree::parse(table).unwrap();
        assert_eq!(tree.closed_ends(), [4, 5]);
        assert_eq!(tree.target("dome").unwrap().row, 4);
        assert_eq!(tree.targets().len(), 2);
        assert_eq!(CentrelineTree::parse(&tree.table("")).unwrap(), tree);
        assert_eq!(tree.in_sacs(), [false, false, false, true, true, true]);
        // It is part of the vessel's shape.
        let open = CentrelineTree::new(tree.nodes().to_vec()).unwrap();
        let json = |tree: &CentrelineTree| serde_json::to_string(tree).unwrap();
        assert!(json(&open) != json(&tree));
        let named = |name: &str| open.clone().with_targets(vec![Target { name: name.into(), row: 2 }]);
        assert!(named("end closed").is_err() && named("closed end").is_ok());
    }

    #[test]
    fn a_path_ends_at_the_point_of_the_line_nearest_to_a_place() {
        let tree = CentrelineTree::parse("0 0 0 2 -1\n0 0 10 2 0\n0 0 30 4 1\n0 20 10 1 1\n").unwrap();
        let path = |x: f64, y: f64, z: f64| tree.path_to_place(&Vec3::new(x, y, z)).unwrap();
        // Between rows, beside the line.
        let between = path(1.0, -0.5, 25.0);
        assert!(
            (between.length_mm() - 25.0).abs() < 1e-12
                && (between.end_mm() - Vec3::z() * 25.0).norm() < 1e-12
        );
        assert!((between.points()[2].1 - 3.5).abs() < 1e-12, "{:?}", between.points());
        // At rows, and beyond the last, it is that to the row.
        for row in 1..4 {
            let at = tree.nodes()[row].position_mm;
            assert_eq!(tree.path_to_place(&at), tree.path_to(row), "{row}");
        }
        assert_eq!(path(0.0, 25.0, 10.0), tree.path_to(3).unwrap());
        assert!((path(0.0, 3.0, 10.5).length_mm() - 13.0).abs() < 1e-12);
        assert_eq!(tree.path_to_place(&Vec3::new(0.0, 0.0, -3.0)), None);
        assert_eq!(tree.path_to(0), None);
    }

    #[test]
    fn the_opening_where_a_computed_line_begins_is_no_target() {
        let table = "0,0,0,2,-1\n0,0,5,1.5,0,opening 0\n0 3 9 1 0 opening 2\n";
        let reported = CentrelineTree::parse(table).unwrap().target("opening 1").unwrap_err().to_string();
        let expected = "the centre line begins at this opening, or does not lead to it; its targets are opening 0, opening 2";
        assert!(reported.ends_with(expected), "{reported}");
    }

    #[test]
    fn names_behind_rows_are_targets_and_unknown_ones_get_the_nearest() {
        let table = "x,y,z,radius,parent,target\n0,0,0,2,-1\n0,0,5,1.5,0,left carotid\n0 0 9 1 1 tip of  the vessel\n";
        let tree = CentrelineTree::parse(table).unwrap();
        assert_eq!(tree.target("tip of the vessel").unwrap().row, 2);
        assert_eq!(CentrelineTree::parse(&tree.table("")).unwrap(), tree);
        let reported = |tree: &CentrelineTree, name: &str| tree.target(name).unwrap_err().to_string();
        assert_eq!(
            reported(&tree, "left carotd"),
            "target = \"left carotd\": did you mean \"left carotid\"?"
        );
        let nameless = CentrelineTree::new(tree.nodes().to_vec()).unwrap();
        assert!(reported(&nameless, "a").contains("names no targets"));
        // Names are not part of a wall's recipe.
        let json = |tree: &CentrelineTree| serde_json::to_string(tree).unwrap();
        assert_eq!(json(&nameless), json(&tree));
        for (row, name) in [(3, "a"), (1, ""), (1, "a,b"), (1, "a  b"), (1, "1e3"), (1, "a#")] {
            let target = Target { name: name.into(), row };
            assert!(nameless.clone().with_targets(vec![target]).is_err(), "{row} {name:?}");
        }
    }

    proptest! {
        #![proptest_config(crate::vessel::tests::steady(100))]
        #[test]
        fn a_table_reads_back_to_the_same_bits(
            rows in prop::collection::vec((prop::array::uniform3(-2e2f64..2e2), 3.0f64..50.0, any::<prop::sample::Index>()), 2..30)
        ) {
            let nodes = rows.iter().enumerate().map(|(row, (p, radius_mm, parent))| CentrelineNode {
                position_mm: Vec3::from(*p), radius_mm: *radius_mm, parent: (row > 0).then(|| parent.index(row)),
            }).collect();
            let tree = CentrelineTree::new(nodes).unwrap();
            let text = tree.table("two\nlines");
            prop_assert_eq!(&CentrelineTree::parse(&text).unwrap(), &tree);
            // Counter-check: one changed digit gives a different tree.
            let mut moved = tree.nodes().to_vec();
            moved[0].radius_mm *= 1.0 + 1e-15;
            prop_assert_ne!(CentrelineTree::new(moved).unwrap(), tree);
        }

        #[test]
        fn noise_never_panics(text in "([-0-9. ,\n#]|nan|inf|e)*") {
            let _ = CentrelineTree::parse(&text);
        }
    }
}
