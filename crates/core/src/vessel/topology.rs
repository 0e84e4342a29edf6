//! Triangles at the edges of a mesh.

/// Marks an edge without a single partner: open, or shared by more than two triangles.
pub(crate) const NONE: u32 = u32::MAX;

/// One use of an undirected edge by a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EdgeUse {
    /// Smaller vertex index.
    pub(crate) low: u32,
    /// Larger vertex index.
    pub(crate) high: u32,
    /// The triangle.
    pub(crate) triangle: u32,
    /// Which of its edges: `k` runs from corner `k` to corner `k + 1`.
    pub(crate) side: u8,
    /// Whether the triangle runs along the edge from `low` to `high`.
    pub(crate) forward: bool,
}

/// All edge uses, sorted by edge and then by triangle, so that everything derived from them is deterministic.
#[derive(Debug, Clone)]
pub(crate) struct EdgeTable {
    uses: Vec<EdgeUse>,
}

impl EdgeTable {
    /// Sorts the edges of `triangles`: by counting their smaller vertex, then by the larger one among the few that
    /// share it. Triangles with a repeated vertex are skipped.
    pub(crate) fn new(triangles: &[[u32; 3]]) -> Self {
        let whole = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let vertices = triangles.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        // Position of the first use of each vertex as the smaller one, advanced as uses are stored.
        let mut place = vec![0_u32; vertices + 1];
        for t in triangles.iter().filter(whole) {
            for side in 0..3 {
                place[t[side].min(t[(side + 1) % 3]) as usize + 1] += 1;
            }
        }
        for v in 0..vertices {
            place[v + 1] += place[v];
        }
        let mut ends = place.clone();
        let blank = EdgeUse { low: 0, high: 0, triangle: 0, side: 0, forward: false };
        let mut uses = vec![blank; place[vertices] as usize];
        for (index, t) in triangles.iter().enumerate().filter(|(_, t)| whole(t)) {
            for side in 0..3 {
                let (from, to) = (t[side], t[(side + 1) % 3]);
                let (low, high) = (from.min(to), from.max(to));
                let end = &mut ends[low as usize];
                uses[*end as usize] =
                    EdgeUse { low, high, triangle: index as u32, side: side as u8, forward: from < to };
                *end += 1;
            }
        }
        for v in 0..vertices {
            uses[place[v] as usize..place[v + 1] as usize].sort_unstable();
        }
        Self { uses }
    }

    /// The uses of each edge, edge after edge.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[EdgeUse]> {
        self.uses.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
    }

    /// The uses of the edge between two vertices.
    pub(crate) fn uses(&self, a: u32, b: u32) -> &[EdgeUse] {
        let key = (a.min(b), a.max(b));
        let first = self.uses.partition_point(|u| (u.low, u.high) < key);
        let count = self.uses[first..].iter().take_while(|u| (u.low, u.high) == key).count();
        &self.uses[first..first + count]
    }

    /// Number of edges shared by more than two triangles.
    pub(crate) fn non_manifold(&self) -> usize {
        self.edges().filter(|uses| uses.len() > 2).count()
    }

    /// For every triangle and side, the triangle across it, or [`NONE`] unless exactly two triangles share the edge.
    pub(crate) fn neighbours(&self, triangle_count: usize) -> Vec<[u32; 3]> {
        let mut across = vec![[NONE; 3]; triangle_count];
        for uses in self.edges() {
            if let [a, b] = uses {
                across[a.triangle as usize][a.side as usize] = b.triangle;
                across[b.triangle as usize][b.side as usize] = a.triangle;
            }
        }
        across
    }

    /// For every triangle, the index of its connected component (triangles that share an edge are connected), and the
    /// number of components. Components are numbered by their first triangle.
    pub(crate) fn components(&self, triangle_count: usize) -> (Vec<u32>, usize) {
        let mut sets = DisjointSets::new(triangle_count);
        for uses in self.edges() {
            for other in &uses[1..] {
                sets.join(uses[0].triangle, other.triangle);
            }
        }
        sets.number()
    }
}

/// The edges of a mesh under repair, sorted anew only after a change.
#[derive(Debug, Default)]
pub(crate) struct Edges {
    table: Option<EdgeTable>,
}

impl Edges {
    /// The edges of `triangles`, which must not have changed since [`Edges::changed`] was last called.
    pub(crate) fn of(&mut self, triangles: &[[u32; 3]]) -> &EdgeTable {
        self.table.get_or_insert_with(|| EdgeTable::new(triangles))
    }

    /// To be called after a triangle has changed.
    pub(crate) fn changed(&mut self) {
        self.table = None;
    }
}

/// Union–find in which the smallest member represents its set, so that the result does not depend on order.
#[derive(Debug)]
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    pub(crate) fn new(len: usize) -> Self {
        Self { parent: (0..len as u32).collect() }
    }

    /// The smallest member of the set of `item`.
    pub(crate) fn find(&mut self, mut item: u32) -> u32 {
        while self.parent[item as usize] != item {
            let grandparent = self.parent[self.parent[item as usize] as usize];
            self.parent[item as usize] = grandparent;
            item = grandparent;
        }
        item
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// An index per item, equal within a set, in order of smallest members; and the number of sets.
    pub(crate) fn number(&mut self) -> (Vec<u32>, usize) {
        let mut numbers = vec![0; self.parent.len()];
        let mut count = 0;
        for item in 0..self.parent.len() {
            let root = self.find(item as u32) as usize;
            if root == item {
                numbers[item] = count;
                count += 1;
            } else {
                numbers[item] = numbers[root];
            }
        }
        (numbers, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_on_an_edge_are_neighbours_and_a_third_makes_it_non_manifold() {
        let pair = [[0, 1, 2], [2, 1, 3]];
        let table = EdgeTable::new(&pair);
        assert_eq!(table.neighbours(2), [[NONE, 1, NONE], [0, NONE, NONE]]);
        assert_eq!(table.non_manifold(), 0);
        let fin = EdgeTable::new(&[[0, 1, 2], [2, 1, 3], [1, 2, 4]]);
        assert_eq!(fin.non_manifold(), 1);
        assert_eq!(fin.neighbours(3)[0], [NONE; 3]);
    }

    #[test]
    fn components_are_numbered_by_their_first_triangle() {
        let (component, count) = EdgeTable::new(&[[5, 6, 7], [0, 1, 2], [2, 1, 3], [6, 5, 8]]).components(4);
        assert_eq!((component, count), (vec![0, 1, 1, 0], 2));
    }
}
