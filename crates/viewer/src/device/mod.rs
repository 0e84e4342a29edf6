//! Devices as the viewer sees them: a centre line with a radius, refined into short straight pieces.
//!
//! Between two points the centre line is the cubic Hermite curve through positions and tangents, the same curve the
//! rod solver integrates. It is divided so finely that a piece's chord stays within [`SAGITTA`] radii of it: for
//! curvature κ and length h, the sagitta is κh²/8. A chord offset by s from the axis of a round wire of radius r
//! shortens the central ray from 2r to 2√(r² − s²) ≈ 2r(1 − s²/2r²), so 0.04 r costs less than 0.1 % of the diameter.
//!
//! A device is made of *parts*, tubes of one material over a stretch of arc length: a hollow catheter is its outer frustum minus
//! its inner one, a marker band a ring around it.

mod piece;

use std::ops::Range;

use endowire_core::device::Device;
use endowire_core::shape::Shape;
use endowire_core::{Error, Result, Vec3};
use serde::{Deserialize, Serialize};

use crate::material::Material;
use crate::shaft::{Outside, SheathMouth};
pub(crate) use piece::{Piece, pieces};

/// Largest distance of a piece's chord from the curve, in radii.
const SAGITTA: f64 = 0.04;
/// Longest piece, mm: keeps the screen rectangle of an oblique straight piece small.
const LONGEST_MM: f64 = 4.0;
/// Largest number of pieces between two given points, and approximately in all, so that absurd input cannot exhaust
/// memory.
const MOST_PIECES: usize = 4096;
const MOST_PIECES_IN_ALL: usize = 1 << 20;
/// Largest distance of a part from the tip, mm.
const FURTHEST_MM: f64 = 1e5;
/// Largest radius of a part, mm.
const LARGEST_RADIUS_MM: f64 = 1e3;

/// One point of a device's centre line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DevicePoint {
    /// Its position.
    pub position_mm: Vec3,
    /// Direction of the centre line there, of any length above zero.
    pub tangent: Vec3,
    /// Outer radius.
    pub radius_mm: f64,
}

/// A device to draw: parts along a centre line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeviceView {
    /// The centre line in order, the tip last; with fewer than two points nothing is drawn.
    pub points: Vec<DevicePoint>,
    /// Material of parts without one; `None`: the scene's `device_material`.
    pub material: Option<Material>,
    /// Its parts; a later one takes the place of what it covers of earlier ones, its lumen covers nothing. None: one
    /// solid rod.
    pub parts: Vec<DevicePart>,
    /// The mouth of the sheath that its first point is at. Fluoroscopy then shows its shaft outside, too, on a way
    /// through groin or arm to the edge of the picture; the 3D view, like the simulation, begins at the mouth.
    pub sheath: Option<SheathMouth>,
}

/// A tube of one material over a stretch of a device, for instance a `[[view.device]]` table of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DevicePart {
    /// Its start and end, in arc length from the tip in mm, 0 to 100,000; absent: the whole device.
    #[serde(default)]
    pub from_tip_mm: Option<[f64; 2]>,
    /// Its material; absent: that of the device.
    #[serde(default)]
    pub material: Option<Material>,
    /// Outer radius, 0.000001 to 1000; absent: that of the device.
    #[serde(default)]
    pub outer_radius_mm: Option<f64>,
    /// Radius of the lumen, 0 to 1000 and less than the outer radius, also if that is the device's; 0 is solid.
    #[serde(default)]
    pub inner_radius_mm: f64,
}

impl DevicePart {
    /// Checks the part on its own; errors begin with `name`.
    pub(crate) fn validate(&self, name: &str) -> Result<()> {
        let refuse = |key: &str, value: String, remedy: &str| {
            Err(Error::parameter(format!("{name}.{key}"), value, remedy))
        };
        if let Some([first, last]) = self.from_tip_mm
            && !(first >= 0.0 && first < last && last <= FURTHEST_MM)
        {
            let remedy = "must be two lengths from the tip, 0 to 100000 mm, the first less than the second";
            return refuse("from_tip_mm", format!("[{first}, {last}]"), remedy);
        }
        let most = match self.outer_radius_mm {
            Some(outer) if !(1e-6..=LARGEST_RADIUS_MM).contains(&outer) => {
                let remedy = "must be a number from 0.000001 to 1000";
                return refuse("outer_radius_mm", outer.to_string(), remedy);
            }
            outer => outer.unwrap_or(LARGEST_RADIUS_MM),
        };
        if !(0.0..most).contains(&self.inner_radius_mm) {
            let remedy = "must be at least 0, and less than the outer radius and 1000";
            return refuse("inner_radius_mm", self.inner_radius_mm.to_string(), remedy);
        }
        Ok(())
    }
}

impl DeviceView {
    /// The device with centre line `shape` and an outer radius given by the arc length from the tip in
    /// millimetres.
    pub fn from_shape(shape: &Shape, radius_mm: impl Fn(f64) -> f64) -> Self {
        let points = (shape.positions_mm.iter().zip(&shape.tangents).zip(&shape.from_tip_mm))
            .map(|((&position_mm, &tangent), &s)| DevicePoint {
                position_mm,
                tangent,
                radius_mm: radius_mm(s),
            })
            .collect();
        Self { points, ..Self::default() }
    }

    /// A device along `shape`, with the radii of its sections, made of `parts`.
    pub fn of_device(shape: &Shape, device: &Device, parts: &[DevicePart]) -> Self {
        let mut view = Self::from_shape(shape, |from_tip_mm| device.section_at(from_tip_mm).radius_mm);
        view.parts.extend_from_slice(parts);
        view
    }

    /// The refined shaft outside the sheath, from far to near, with its device's `first` point as the last; empty
    /// without a sheath.
    fn shaft(&self, first: &DevicePoint, outside: Outside) -> Result<Vec<DevicePoint>> {
        let Some(mouth) = &self.sheath else { return Ok(vec![]) };
        let mut points = mouth.shaft(first.radius_mm, outside);
        // While it moves during a pulse, a device may begin a little inside the sheath.
        let within_mm = (mouth.position_mm - first.position_mm).norm();
        while points.last().is_some_and(|p| (p.position_mm - mouth.position_mm).norm() < within_mm + 1.0) {
            points.pop();
        }
        points.push(*first);
        Self { points, ..Self::default() }.refined()
    }

    /// The same with the parts that reach furthest from the tip, of those at the mouth this far from it, extended: a
    /// shaft is as long as it needs to be.
    fn with_endless_shaft(&self, mouth_mm: f64) -> Self {
        let end = |part: &DevicePart| part.from_tip_mm.map_or(f64::INFINITY, |[_, end]| end);
        let furthest = self.parts.iter().map(end).fold(mouth_mm, f64::max);
        let mut endless = self.clone();
        let last = endless.parts.iter_mut().filter_map(|part| part.from_tip_mm.as_mut());
        last.filter(|ends| ends[1] >= furthest).for_each(|ends| ends[1] = FURTHEST_MM);
        endless
    }

    /// Refines the centre line; empty if there is nothing to draw.
    pub(crate) fn refined(&self) -> Result<Vec<DevicePoint>> {
        for (i, p) in self.points.iter().enumerate() {
            let finite =
                p.position_mm.iter().chain(&p.tangent).all(|x| x.is_finite()) && p.radius_mm.is_finite();
            if !finite || p.radius_mm < 0.0 {
                let remedy = "positions, tangents and radii must be finite, radii not negative";
                return Err(Error::parameter(format!("device.points[{i}]"), format!("{p:?}"), remedy));
            }
        }
        let most = (MOST_PIECES_IN_ALL / self.points.len().max(1)).clamp(1, MOST_PIECES) as f64;
        let mut fine: Vec<DevicePoint> = Vec::with_capacity(2 * self.points.len());
        for pair in self.points.windows(2) {
            let chord = pair[1].position_mm - pair[0].position_mm;
            let length = chord.norm();
            // Coincident points have no direction; the piece before or after them covers the position.
            let Some(along) = chord.try_normalize(f64::EPSILON * (1.0 + pair[0].position_mm.amax())) else {
                continue;
            };
            let [t0, t1] = [0, 1].map(|i| pair[i].tangent.try_normalize(0.0).unwrap_or(along));
            if fine.is_empty() {
                fine.push(DevicePoint { tangent: t0, ..pair[0] });
            }
            let turn = t0.angle(&along) + t1.angle(&along);
            let radius = pair[0].radius_mm.max(pair[1].radius_mm).max(f64::MIN_POSITIVE);
            let by_bend = (length * turn / (8.0 * SAGITTA * radius)).sqrt();
            let pieces = by_bend.max(length / LONGEST_MM).ceil().clamp(1.0, most) as usize;
            // Handles of this length match a circular arc through both ends to sixth order: chord / cos²(θ/4) with θ
            // the angle between the end tangents.
            let half_cos = ((1.0 + t0.dot(&t1).clamp(-1.0, 1.0)) / 2.0).sqrt();
            let handle = length * 2.0 / (1.0 + half_cos);
            for k in 1..pieces {
                fine.push(hermite(pair, [t0 * handle, t1 * handle], k as f64 / pieces as f64));
            }
            fine.push(DevicePoint { tangent: t1, ..pair[1] });
        }
        Ok(fine)
    }
}

/// Point at parameter `w` of the cubic Hermite curve between two points with end derivatives `d`.
fn hermite(pair: &[DevicePoint], d: [Vec3; 2], w: f64) -> DevicePoint {
    let [p0, p1] = [pair[0].position_mm, pair[1].position_mm];
    let v = 1.0 - w;
    let position_mm = p0 * (v * v * (1.0 + 2.0 * w)) + p1 * (w * w * (1.0 + 2.0 * v)) + d[0] * (w * v * v)
        - d[1] * (w * w * v);
    let tangent = (p1 - p0) * (6.0 * w * v) + d[0] * (v * (1.0 - 3.0 * w)) + d[1] * (w * (3.0 * w - 2.0));
    DevicePoint {
        position_mm,
        tangent: tangent.try_normalize(0.0).unwrap_or(p1 - p0),
        radius_mm: v * pair[0].radius_mm + w * pair[1].radius_mm,
    }
}

/// A stretch of a refined centre line with one material.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layer {
    pub(crate) material: Option<Material>,
    /// Index of its part; `None` for a device without parts.
    pub(crate) part: Option<usize>,
    /// Pieces between consecutive points.
    pieces: Range<usize>,
    outer_radius_mm: Option<f64>,
    inner_radius_mm: f64,
    /// Later layers over the same pieces, which take the place of this one.
    covers: Vec<Cover>,
}

/// Where a layer has material.
#[derive(Debug, Clone, PartialEq)]
struct Cover {
    pieces: Range<usize>,
    outer_radius_mm: Option<f64>,
    inner_radius_mm: f64,
}

/// A device with its centre line refined and divided where its parts start and end.
#[derive(Debug, Clone)]
pub(crate) struct RefinedDevice {
    pub(crate) points: Vec<DevicePoint>,
    pub(crate) layers: Vec<Layer>,
    /// Number of the first points that are those of its shaft, outside the sheath's mouth.
    pub(crate) outside: usize,
}

/// Thickness up to which what a later layer leaves of a layer is rounding.
const THINNEST_MM: f64 = 1e-9;
/// Distance from a point within which a division is made at the point.
const SAME_PLACE_MM: f64 = 1e-6;

impl RefinedDevice {
    /// The devices with something to draw.
    ///
    /// # Errors
    /// [`Error::Parameter`] for points or parts that are not finite or out of order.
    pub(crate) fn all(devices: &[DeviceView]) -> Result<Vec<Self>> {
        let mut refined = Vec::with_capacity(devices.len());
        for device in devices {
            let points = device.refined()?;
            if !points.is_empty() {
                refined.push(Self::cut(points, device)?);
            }
        }
        Ok(refined)
    }

    /// As [`Self::all`], with the shafts of devices in a sheath: what is in the beam.
    ///
    /// # Errors
    /// As [`Self::all`], and for a sheath that is not finite.
    pub(crate) fn all_with_shafts(devices: &[DeviceView], around: Outside) -> Result<Vec<Self>> {
        let mut refined = Vec::with_capacity(devices.len());
        for device in devices {
            let mut points = device.refined()?;
            let Some(first) = points.first().copied() else { continue };
            let shaft = device.shaft(&first, around)?;
            let outside = shaft.len().saturating_sub(1);
            if outside == 0 {
                refined.push(Self::cut(points, device)?);
                continue;
            }
            let mouth_mm = first.position_mm;
            points.splice(..1, shaft);
            let from_tip_mm: f64 =
                points[outside..].windows(2).map(|p| (p[1].position_mm - p[0].position_mm).norm()).sum();
            let mut cut = Self::cut(points, &device.with_endless_shaft(from_tip_mm))?;
            // Parts may have divided the shaft.
            let at_mouth = |point: &DevicePoint| point.position_mm == mouth_mm;
            cut.outside = cut.points.iter().position(at_mouth).unwrap_or(outside);
            refined.push(cut);
        }
        Ok(refined)
    }

    fn cut(mut points: Vec<DevicePoint>, device: &DeviceView) -> Result<Self> {
        if device.parts.is_empty() {
            let pieces = 0..points.len() - 1;
            let layer = Layer {
                material: device.material,
                part: None,
                pieces,
                outer_radius_mm: None,
                inner_radius_mm: 0.0,
                covers: vec![],
            };
            return Ok(Self { points, layers: vec![layer], outside: 0 });
        }
        // Arc length from the tip, which is the last point.
        let mut from_tip = vec![0.0; points.len()];
        for i in (0..points.len() - 1).rev() {
            from_tip[i] = from_tip[i + 1] + (points[i + 1].position_mm - points[i].position_mm).norm();
        }
        for part in &device.parts {
            for cut in part.from_tip_mm.into_iter().flatten() {
                let after = from_tip.partition_point(|&s| s > cut);
                if after == 0 || after == points.len() {
                    continue;
                }
                let [s0, s1] = [from_tip[after - 1], from_tip[after]];
                if s0 - cut > SAME_PLACE_MM && cut - s1 > SAME_PLACE_MM {
                    let w = (s0 - cut) / (s0 - s1);
                    let [a, b] = [points[after - 1], points[after]];
                    let mix = |x: Vec3, y: Vec3| x * (1.0 - w) + y * w;
                    let point = DevicePoint {
                        position_mm: mix(a.position_mm, b.position_mm),
                        tangent: mix(a.tangent, b.tangent),
                        radius_mm: a.radius_mm * (1.0 - w) + b.radius_mm * w,
                    };
                    points.insert(after, point);
                    from_tip.insert(after, cut);
                }
            }
        }
        let mut layers: Vec<Layer> = Vec::with_capacity(device.parts.len());
        for (i, part) in device.parts.iter().enumerate() {
            part.validate(&format!("device.parts[{i}]"))?;
            let [near, far] = part.from_tip_mm.unwrap_or([0.0, f64::MAX]);
            let first = from_tip.partition_point(|&s| s > far + SAME_PLACE_MM);
            let last = from_tip.partition_point(|&s| s >= near - SAME_PLACE_MM).saturating_sub(1);
            if first < last {
                let radii = points[first..=last].iter().map(|point| point.radius_mm);
                let outer = part.outer_radius_mm.unwrap_or(radii.fold(f64::INFINITY, f64::min));
                if part.inner_radius_mm >= outer {
                    return Err(bore_too_wide(&format!("device.parts[{i}]"), part.inner_radius_mm, outer));
                }
                let layer = Layer {
                    material: part.material.or(device.material),
                    part: Some(i),
                    pieces: first..last,
                    outer_radius_mm: part.outer_radius_mm,
                    inner_radius_mm: part.inner_radius_mm,
                    covers: vec![],
                };
                for under in
                    layers.iter_mut().filter(|under| under.pieces.start < last && first < under.pieces.end)
                {
                    under.covers.push(layer.cover());
                }
                layers.push(layer);
            }
        }
        Ok(Self { points, layers, outside: 0 })
    }
}

/// A part whose lumen leaves nothing of its device.
pub(crate) fn bore_too_wide(name: &str, bore_mm: f64, outer_mm: f64) -> Error {
    let remedy = format!(
        "the device is {outer_mm} mm thick there, and nothing is left of it: give a narrower bore, or leave out parts that were written for \
         another device"
    );
    Error::parameter(format!("{name}.inner_radius_mm"), bore_mm, remedy)
}

impl RefinedDevice {
    /// Whether medium can flow through it.
    pub(crate) fn has_bore(&self) -> bool {
        self.layers.iter().any(|layer| layer.inner_radius_mm > 0.0)
    }

    /// Visible material and outer radius of a piece: those of the last part there.
    pub(crate) fn looks(&self, piece: usize) -> (Option<Material>, Option<f64>) {
        let layer = self.layers.iter().rev().find(|layer| layer.pieces.contains(&piece));
        layer.map_or((None, None), |layer| (layer.material, layer.outer_radius_mm))
    }
}

impl Layer {
    /// The frusta that form this layer out of all `pieces` of its device, each with the sign of its length.
    pub(crate) fn signed(&self, pieces: &[Piece]) -> Vec<(Piece, f64)> {
        let mut signed = Vec::with_capacity(2 * self.pieces.len());
        for (index, piece) in self.pieces.clone().zip(&pieces[self.pieces.clone()]) {
            let own = piece.middle_radius();
            // Inner and outer radii of the rings of it that are left.
            let mut rings = vec![[self.inner_radius_mm, self.outer_radius_mm.unwrap_or(own)]];
            for cover in self.covers.iter().filter(|cover| cover.pieces.contains(&index)) {
                let [low, high] = [cover.inner_radius_mm, cover.outer_radius_mm.unwrap_or(own)];
                let left = rings.into_iter().flat_map(|[a, b]| [[a, b.min(low)], [a.max(high), b]]);
                rings = left.filter(|[a, b]| b - a > THINNEST_MM).collect();
            }
            for [inner, outer] in rings {
                let is_own = self.outer_radius_mm.is_none() && outer == own;
                signed.push((if is_own { *piece } else { piece.with_radius(outer) }, 1.0));
                if inner > 0.0 {
                    signed.push((piece.with_radius(inner), -1.0));
                }
            }
        }
        signed
    }

    /// What it covers of earlier layers.
    fn cover(&self) -> Cover {
        let (outer_radius_mm, inner_radius_mm) = (self.outer_radius_mm, self.inner_radius_mm);
        Cover { pieces: self.pieces.clone(), outer_radius_mm, inner_radius_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius: f64, degrees: f64, points: usize, wire: f64) -> DeviceView {
        let points = (0..points)
            .map(|i| {
                let a = degrees.to_radians() * i as f64 / (points - 1) as f64;
                DevicePoint {
                    position_mm: Vec3::new(radius * a.cos(), radius * a.sin(), 0.0),
                    tangent: Vec3::new(-a.sin(), a.cos(), 0.0),
                    radius_mm: wire,
                }
            })
            .collect();
        DeviceView { points, ..DeviceView::default() }
    }

    #[test]
    fn a_bend_of_five_millimetres_is_refined_onto_its_circle() {
        let wire = 0.2;
        let fine = arc(5.0, 180.0, 7, wire).refined().unwrap();
        for pair in fine.windows(2) {
            let middle = (pair[0].position_mm + pair[1].position_mm) / 2.0;
            assert!((middle.norm() - 5.0).abs() < SAGITTA * wire + 1e-3, "{}", middle.norm());
            assert!((pair[0].position_mm.norm() - 5.0).abs() < 1e-3);
        }
        // Without refinement the same check fails.
        let coarse = arc(5.0, 180.0, 7, wire).points;
        let middle = (coarse[0].position_mm + coarse[1].position_mm) / 2.0;
        assert!((middle.norm() - 5.0).abs() > 10.0 * SAGITTA * wire);
    }

    #[test]
    fn a_thread_of_no_thickness_is_cut_into_pieces_that_memory_holds() {
        let fine = arc(1000.0, 180.0, 20_000, 1e-300).refined().unwrap();
        assert!(fine.len() <= MOST_PIECES_IN_ALL && fine.len() > MOST_PIECES_IN_ALL / 2, "{}", fine.len());
    }

    #[test]
    fn mitres_are_shared_and_ends_are_flat() {
        let fine = arc(5.0, 90.0, 4, 0.2).refined().unwrap();
        let pieces = pieces(&fine);
        for pair in pieces.windows(2) {
            assert_eq!(pair[0].planes[1], pair[1].planes[0]);
        }
        assert!((pieces[0].planes[0] - pieces[0].axis).norm() < 1e-12);
    }

    #[test]
    fn too_few_or_coinciding_points_draw_nothing_and_bad_ones_are_named() {
        let mut device = arc(5.0, 10.0, 2, 0.2);
        device.points[1] = device.points[0];
        assert!(device.refined().unwrap().is_empty());
        device.points.truncate(1);
        assert!(device.refined().unwrap().is_empty());
        device.points[0].radius_mm = f64::NAN;
        assert!(device.refined().unwrap_err().to_string().contains("device.points[0]"));
    }

    #[test]
    fn a_later_part_takes_the_place_of_what_it_covers() {
        let mut wire = arc(50.0, 90.0, 9, 0.445);
        let part = |from_tip_mm, outer_radius_mm, inner_radius_mm| DevicePart {
            from_tip_mm,
            outer_radius_mm,
            inner_radius_mm,
            ..DevicePart::default()
        };
        // A core, a coil in it, a band about both, and a tube in the core that leaves its inside.
        let near = Some([0.0, 30.0]);
        wire.parts = vec![
            part(None, None, 0.0),
            part(near, Some(0.445), 0.4),
            part(Some([10.0, 20.0]), Some(0.5), 0.445),
            part(Some([40.0, 50.0]), Some(0.3), 0.2),
        ];
        let refined = RefinedDevice::all(std::slice::from_ref(&wire)).unwrap().remove(0);
        let pieces = pieces(&refined.points);
        let total: f64 = pieces.iter().map(|p| (p.end - p.start).norm()).sum();
        // Volumes over π of the layers, and what they are made of.
        let volume = |layer: &Layer| -> f64 {
            layer
                .signed(&pieces)
                .iter()
                .map(|(p, sign)| sign * p.radius * p.radius * (p.end - p.start).norm())
                .sum()
        };
        let square = |r: f64| r * r;
        let exact = [
            30.0 * square(0.4)
                + 10.0 * (square(0.445) - square(0.3) + square(0.2))
                + (total - 40.0) * square(0.445),
            30.0 * (square(0.445) - square(0.4)),
            10.0 * (square(0.5) - square(0.445)),
            10.0 * (square(0.3) - square(0.2)),
        ];
        for (layer, exact) in refined.layers.iter().zip(exact) {
            assert!((volume(layer) - exact).abs() < 1e-6, "{} {exact}", volume(layer));
        }
    }

    #[test]
    fn parts_cut_the_centre_line_at_their_ends_and_bad_ones_are_named() {
        let mut device = arc(50.0, 90.0, 9, 0.9);
        let band = DevicePart {
            from_tip_mm: Some([2.0, 3.5]),
            outer_radius_mm: Some(1.0),
            inner_radius_mm: 0.9,
            ..DevicePart::default()
        };
        let shaft = DevicePart { inner_radius_mm: 0.6, ..DevicePart::default() };
        device.parts = vec![shaft, band, DevicePart { from_tip_mm: Some([500.0, 600.0]), ..band }];
        let refined = RefinedDevice::all(std::slice::from_ref(&device)).unwrap().remove(0);
        assert_eq!(refined.layers.len(), 2, "what is beyond the device is not there");
        let pieces = pieces(&refined.points);
        let length = |layer: &Layer| {
            layer
                .signed(&pieces)
                .iter()
                .filter(|p| p.1 > 0.0)
                .map(|(p, _)| (p.end - p.start).norm())
                .sum::<f64>()
        };
        assert!((length(&refined.layers[1]) - 1.5).abs() < 1e-9);
        assert!((length(&refined.layers[0]) - 50.0 * std::f64::consts::FRAC_PI_2).abs() < 0.04);
        let near = refined.layers[1].signed(&pieces);
        assert!(near.iter().all(|(p, sign)| p.radius == if *sign > 0.0 { 1.0 } else { 0.9 }));
        for (part, key) in [
            (DevicePart { from_tip_mm: Some([3.0, 2.0]), ..band }, "from_tip_mm"),
            (DevicePart { inner_radius_mm: 1.0, ..band }, "inner_radius_mm"),
            (DevicePart { outer_radius_mm: Some(f64::NAN), ..band }, "outer_radius_mm"),
            (DevicePart { outer_radius_mm: None, ..band }, "inner_radius_mm"),
        ] {
            device.parts = vec![part];
            let error = RefinedDevice::all(std::slice::from_ref(&device)).unwrap_err().to_string();
            assert!(error.contains(key) && error.contains("device.parts[0]"), "{error}");
        }
    }
}
