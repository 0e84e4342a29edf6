//! Opaque objects in the 3D view as triangles: devices in the colours of their materials, contacts with their forces,
//! the C-arm.

use std::f64::consts::{FRAC_PI_2, TAU};

use endowire_core::Vec3;

use crate::c_arm::CArm;
use crate::device::RefinedDevice;
use crate::material::Material;
use crate::three_d::{Camera, Vertex};

/// Number of corners of a cross section.
const SIDES: usize = 14;
/// Number of rings of each rounded end.
const CAP_RINGS: usize = 4;
/// Smallest width of a device on screen, pixels: otherwise half a millimetre of wire in a long scene would vanish.
const LEAST_WIDTH_PX: f64 = 2.4;
/// Half a contact's dot, and half the shaft of an arrow, pixels.
const DOT_PX: f64 = 3.2;
const SHAFT_PX: f64 = 1.1;
/// Length of the arrow of the force that sets the scale, pixels in a frame of 640.
const ARROW_PX: f64 = 60.0;
/// Smallest force with an arrow of that length, N: those of coils are tenths of a millinewton, and the rounding of a
/// device at rest shall have no arrow.
const LEAST_LONG_N: f64 = 5e-5;
/// Number of pieces of an edge of the beam.
const BEAM_PIECES: u32 = 48;
const CONTACT: [u8; 4] = [236, 132, 20, 255];
pub(crate) const FORCE: [u8; 4] = [196, 30, 40, 255];
const FRAME: [u8; 4] = [110, 124, 140, 255];

/// A contact of a device with the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactView {
    /// Position on the axis of the device.
    pub position_mm: Vec3,
    /// Force of the wall on the device; the length of its arrow is proportional to it.
    pub force_n: Vec3,
}

/// Objects drawn in addition to the wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solids<'a> {
    pub(crate) devices: &'a [RefinedDevice],
    pub(crate) contacts: &'a [ContactView],
    /// The force with the arrow of the legend, N; absent: the largest of `contacts`.
    pub(crate) scale_n: Option<f64>,
    pub(crate) c_arm: Option<&'a CArm>,
}

/// Colour of a material, display values.
fn colour(material: Option<Material>) -> [u8; 4] {
    match material {
        Some(Material::Platinum) => [205, 170, 84, 255],
        Some(Material::Tungsten) => [150, 140, 120, 255],
        Some(Material::PolyurethaneTungsten60 | Material::PebaxBariumSulphate40) => [40, 96, 168, 255],
        Some(Material::Steel316L) => [88, 96, 108, 255],
        _ => [26, 40, 76, 255],
    }
}

/// A cross section of a tube: centre, radius, direction, and tilt of the normal out of it (sine, cosine).
#[derive(Debug, Clone, Copy)]
struct Section {
    centre: Vec3,
    radius: f64,
    along: Vec3,
    tilt: [f64; 2],
    colour: [u8; 4],
}

/// All solids as outward triangles.
pub(crate) fn solid_triangles(camera: &Camera, solids: &Solids) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    solids.devices.iter().for_each(|device| self::device(camera, device, &mut vertices));
    contacts(camera, solids, &mut vertices);
    if let Some(c_arm) = solids.c_arm {
        frustum(camera, c_arm, &mut vertices);
    }
    vertices
}

/// Size in millimetres of some pixels at a position.
fn px(camera: &Camera, at: &Vec3, pixels: f64) -> f64 {
    let distance = -camera.in_view(at)[2];
    camera.pixel_mm_at(distance.max(camera.near)) * pixels
}

/// A device as a tube with rounded ends.
fn device(camera: &Camera, device: &RefinedDevice, vertices: &mut Vec<Vertex>) {
    let points = &device.points;
    let last = points.len() - 1;
    let section = |i: usize, piece: usize| {
        let (material, outer) = device.looks(piece);
        let point = &points[i];
        let radius =
            outer.unwrap_or(point.radius_mm).max(px(camera, &point.position_mm, LEAST_WIDTH_PX / 2.0));
        let along = point.tangent.normalize();
        Section { centre: point.position_mm, radius, along, tilt: [0.0, 1.0], colour: colour(material) }
    };
    let mut sections: Vec<Section> = Vec::with_capacity(2 * points.len() + 2 * CAP_RINGS);
    cap(section(0, 0), -1.0, &mut sections);
    for piece in 0..last {
        // Where one part ends and another begins there are two sections at one position.
        if piece == 0 || device.looks(piece) != device.looks(piece - 1) {
            sections.push(section(piece, piece));
        }
        sections.push(section(piece + 1, piece));
    }
    cap(section(last, last - 1), 1.0, &mut sections);
    tube(camera, &sections, vertices);
}

/// A hemisphere before or behind a section.
fn cap(end: Section, outwards: f64, sections: &mut Vec<Section>) {
    for ring in 0..CAP_RINGS {
        let step = if outwards < 0.0 { CAP_RINGS - ring } else { ring + 1 };
        let (sin, cos) = libm::sincos(FRAC_PI_2 * step as f64 / CAP_RINGS as f64);
        sections.push(Section {
            centre: end.centre + end.along * (outwards * end.radius * sin),
            radius: end.radius * cos,
            tilt: [outwards * sin, cos],
            ..end
        });
    }
}

/// The largest force of contacts, N.
pub fn largest_force_n(contacts: &[ContactView]) -> f64 {
    contacts.iter().map(|contact| contact.force_n.norm()).fold(0.0, f64::max)
}

/// The force of the legend, given or the largest of contacts, N, and the length of an arrow per newton, pixels in a frame
/// of 640.
pub(crate) fn scale_and_px_per_n(contacts: &[ContactView], scale_n: Option<f64>) -> (f64, f64) {
    let shown_n = scale_n.unwrap_or_else(|| largest_force_n(contacts));
    (shown_n, ARROW_PX / shown_n.max(LEAST_LONG_N))
}

/// Dots at contacts of devices with the wall, and arrows along their forces.
fn contacts(camera: &Camera, solids: &Solids, vertices: &mut Vec<Vertex>) {
    let (_, px_per_n) = scale_and_px_per_n(solids.contacts, solids.scale_n);
    let scale = f64::from(camera.size_px[0].max(camera.size_px[1])) / 640.0;
    for contact in solids.contacts {
        let at = contact.position_mm;
        let radius = px(camera, &at, DOT_PX * scale);
        let dot = |along: Vec3| Section { centre: at, radius, along, tilt: [0.0, 1.0], colour: CONTACT };
        let along = contact.force_n.try_normalize(0.0).unwrap_or_else(Vec3::z);
        let mut sections = Vec::new();
        cap(dot(along), -1.0, &mut sections);
        sections.push(dot(along));
        cap(dot(along), 1.0, &mut sections);
        tube(camera, &sections, vertices);
        let length = px(camera, &at, px_per_n * scale) * contact.force_n.norm();
        let shaft = px(camera, &at, SHAFT_PX * scale);
        if length < 4.0 * shaft {
            continue;
        }
        let head = (7.0 * shaft).min(0.6 * length);
        let place = |s: f64, radius: f64, tilt: [f64; 2]| Section {
            centre: at + along * s,
            radius,
            along,
            tilt,
            colour: FORCE,
        };
        let flank = {
            let l = (head * head + 9.0 * shaft * shaft).sqrt();
            [3.0 * shaft / l, head / l]
        };
        tube(
            camera,
            &[
                place(0.0, shaft, [0.0, 1.0]),
                place(length - head, shaft, [0.0, 1.0]),
                place(length - head, shaft, [-1.0, 0.0]),
                place(length - head, 3.0 * shaft, [-1.0, 0.0]),
                place(length - head, 3.0 * shaft, flank),
                place(length, 0.0, flank),
            ],
            vertices,
        );
    }
}

/// The beam: from the source to the corners of the detector, around it, and around the field at the isocentre.
fn frustum(camera: &Camera, c_arm: &CArm, vertices: &mut Vec<Vertex>) {
    let corners = c_arm.field_corners_mm(c_arm.sid_mm());
    let field = c_arm.field_corners_mm(c_arm.sod_mm());
    let source = c_arm.source_mm();
    for k in 0..4 {
        let next = (k + 1) % 4;
        for [a, b] in [[source, corners[k]], [corners[k], corners[next]], [field[k], field[next]]] {
            let along = (b - a).normalize();
            // In pieces, so that only those behind the camera are omitted.
            for piece in 0..BEAM_PIECES {
                let [a, b] =
                    [piece, piece + 1].map(|i| a + (b - a) * (f64::from(i) / f64::from(BEAM_PIECES)));
                let end = |centre: Vec3| Section {
                    centre,
                    radius: px(camera, &centre, LEAST_WIDTH_PX / 2.0),
                    along,
                    tilt: [0.0, 1.0],
                    colour: FRAME,
                };
                tube(camera, &[end(a), end(b)], vertices);
            }
        }
    }
}

/// Adds the surface through sections.
fn tube(camera: &Camera, sections: &[Section], vertices: &mut Vec<Vertex>) {
    let mut side = perpendicular(&sections[0].along);
    let mut before: Option<[Vertex; SIDES]> = None;
    for section in sections {
        let t = &section.along;
        // The smallest rotation that keeps the frame across the tube.
        side = (side - t * side.dot(t)).try_normalize(1e-6).unwrap_or_else(|| perpendicular(t));
        let other = t.cross(&side);
        let [sin, cos] = section.tilt;
        let ring: [Vertex; SIDES] = std::array::from_fn(|k| {
            let (s, c) = libm::sincos(TAU * k as f64 / SIDES as f64);
            let radial = side * c + other * s;
            let position = section.centre + radial * section.radius;
            Vertex::new(camera, &position, &(radial * cos + t * sin), section.colour)
        });
        if let Some(before) = before.filter(|before| before[0].colour == ring[0].colour) {
            for k in 0..SIDES {
                let next = (k + 1) % SIDES;
                let [a, b, c, d] = [before[k], before[next], ring[next], ring[k]];
                vertices.extend([a, b, c, a, c, d]);
            }
        }
        before = Some(ring);
    }
}

fn perpendicular(t: &Vec3) -> Vec3 {
    let least = if t.x.abs() <= t.y.abs().min(t.z.abs()) {
        Vec3::x()
    } else if t.y.abs() <= t.z.abs() {
        Vec3::y()
    } else {
        Vec3::z()
    };
    t.cross(&least).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_arrow_is_that_of_the_largest_force_unless_it_is_rounding() {
        let of = |largest_n: f64| {
            let contact =
                |force_n: f64| ContactView { position_mm: Vec3::zeros(), force_n: Vec3::x() * force_n };
            let both = [contact(0.5 * largest_n), contact(largest_n)];
            let (found_n, px_per_n) = scale_and_px_per_n(&both, None);
            assert_eq!(found_n, largest_n);
            // A given scale is the same for all forces.
            let given = scale_and_px_per_n(&both, Some(0.25));
            assert_eq!(given, scale_and_px_per_n(&[contact(7.0)], Some(0.25)));
            px_per_n * largest_n
        };
        assert!((of(0.3) - ARROW_PX).abs() < 1e-12 && (of(2e-4) - ARROW_PX).abs() < 1e-12);
        assert!(of(1e-7) < 1.0 && of(0.0) == 0.0);
        assert_eq!(scale_and_px_per_n(&[], None).0, 0.0);
    }
}
