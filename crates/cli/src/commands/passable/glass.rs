//! A vessel drawn as if made of glass: clear where its wall faces the viewer, dark at its rim.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

/// Number of viewing directions about the patient's long axis that are tried.
const DIRECTIONS: usize = 36;
/// Fraction of a panel that the vessel fills.
const FILL: f64 = 0.9;
/// Lengths of scale bars, mm; the longest that fits in a quarter of the panel is used.
const BARS_MM: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Absorbed fraction of light where the wall is seen face-on, and edge-on.
const STRAIGHT_ON: f64 = 0.04;
const ALONG: f64 = 0.5;
/// Exponent of the transition between them.
const RIM: i32 = 3;
/// Subpixels in each direction.
const FINE: usize = 2;

/// A parallel projection of a vessel.
pub(super) struct Side {
    right: Vec3,
    up: Vec3,
    towards: Vec3,
    middle: Vec3,
    px_per_mm: f64,
    size_px: [usize; 2],
}

impl Side {
    /// The projection that shows a way at its widest, among directions about z and from above.
    pub(super) fn fitting(vessel: &SurfaceMesh, way: &[Vec3], size_px: [usize; 2]) -> Self {
        let about = (0..DIRECTIONS).map(|k| {
            let (sin, cos) = (std::f64::consts::PI * k as f64 / DIRECTIONS as f64).sin_cos();
            (Vec3::new(cos, sin, 0.0), Vec3::z())
        });
        let span = |points: &[Vec3], along: &Vec3| {
            let (low, high) = points
                .iter()
                .map(|x| x.dot(along))
                .fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            (0.5 * (low + high), high - low)
        };
        let area = |(right, up): &(Vec3, Vec3)| span(way, right).1 * span(way, up).1;
        let above = (Vec3::x(), Vec3::y());
        let (right, up) = about.fold(above, |best, one| if area(&one) > area(&best) { one } else { best });
        let ((x, width), (y, height)) = (span(&vessel.vertices_mm, &right), span(&vessel.vertices_mm, &up));
        let fits = |px: usize, mm: f64| FILL * px as f64 / mm.max(f64::MIN_POSITIVE);
        let px_per_mm = fits(size_px[0], width).min(fits(size_px[1], height));
        let towards = right.cross(&up);
        Self { right, up, towards, middle: right * x + up * y, px_per_mm, size_px }
    }

    /// Position of a point, in pixels.
    fn place(&self, point: &Vec3) -> [f64; 2] {
        let offset = point - self.middle;
        let half = self.size_px.map(|px| 0.5 * px as f64);
        [half[0] + self.px_per_mm * offset.dot(&self.right), half[1] - self.px_per_mm * offset.dot(&self.up)]
    }

    /// The pixel of a point.
    pub(super) fn pixel(&self, point: &Vec3) -> (i32, i32) {
        let [x, y] = self.place(point);
        (x.round() as i32, y.round() as i32)
    }

    /// A suitable length for a scale bar, mm, and in pixels.
    pub(super) fn scale_bar(&self) -> (f64, i32) {
        let longest_mm = 0.25 * self.size_px[0] as f64 / self.px_per_mm;
        let bar_mm = BARS_MM.into_iter().rev().find(|mm| *mm <= longest_mm).unwrap_or(BARS_MM[0]);
        (bar_mm, (bar_mm * self.px_per_mm).round() as i32)
    }
}

/// Absorption by a vessel, pixel by pixel.
pub(super) struct Glass {
    width: usize,
    /// Transmitted fraction of light at each subpixel, row by row.
    left: Vec<f64>,
}

impl Glass {
    pub(super) fn of(vessel: &SurfaceMesh, side: &Side) -> Self {
        let [width, height] = side.size_px.map(|px| FINE * px);
        let mut glass = Self { width, left: vec![1.0; width * height] };
        let takes: Vec<f64> = vessel
            .vertex_normals()
            .iter()
            .map(|normal| {
                STRAIGHT_ON + (ALONG - STRAIGHT_ON) * (1.0 - normal.dot(&side.towards).abs()).powi(RIM)
            })
            .collect();
        for triangle in &vessel.triangles {
            let corners =
                triangle.map(|v| side.place(&vessel.vertices_mm[v as usize]).map(|px| FINE as f64 * px));
            glass.lay(corners, triangle.map(|v| takes[v as usize]));
        }
        glass
    }

    /// Adds a triangle: at each grid point inside it, by barycentric coordinates.
    fn lay(&mut self, [a, b, c]: [[f64; 2]; 3], takes: [f64; 3]) {
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let area = cross(a, b, c);
        if area == 0.0 {
            return;
        }
        let range = |axis: usize, most: usize| {
            let low = a[axis].min(b[axis]).min(c[axis]).ceil().max(0.0) as usize;
            let high = a[axis].max(b[axis]).max(c[axis]).floor();
            low..if high < 0.0 { low } else { most.min(high as usize + 1) }
        };
        for y in range(1, self.left.len() / self.width) {
            for x in range(0, self.width) {
                let p = [x as f64, y as f64];
                let weights = [cross(b, c, p) / area, cross(c, a, p) / area, cross(a, b, p) / area];
                if weights.iter().all(|w| *w >= 0.0) {
                    let takes: f64 = weights.iter().zip(takes).map(|(w, t)| w * t).sum();
                    self.left[y * self.width + x] *= 1.0 - takes;
                }
            }
        }
    }

    /// Pixels with absorption, and its amount.
    pub(super) fn pixels(&self) -> impl Iterator<Item = ((i32, i32), f64)> {
        let (width, height) = (self.width / FINE, self.left.len() / self.width / FINE);
        (0..width * height).filter_map(move |k| {
            let (x, y) = (k % width, k / width);
            let parts =
                (0..FINE * FINE).map(|n| self.left[(FINE * y + n / FINE) * self.width + FINE * x + n % FINE]);
            let takes = 1.0 - parts.sum::<f64>() / (FINE * FINE) as f64;
            (takes > 0.0).then_some(((x as i32, y as i32), takes))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_seen_where_it_is_and_darker_from_its_edge() {
        let corner = |x: f64, y: f64| Vec3::new(x, 0.0, y);
        let vertices_mm = vec![corner(0.0, 0.0), corner(10.0, 0.0), corner(10.0, 10.0), corner(0.0, 10.0)];
        let square = SurfaceMesh { vertices_mm, triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let way = [corner(0.0, 0.0), corner(10.0, 10.0)];
        let side = Side::fitting(&square, &way, [100, 100]);
        assert_eq!((side.pixel(&way[0]), side.pixel(&way[1])), ((5, 95), (95, 5)));
        assert_eq!(side.scale_bar(), (2.0, 18));
        let pixels: Vec<_> = Glass::of(&square, &side).pixels().collect();
        // Ninety pixels in each direction. Each point is in one of the two triangles, except on their common edge.
        assert!((8000..8400).contains(&pixels.len()), "{}", pixels.len());
        assert!(pixels.iter().filter(|(_, takes)| (takes - STRAIGHT_ON).abs() < 1e-9).count() > 7900);
        let along = Side { towards: Vec3::x(), ..side };
        assert!(Glass::of(&square, &along).pixels().any(|(_, takes)| (takes - ALONG).abs() < 1e-9));
    }
}
