//! Closing links: where two branches of a centre line meet again.
//!
//! A centre line stays a tree, since most of what uses one needs each point to have a single way from the root. In a
//! ring, as the circle of Willis, one arm is a branch like any other whose last point, a leaf of the tree, is joined
//! to a point of another branch by a link. The straight stretch from the leaf to that point belongs to the arm. Tree
//! and links together are the graph of the vessel: as many links as the vessel has rings.

use serde::Serialize;

use super::CentrelineTree;
use super::centreline::{COINCIDENT_MM, LONGEST_SEGMENT_RADII};
use crate::{Error, Result};

/// A leaf of a tree at which the vessel does not end: it goes on to another point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct CentrelineLink {
    /// Row of the leaf.
    pub row: usize,
    /// Row of the point that it joins.
    pub joins: usize,
}

impl CentrelineTree {
    /// The tree with its leaves joined to other points by these links, replacing earlier ones.
    ///
    /// # Errors
    /// A row that does not exist, is not a leaf, is closed, or joins twice; a joined row that does not exist, is the
    /// row's parent or itself, or is farther away than a parent may be.
    pub fn with_links(mut self, mut links: Vec<CentrelineLink>) -> Result<Self> {
        links.sort_unstable_by_key(|link| (link.row, link.joins));
        let children = self.children();
        for (index, link) in links.iter().enumerate() {
            let is_leaf = link.row > 0 && children.get(link.row).is_some_and(Vec::is_empty);
            if !is_leaf {
                let remedy = "must be the last point of a branch: only there a branch joins another";
                return Err(Error::parameter("link, row", link.row, remedy));
            }
            if self.closed_ends().binary_search(&link.row).is_ok() {
                let remedy = "is closed by a dome, and cannot go on: take away one of the two";
                return Err(Error::parameter("link, row", link.row, remedy));
            }
            if index > 0 && links[index - 1].row == link.row {
                let remedy = "joins two points: keep one of them";
                return Err(Error::parameter("link, row", link.row, remedy));
            }
            self.check_joined(*link).map_err(|remedy| Error::parameter("link, joins", link.joins, remedy))?;
        }
        self.links = links;
        Ok(self)
    }

    /// Why a leaf cannot join a row.
    fn check_joined(&self, link: CentrelineLink) -> std::result::Result<(), String> {
        let nodes = self.nodes();
        let leaf = &nodes[link.row];
        let Some(joined) = nodes.get(link.joins) else {
            return Err(format!("the tree has {} rows, counted from 0", nodes.len()));
        };
        if link.joins == link.row || leaf.parent == Some(link.joins) {
            return Err("is the row itself or the one before it: name a point of another branch".into());
        }
        let length_mm = (joined.position_mm - leaf.position_mm).norm();
        if length_mm <= COINCIDENT_MM {
            return Err(
                "lies on the row that joins it: remove that row, and let the one before it join".into()
            );
        }
        if length_mm > LONGEST_SEGMENT_RADII * leaf.radius_mm.max(joined.radius_mm) {
            return Err(format!(
                "is more than {LONGEST_SEGMENT_RADII} radii from the row that joins it: give points between them"
            ));
        }
        Ok(())
    }

    /// Its closing links, by their rows; empty for a vessel without rings.
    pub fn links(&self) -> &[CentrelineLink] {
        &self.links
    }

    /// The row that a leaf joins, if it does.
    pub(crate) fn joined_by(&self, row: usize) -> Option<usize> {
        let found = self.links.binary_search_by_key(&row, |link| link.row).ok()?;
        Some(self.links[found].joins)
    }

    /// The rows next to each row: its parent, its children, and those that links join it to.
    pub(crate) fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut beside = vec![Vec::new(); self.nodes().len()];
        let sides = self.nodes().iter().enumerate().filter_map(|(row, node)| Some((row, node.parent?)));
        for (a, b) in sides.chain(self.links.iter().map(|link| (link.row, link.joins))) {
            beside[a].push(b);
            beside[b].push(a);
        }
        beside
    }
}

/// The words behind a row's name that join it to another one, as `joins 17`, and the words before them.
pub(super) fn split_link<'a>(words: &'a [&'a str]) -> (&'a [&'a str], Option<usize>) {
    match words {
        [name @ .., JOINS, row] => match row.parse() {
            Ok(row) => (name, Some(row)),
            Err(_) => (words, None),
        },
        _ => (words, None),
    }
}

/// The word before the number of a joined row.
pub(super) const JOINS: &str = "joins";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::vessel::CentrelineNode;

    /// A line of three points with a side branch of two.
    fn tree() -> CentrelineTree {
        let node = |x: f64, y: f64, parent| CentrelineNode {
            position_mm: Vec3::new(x, y, 0.0),
            radius_mm: 1.0,
            parent,
        };
        let nodes = vec![
            node(0.0, 0.0, None),
            node(10.0, 0.0, Some(0)),
            node(20.0, 0.0, Some(1)),
            node(5.0, 10.0, Some(0)),
            node(15.0, 10.0, Some(3)),
        ];
        CentrelineTree::new(nodes).unwrap()
    }

    fn linked(row: usize, joins: usize) -> Result<CentrelineTree> {
        tree().with_links(vec![CentrelineLink { row, joins }])
    }

    #[test]
    fn a_link_is_written_read_and_part_of_the_shape() {
        let ring = linked(4, 1).unwrap();
        assert_eq!((ring.joined_by(4), ring.joined_by(2)), (Some(1), None));
        let read = |tree: &CentrelineTree| {
            CentrelineTree::from_bytes(tree.table("").as_bytes(), "a.csv".as_ref()).unwrap()
        };
        assert_eq!(read(&ring), ring);
        let target = crate::vessel::Target { name: "far arm".into(), row: 4 };
        let named = ring.clone().with_targets(vec![target]).unwrap();
        assert!(named.table("").contains(",far arm joins 1\n"), "{}", named.table(""));
        assert_eq!(read(&named), named);
        let json = |tree: &CentrelineTree| serde_json::to_string(tree).unwrap();
        assert!(json(&ring) != json(&tree()) && !json(&tree()).contains("links"));
        // A leaf that goes on is not the end of a sac.
        assert_eq!(ring.in_sacs(), [false; 5]);
        assert_eq!(ring.neighbours()[1], [0, 2, 4]);
    }

    #[test]
    fn what_is_no_link_is_refused() {
        for (row, joins, reported) in [
            (1, 4, "link, row = 1: must be the last"),
            (9, 1, "link, row = 9: must be the last"),
            (4, 9, "link, joins = 9: the tree has 5 rows"),
            (4, 3, "link, joins = 3: is the row itself or the one before"),
            (4, 4, "link, joins = 4: is the row itself"),
        ] {
            let error = linked(row, joins).unwrap_err().to_string();
            assert!(error.starts_with(reported), "{error}");
        }
        let table = "0 0 0 1 -1\n9 0 0 1 0\n9 9 0 1 1\n0 9 0 1 2 joins 0\n";
        let read = |text: &str| CentrelineTree::from_bytes(text.as_bytes(), "a.csv".as_ref());
        assert_eq!(read(table).unwrap().links(), [CentrelineLink { row: 3, joins: 0 }]);
        let error = read(&table.replace("joins 0", "joins 7")).unwrap_err().to_string();
        assert!(error.contains("line 4: joins = 7: the tree has 4 rows"), "{error}");
        let error = read(&table.replace("joins 0", "joins 2")).unwrap_err().to_string();
        assert!(error.contains("line 4: joins = 2: is the row itself"), "{error}");
    }
}
