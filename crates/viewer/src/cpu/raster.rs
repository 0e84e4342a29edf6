//! Watertight scan conversion of projected triangles.
//!
//! A pixel centre belongs to a triangle if it is left of its three edges. Signed depth needs more than that: where
//! triangles share edges and vertices, every centre must belong to exactly one of those facing the same way, even if
//! it is *on* an edge or vertex. Three rules ensure that:
//!
//! - An edge function is evaluated with its ends in lexicographic order and negated where the triangle runs
//!   the other way. Both neighbours then compute the same number, rounding included.
//! - A zero counts as positive for the ordered edge. This is the sign for a centre moved by (−ε², ε), a
//!   single infinitesimal displacement for all edges (Edelsbrunner and Mücke, Simulation of Simplicity,
//!   1990), so decisions agree around a vertex too.
//! - Corners are rounded to 2⁻²⁰ pixel. A centre is then either exactly a corner, where edge functions are
//!   exactly zero, or further from it than rounding reaches.

/// Corners are rounded to multiples of its inverse.
pub(crate) const GRID: f64 = (1 << 20) as f64;

/// A triangle in pixel coordinates, columns rightwards and rows downwards.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScreenTriangle {
    corners: [[f64; 2]; 3],
    area2: f64,
}

/// A corner rounded to the grid.
#[inline]
pub(crate) fn on_grid([x, y]: [f64; 2]) -> [f64; 2] {
    [(x * GRID).round() / GRID, (y * GRID).round() / GRID]
}

impl ScreenTriangle {
    /// `None` for one without area, which covers no centre.
    pub(crate) fn new([a, b, c]: [[f64; 2]; 3]) -> Option<Self> {
        Self::on_grid([on_grid(a), on_grid(b), on_grid(c)])
    }

    /// As [`Self::new`], for corners from [`on_grid`].
    #[inline]
    pub(crate) fn on_grid(corners: [[f64; 2]; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let area2 = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        (area2 != 0.0 && area2.is_finite()).then_some(Self { corners, area2 })
    }

    /// Twice the area, negative where the corners run counter-clockwise on the screen.
    pub(crate) fn area2(&self) -> f64 {
        self.area2
    }

    /// Columns and rows of an image whose centres it may cover.
    #[inline]
    pub(crate) fn frame(&self, [width, height]: [u32; 2]) -> [std::ops::Range<usize>; 2] {
        let [a, b, c] = self.corners;
        [pixel_range([a[0], b[0], c[0]], width), pixel_range([a[1], b[1], c[1]], height)]
    }

    /// Calls `visit(x, y, weights)` for every pixel of a `size` image whose centre is covered. The weights belong to
    /// the corners and are not negative; they are not normalised, but their sum is not zero.
    pub(crate) fn scan(&self, size: [u32; 2], visit: impl FnMut(usize, usize, [f64; 3])) {
        self.scan_rows(size[0], 0..size[1], visit);
    }

    /// The same for some rows of an image of the given width.
    pub(crate) fn scan_rows(
        &self,
        width: u32,
        rows: std::ops::Range<u32>,
        mut visit: impl FnMut(usize, usize, [f64; 3]),
    ) {
        // Loops are inlined where maps of arrays are not: most triangles of a body cover one centre or none.
        let [a, b, c] = self.corners;
        let [xs, ys] = self.frame([width, rows.end]);
        let ys = ys.start.max(rows.start as usize)..ys.end;
        if xs.is_empty() || ys.is_empty() {
            return;
        }
        let turn = self.area2.signum();
        let mut edges = [([0.0; 2], [0.0; 2], false); 3];
        for (edge, (a, b)) in edges.iter_mut().zip([(b, c), (c, a), (a, b)]) {
            let ordered = (a[0], a[1]) <= (b[0], b[1]);
            let (a, b) = if ordered { (a, b) } else { (b, a) };
            // Zero is positive along the ordered direction only.
            *edge = (a, [b[0] - a[0], b[1] - a[1]], (turn > 0.0) == ordered);
        }
        for y in ys {
            let py = y as f64 + 0.5;
            let mut rows = [(0.0, 0.0, 0.0, false); 3];
            for (row, (a, d, positive)) in rows.iter_mut().zip(&edges) {
                *row = (d[0] * (py - a[1]), d[1], a[0], *positive);
            }
            let (low, high) = self.extent(py);
            let columns = span(low - 1.0, high + 1.0, width);
            let mut entered = false;
            for x in columns.start.max(xs.start)..columns.end.min(xs.end) {
                let px = x as f64 + 0.5;
                let mut e = [0.0; 3];
                let mut inside = true;
                for (e, (row, dy, ax, positive)) in e.iter_mut().zip(&rows) {
                    let ordered = row - dy * (px - ax);
                    inside &= (ordered >= 0.0) == *positive;
                    *e = ordered.abs();
                }
                if inside {
                    entered = true;
                    visit(x, y, if e == [0.0; 3] { [1.0; 3] } else { e });
                } else if entered {
                    break;
                }
            }
        }
    }

    /// Where the horizontal line at `y` enters and leaves, within rounding: a long oblique triangle fills little of
    /// its rectangle.
    pub(super) fn extent(&self, y: f64) -> (f64, f64) {
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        let [a, b, c] = self.corners;
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let crosses = a[1].min(b[1]) <= y && y <= a[1].max(b[1]);
            if crosses && a[1] == b[1] {
                (low, high) = (low.min(a[0]).min(b[0]), high.max(a[0]).max(b[0]));
            } else if crosses {
                let x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
                (low, high) = (low.min(x), high.max(x));
            }
        }
        (low, high)
    }
}

/// Pixels whose centres may lie within the extent of three coordinates.
#[inline]
fn pixel_range([a, b, c]: [f64; 3], size: u32) -> std::ops::Range<usize> {
    span(a.min(b).min(c), a.max(b).max(c), size)
}

/// Pixels whose centres are in [low, high], clipped to the image.
pub(crate) fn span(low: f64, high: f64, size: u32) -> std::ops::Range<usize> {
    // Float-to-integer casts saturate, so values outside end up at the border.
    let first = (low - 0.5).ceil().max(0.0) as usize;
    let end = ((high - 0.5).floor() + 1.0).clamp(0.0, f64::from(size)) as usize;
    first.min(end)..end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cover(triangles: &[[[f64; 2]; 3]], size: u32) -> Vec<u32> {
        let mut count = vec![0; (size * size) as usize];
        for t in triangles {
            if let Some(t) = ScreenTriangle::new(*t) {
                t.scan([size; 2], |x, y, _| count[y * size as usize + x] += 1);
            }
        }
        count
    }

    /// A fan around `hub` with rim points given by a small generator.
    fn fan(hub: [f64; 2], n: usize, radius: f64) -> Vec<[[f64; 2]; 3]> {
        let rim = |i: usize| {
            let a = std::f64::consts::TAU * (i % n) as f64 / n as f64;
            [hub[0] + radius * a.cos(), hub[1] + radius * a.sin()]
        };
        (0..n).map(|i| [hub, rim(i), rim(i + 1)]).collect()
    }

    #[test]
    fn a_fan_covers_each_centre_once_even_with_its_hub_on_a_centre() {
        for n in [3, 4, 8, 17, 64] {
            for hub in [[8.5, 8.5], [8.5 + 1e-14, 8.5], [8.0, 8.25], [8.3, 7.9]] {
                let count = cover(&fan(hub, n, 30.0), 16);
                assert!(count.iter().all(|&c| c == 1), "n {n}, hub {hub:?}: {count:?}");
            }
        }
    }

    #[test]
    fn a_grid_with_vertices_on_centres_has_no_seams() {
        let mut triangles = Vec::new();
        for i in 0..5 {
            for j in 0..5 {
                let [x, y] = [4.0 * f64::from(i) - 3.5, 4.0 * f64::from(j) - 3.5];
                triangles.push([[x, y], [x + 4.0, y], [x + 4.0, y + 4.0]]);
                triangles.push([[x, y + 4.0], [x + 4.0, y + 4.0], [x, y]]);
            }
        }
        let count = cover(&triangles, 16);
        assert!(count.iter().all(|&c| c == 1), "{count:?}");
    }

    #[test]
    fn rounding_alone_would_double_or_miss_pixels() {
        // Counter-check: without the tie rule (closed triangles) the same grid counts seams twice.
        let closed = |t: [[f64; 2]; 3], p: [f64; 2]| {
            (0..3).all(|i| {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0
            })
        };
        let hits = fan([8.5, 8.5], 8, 30.0).into_iter().filter(|t| closed(*t, [8.5, 8.5])).count();
        assert_eq!(hits, 8);
    }

    #[test]
    fn weights_interpolate_linearly() {
        let corners = [[1.2, 0.7], [13.1, 3.3], [4.9, 14.8]];
        let triangle = ScreenTriangle::new(corners).unwrap();
        let mut covered = 0;
        triangle.scan([16; 2], |x, y, w| {
            covered += 1;
            for k in 0..2 {
                let value = (0..3).map(|i| w[i] * corners[i][k]).sum::<f64>() / w.iter().sum::<f64>();
                assert!((value - ([x, y][k] as f64 + 0.5)).abs() < 1e-5);
            }
        });
        assert!((f64::from(covered) - triangle.area2().abs() / 2.0).abs() < 12.0);
    }

    #[test]
    fn edge_on_and_far_away_triangles_cover_nothing() {
        assert!(ScreenTriangle::new([[0.0, 0.0], [5.0, 5.0], [10.0, 10.0]]).is_none());
        assert!(cover(&[[[1e9, 1e9], [2e9, 1e9], [1e9, 2e9]]], 8).iter().all(|&c| c == 0));
    }
}
