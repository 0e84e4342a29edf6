//! Devices in front of a detector: their frusta in the beam, and the pixels each may touch.

use std::ops::Range;

use endowire_core::Vec3;

use crate::c_arm::CArm;
use crate::cpu::raster::span;
use crate::device::{DevicePoint, Layer, RefinedDevice};
use crate::device::{Piece, pieces};

/// The frusta of each layer of a device in beam coordinates (columns, rows, depth from the isocentre), with the signs
/// of their lengths. Those not between source and detector cast no shadow: a device may be outside the field of view.
pub(crate) fn layers_in_beam<'a>(
    c_arm: &CArm,
    device: &'a RefinedDevice,
) -> Vec<(&'a Layer, Vec<(Piece, f64)>)> {
    let turned: Vec<DevicePoint> = device
        .points
        .iter()
        .map(|p| DevicePoint {
            position_mm: c_arm.in_beam(&p.position_mm),
            tangent: c_arm.direction_in_beam(&p.tangent),
            radius_mm: p.radius_mm,
        })
        .collect();
    let pieces = pieces(&turned);
    let seen = |piece: &Piece| c_arm.is_between(&piece.start) && c_arm.is_between(&piece.end);
    let layer = |layer: &'a Layer| {
        let mut signed = layer.signed(&pieces);
        signed.retain(|(piece, _)| seen(piece));
        (layer, signed)
    };
    device.layers.iter().map(layer).collect()
}

/// Columns and rows of the pixels that `piece` may touch: those of its two bounding spheres.
pub(crate) fn pixels_of(c_arm: &CArm, piece: &Piece) -> [Range<usize>; 2] {
    let size = c_arm.size_px();
    let reach = piece.reach();
    let ends = [piece.start, piece.end];
    [0, 1].map(|k| {
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for end in ends {
            for side in [-reach, reach] {
                for depth in [-reach, reach] {
                    // A sphere that reaches behind the source may be visible anywhere.
                    if c_arm.sod_mm() + end.z + depth <= 0.0 {
                        return 0..size[k] as usize;
                    }
                    let corner = end + Vec3::new(side, side, depth);
                    let at = c_arm.pixel_of(&corner)[k];
                    (low, high) = (low.min(at), high.max(at));
                }
            }
        }
        span(low, high, size[k])
    })
}
