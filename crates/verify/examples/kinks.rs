//! kinks SURFACE unit radius n
#![allow(clippy::all, clippy::pedantic)]
use endowire_core::Vec3;
use endowire_core::contact::*;
use endowire_core::vessel::*;
struct R(u64);
impl R {
    fn f(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E3779B97F4A7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58476D1CE4E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D049BB133111EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let unit: f64 = a[2].parse().unwrap();
    let radius: f64 = a[3].parse().unwrap();
    let n: usize = a[4].parse().unwrap();
    let wall = Wall::from_surface(&SurfaceMesh::read(std::path::Path::new(&a[1]), unit).unwrap()).unwrap();
    let felt = FeltWall::for_radii(&wall, (radius, radius), &WallProperties::default(), &NoStore).unwrap();
    let mesh = wall.mesh().clone();
    println!("{} triangles", mesh.triangles.len());
    let mut r = R(1);
    let mut area = vec![];
    let mut sum = 0.0;
    for t in 0..mesh.triangles.len() {
        let [p, q, s] = mesh.corners(t);
        sum += (q - p).cross(&(s - p)).norm();
        area.push(sum);
    }
    let mut hist = std::collections::BTreeMap::<String, [usize; 6]>::new();
    let mut worst: Vec<(f64, f64, String, Vec3)> = vec![];
    let steps = 41;
    let dx = radius / 40.0;
    for _ in 0..n {
        let u = r.f() * sum;
        let t = area.partition_point(|x| *x < u).min(area.len() - 1);
        let [p, q, s] = mesh.corners(t);
        let (mut b, mut c) = (r.f(), r.f());
        if b + c > 1.0 {
            b = 1.0 - b;
            c = 1.0 - c;
        }
        let nrm = (q - p).cross(&(s - p)).normalize();
        let x0 = p + (q - p) * b + (s - p) * c;
        // inward side: sign by query
        let inward = felt
            .query
            .nearest(&(x0 + nrm * 1e-3), 1.0)
            .map_or(1.0, |k| if k.distance_mm > 0.0 { 1.0 } else { -1.0 });
        let x0 = x0 + nrm * inward * radius * (1.0 - 1.2 * r.f());
        let dir = loop {
            let v = Vec3::new(2.0 * r.f() - 1.0, 2.0 * r.f() - 1.0, 2.0 * r.f() - 1.0);
            if v.norm() < 1.0 && v.norm() > 0.1 {
                break v.normalize();
            }
        };
        let mut last: Option<(f64, Vec3, Option<(f64)>, u32)> = None;
        let (mut kink, mut jump, mut class) = (0.0f64, 0.0f64, String::new());
        let mut place = x0;
        for k in 0..steps {
            let x = x0 + dir * dx * (k as f64 - 20.0);
            let Some(near) = felt.query.nearest(&x, 10.0 * radius + 5.0) else {
                last = None;
                continue;
            };
            if near.rim {
                last = None;
                continue;
            }
            let cov = felt.smooth.within(&x, near.triangle, f64::INFINITY).map(|w| w.1);
            let Nearness::Within(d) = felt.nearness(&x, near.triangle, f64::INFINITY) else {
                last = None;
                continue;
            };
            if d.value_mm > radius || d.value_mm < -0.5 * radius {
                last = None;
                continue;
            }
            if let Some((f, g, c, tri)) = last {
                let jumped = ((d.value_mm - f) - 0.5 * (g + d.gradient).dot(&dir) * dx).abs();
                let turned = (g - d.gradient).norm();
                let flat = cov.map_or(true, |c| c < 0.15) || c.map_or(true, |c| c < 0.15);
                let cl = format!(
                    "{}{}{}",
                    if flat { "flat " } else { "quad " },
                    if tri != near.triangle { "changed " } else { "same " },
                    if d.value_mm < 0.0 || f < 0.0 { "behind" } else { "front" }
                );
                if turned > kink {
                    kink = turned;
                    class = cl.clone();
                    place = x;
                }
                if jumped / dx > jump {
                    jump = jumped / dx;
                    if jump > 0.2 {
                        class = cl;
                        place = x;
                    }
                }
            }
            last = Some((d.value_mm, d.gradient, cov, near.triangle));
        }
        if class.is_empty() {
            continue;
        }
        let h = hist.entry(class.clone()).or_default();
        h[0] += 1;
        if kink > 0.1 {
            h[1] += 1
        }
        if kink > 0.3 {
            h[2] += 1
        }
        if jump > 0.05 {
            h[3] += 1
        }
        if jump > 0.3 {
            h[4] += 1
        }
        if jump > 1.0 {
            h[5] += 1
        }
        worst.push((jump, kink, class, place));
    }
    println!("class: lines, gradient turns by >0.1, >0.3 on R/40; jumps >0.05, >0.3, >1 of R/40");
    for (k, h) in &hist {
        println!("{k:24} {h:?}");
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    for w in worst.iter().take(12) {
        println!("jump {:.2} kink {:.2} {} at {:.3} {:.3} {:.3}", w.0, w.1, w.2, w.3.x, w.3.y, w.3.z);
    }
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    for w in worst.iter().take(12) {
        println!("kink {:.2} jump {:.2} {} at {:.3} {:.3} {:.3}", w.1, w.0, w.2, w.3.x, w.3.y, w.3.z);
    }
}
