//! Where a tip was to go, and which branches it went into.

use endowire_core::vessel::{CentrelinePath, CentrelineTree};
use endowire_core::{Result, Vec3};

/// The way through a tree to a place.
#[derive(Debug, Clone)]
pub struct Way {
    tree: CentrelineTree,
    path: CentrelinePath,
    /// The rows that are no wrong ways: those of the path and beyond its end.
    right: Vec<bool>,
    /// Row where the path's vessel first divides.
    first_fork: Option<usize>,
    target_mm: Option<(Vec3, f64)>,
    /// The hand whose instrument is to arrive; the foremost tip where there is none.
    pub(crate) instrument: Option<usize>,
}

impl Way {
    /// The way to a target of the tree, at which what is within some mm of it has arrived.
    ///
    /// # Errors
    /// [`endowire_core::Error::Parameter`] for a target that is not there, or where the tree begins.
    pub fn to_target(tree: &CentrelineTree, name: &str, within_mm: f64) -> Result<Option<Self>> {
        let place_mm = tree.nodes()[tree.target(name)?.row].position_mm;
        Ok(Self::towards(tree, place_mm, within_mm))
    }

    /// The same for the tip of a hand's instrument: it is that which arrives.
    #[must_use]
    pub fn for_instrument(self, hand: usize) -> Self {
        Self { instrument: Some(hand), ..self }
    }

    /// The hand whose instrument is to arrive; none where the foremost tip is.
    pub fn instrument(&self) -> Option<usize> {
        self.instrument
    }

    /// The way to a place nobody named: there is no arrival at it. None where the tree begins.
    pub fn to_place(tree: &CentrelineTree, place_mm: &Vec3) -> Option<Self> {
        Self::to_row(tree, tree.nearest_row(place_mm))
    }

    /// The way to a place, at which what is within some mm of it has arrived. None where the tree begins.
    pub fn towards(tree: &CentrelineTree, place_mm: Vec3, within_mm: f64) -> Option<Self> {
        let way = Self::to_place(tree, &place_mm)?;
        Some(Self { target_mm: Some((place_mm, within_mm)), ..way })
    }

    fn to_row(tree: &CentrelineTree, row: usize) -> Option<Self> {
        let path = tree.path_to(row)?;
        let (nodes, children) = (tree.nodes(), tree.children());
        let mut right = vec![false; nodes.len()];
        let (mut at, mut first_fork) = (Some(row), None);
        while let Some(of) = at {
            right[of] = true;
            if children[of].len() > 1 {
                first_fork = Some(of);
            }
            at = nodes[of].parent;
        }
        let mut beyond = children[row].clone();
        while let Some(of) = beyond.pop() {
            right[of] = true;
            beyond.extend(&children[of]);
        }
        Some(Self { tree: tree.clone(), path, right, first_fork, target_mm: None, instrument: None })
    }

    /// The target, and how near to it is there, mm.
    pub fn target_mm(&self) -> Option<(Vec3, f64)> {
        self.target_mm
    }

    /// Length along the way between two places, mm.
    pub(crate) fn length_mm(&self, from: &Vec3, to: &Vec3) -> f64 {
        (self.path.nearest(to).arc_mm - self.path.nearest(from).arc_mm).abs()
    }

    /// The wrong branch that a place is in, deeper than its radius: the first of its rows. None on the way.
    pub(crate) fn wrong_branch(&self, place: &Vec3) -> Option<usize> {
        let nodes = self.tree.nodes();
        // A row stands for the stretch from the one before.
        let deep = |row: &usize| {
            let (to, from) = (&nodes[*row], &nodes[nodes[*row].parent.unwrap_or(*row)]);
            let piece = to.position_mm - from.position_mm;
            let part = (place - from.position_mm).dot(&piece) / piece.norm_squared().max(f64::MIN_POSITIVE);
            (from.position_mm + piece * part.clamp(0.0, 1.0) - place).norm() - to.radius_mm
        };
        let mut at = (0..nodes.len()).min_by(|a, b| deep(a).total_cmp(&deep(b)))?;
        let on = self.path.nearest(place);
        // A tip that slides along the wall dips into the mouths that it passes.
        if self.right[at] || on.distance_mm <= on.radius_mm + nodes[at].radius_mm {
            return None;
        }
        while let Some(before) = nodes[at].parent.filter(|before| !self.right[*before]) {
            at = before;
        }
        Some(at)
    }

    /// Whether a place is beyond the way's first fork, out of the vessel that it begins in.
    pub(crate) fn is_past_first_fork(&self, place: &Vec3) -> Option<bool> {
        let fork = &self.tree.nodes()[self.first_fork?];
        let arc_mm = self.path.nearest(&fork.position_mm).arc_mm;
        Some(self.path.nearest(place).arc_mm > arc_mm + fork.radius_mm)
    }
}
