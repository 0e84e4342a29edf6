//! The way of a tip to its target, and wrong branches.

use endowire_core::vessel::{CentrelinePath, CentrelineTree};
use endowire_core::{Result, Vec3};

use crate::record::Record;

/// The way through a centre-line tree to a place.
#[derive(Debug, Clone)]
pub struct Way {
    tree: CentrelineTree,
    path: CentrelinePath,
    /// Rows that are not in a wrong branch: those on the path and beyond its end.
    right: Vec<bool>,
    /// Row of the first fork along the path.
    first_fork: Option<usize>,
    target_mm: Option<(Vec3, f64)>,
    /// Index of the one of several instruments that must arrive; `None` for the foremost tip.
    pub(crate) instrument: Option<usize>,
}

impl Way {
    /// The way to a named target of the tree; a tip within `within_mm` of it has arrived. `None` if the target is
    /// where the tree begins.
    ///
    /// # Errors
    /// [`endowire_core::Error::Parameter`] if no target has this name.
    pub fn to_target(tree: &CentrelineTree, name: &str, within_mm: f64) -> Result<Option<Self>> {
        let place_mm = tree.nodes()[tree.target(name)?.row].position_mm;
        Ok(Self::towards(tree, place_mm, within_mm))
    }

    /// The way on which a record is measured: to the named target if there is one, otherwise to where its tip ended.
    ///
    /// # Errors
    /// As [`Self::to_target`].
    pub fn of_record(
        record: &Record,
        tree: &CentrelineTree,
        target: Option<&str>,
        within_mm: f64,
    ) -> Result<Option<Self>> {
        match (target, record.samples.iter().rev().find_map(|sample| sample.tip_mm)) {
            (Some(name), _) => Self::to_target(tree, name, within_mm),
            (None, Some(place_mm)) => Ok(Self::to_place(tree, &place_mm)),
            (None, None) => Ok(None),
        }
    }

    /// The same way for the tip of one of several instruments, by its index.
    #[must_use]
    pub fn for_instrument(self, hand: usize) -> Self {
        Self { instrument: Some(hand), ..self }
    }

    /// Index of the instrument that must arrive; `None` for the foremost tip.
    pub fn instrument(&self) -> Option<usize> {
        self.instrument
    }

    /// The way to a place that is not a target, so there is no arrival. `None` if the tree begins there.
    pub fn to_place(tree: &CentrelineTree, place_mm: &Vec3) -> Option<Self> {
        let path = tree.path_to_place(place_mm)?;
        let (row, end_mm) = tree.nearest(place_mm);
        let (nodes, children) = (tree.nodes(), tree.children());
        // In a ring either arm leads there.
        let mut right = tree.on_ways_to(row);
        let is_fork = |of: &usize| {
            let is_reached = *of != row || end_mm == nodes[row].position_mm;
            children[*of].len() > 1 && is_reached
        };
        let first_fork = tree.rows_to(row)?.into_iter().find(is_fork);
        let mut beyond = children[row].clone();
        while let Some(of) = beyond.pop() {
            right[of] = true;
            beyond.extend(&children[of]);
        }
        Some(Self { tree: tree.clone(), path, right, first_fork, target_mm: None, instrument: None })
    }

    /// The way to a place; a tip within `within_mm` of it has arrived. `None` if the tree begins there.
    pub fn towards(tree: &CentrelineTree, place_mm: Vec3, within_mm: f64) -> Option<Self> {
        let way = Self::to_place(tree, &place_mm)?;
        Some(Self { target_mm: Some((place_mm, within_mm)), ..way })
    }

    /// The target, and the distance within which a tip has arrived, mm.
    pub fn target_mm(&self) -> Option<(Vec3, f64)> {
        self.target_mm
    }

    /// Length along the way between two places, mm.
    pub(crate) fn length_mm(&self, from: &Vec3, to: &Vec3) -> f64 {
        (self.path.nearest(to).arc_mm - self.path.nearest(from).arc_mm).abs()
    }

    /// Part of the way from the first of these places that they cover, 0 to 1, not counting those in a wrong branch.
    pub(crate) fn covered(&self, mut places: impl Iterator<Item = Vec3>) -> f64 {
        let arc_mm = |place: &Vec3| self.path.nearest(place).arc_mm;
        let Some(begun_mm) = places.next().map(|place| arc_mm(&place)) else { return 0.0 };
        let right = places.filter(|place| self.wrong_branch(place).is_none()).map(|place| arc_mm(&place));
        let farthest_mm = right.fold(begun_mm, f64::max);
        let way_mm = (self.path.length_mm() - begun_mm).max(f64::MIN_POSITIVE);
        (farthest_mm - begun_mm) / way_mm
    }

    /// First row of the wrong branch that a place is in, if it is deeper in it than the radius. `None` on the way.
    pub(crate) fn wrong_branch(&self, place: &Vec3) -> Option<usize> {
        let nodes = self.tree.nodes();
        // A row represents the stretch from its parent.
        let deep = |row: &usize| {
            let (to, from) = (&nodes[*row], &nodes[nodes[*row].parent.unwrap_or(*row)]);
            let piece = to.position_mm - from.position_mm;
            let part = (place - from.position_mm).dot(&piece) / piece.norm_squared().max(f64::MIN_POSITIVE);
            (from.position_mm + piece * part.clamp(0.0, 1.0) - place).norm() - to.radius_mm
        };
        let mut at = (0..nodes.len()).min_by(|a, b| deep(a).total_cmp(&deep(b)))?;
        let on = self.path.nearest(place);
        // A tip that slides along the wall dips into the ostia that it passes.
        if self.right[at] || on.distance_mm <= on.radius_mm + nodes[at].radius_mm {
            return None;
        }
        while let Some(before) = nodes[at].parent.filter(|before| !self.right[*before]) {
            at = before;
        }
        Some(at)
    }

    /// Whether a place is beyond the first fork, outside the vessel in which the way begins; `None` if there is no
    /// fork.
    pub(crate) fn is_past_first_fork(&self, place: &Vec3) -> Option<bool> {
        let fork = &self.tree.nodes()[self.first_fork?];
        let arc_mm = self.path.nearest(&fork.position_mm).arc_mm;
        Some(self.path.nearest(place).arc_mm > arc_mm + fork.radius_mm)
    }
}
