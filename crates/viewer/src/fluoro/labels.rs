//! Labels of devices and contacts in a view.

use endowire_core::{Result, Vec3};

use crate::c_arm::CArm;
use crate::cpu::{Coverage, layers_in_beam};
use crate::device::DeviceView;
use crate::output::{ContactLabel, DeviceLabel, Image, Labels, Mask, PartLabel, PixelFormat};
use crate::scene::Setup;
use crate::xray::Exposure;

/// Labels of a frame of `devices`.
///
/// # Errors
/// [`endowire_core::Error::Parameter`] for a device with values that are not finite.
pub(crate) fn labels(
    setup: &Setup,
    c_arm: &CArm,
    devices: &[DeviceView],
    contacts_mm: &[Vec3],
    (vessel, exposure): (Option<Mask>, Exposure),
) -> Result<Labels> {
    let contact = |point: &Vec3| {
        let pixel = seen(c_arm, point);
        let visible = pixel.is_some_and(|pixel| c_arm.sees(pixel));
        ContactLabel { pixel, position_mm: (*point).into(), visible }
    };
    let [width, height] = c_arm.size_px();
    let mut mask = vec![0_u8; width as usize * height as usize];
    // For a whole device, and for a part.
    let mut room = [Coverage::new(c_arm), Coverage::new(c_arm)];
    let mut labelled = Vec::with_capacity(devices.len());
    for (number, device) in (1_u8..=u8::MAX).zip(devices) {
        let label = device_label(setup, c_arm, device, &mut room)?;
        label.mask.pixels().iter().for_each(|&pixel| mask[pixel as usize] = number);
        labelled.push(label);
    }
    Ok(Labels {
        size_px: [width, height],
        camera_matrix: c_arm.matrix(),
        exposure,
        devices: labelled,
        contacts: contacts_mm.iter().map(contact).collect(),
        mask: Image::new(width, height, PixelFormat::Gray8, mask),
        vessel,
    })
}

/// Projection of a point, if it is between source and detector.
fn seen(c_arm: &CArm, point: &Vec3) -> Option<[f64; 2]> {
    c_arm.is_between(&c_arm.in_beam(point)).then(|| c_arm.project(point))
}

/// The last part of a line that is in the picture, from its edge on.
fn within(line: &[[f64; 2]], size_px: [u32; 2]) -> Vec<[f64; 2]> {
    let size = size_px.map(f64::from);
    let is_in = |at: &[f64; 2]| (0..2).all(|k| (0.0..=size[k]).contains(&at[k]));
    let Some(last_out) = line.iter().rposition(|at| !is_in(at)) else { return line.to_vec() };
    let Some(&first_in) = line.get(last_out + 1) else { return vec![] };
    let out = line[last_out];
    // The largest part of the way outwards that stays in.
    let part = (0..2).map(|k| {
        let run = out[k] - first_in[k];
        let side = if run > 0.0 { size[k] } else { 0.0 };
        if run == 0.0 { 1.0 } else { ((side - first_in[k]) / run).clamp(0.0, 1.0) }
    });
    let part = part.fold(1.0, f64::min);
    let edge = [0, 1].map(|k| first_in[k] + part * (out[k] - first_in[k]));
    std::iter::once(edge).chain(line[last_out + 1..].iter().copied()).collect()
}

fn device_label(
    setup: &Setup,
    c_arm: &CArm,
    device: &DeviceView,
    [whole, one]: &mut [Coverage; 2],
) -> Result<DeviceLabel> {
    let mut parts = Vec::new();
    let mut mask = Mask::new(c_arm.size_px(), vec![]);
    let refined = setup.in_beam(std::slice::from_ref(device))?;
    let (shaft, points) =
        refined.first().map_or_else(Default::default, |one| one.points.split_at(one.outside));
    for device_in_beam in &refined {
        let layers = layers_in_beam(c_arm, device_in_beam);
        for (layer, pieces) in &layers {
            pieces.iter().filter(|(_, sign)| *sign > 0.0).for_each(|(piece, _)| one.add(c_arm, piece));
            whole.join(one);
            let covered = one.take(c_arm);
            if let Some(number) = layer.part {
                let material = layer.material.unwrap_or(setup.spec.xray.device_material);
                let from_tip_mm = device.parts[number].from_tip_mm;
                parts.push(PartLabel { number, material, from_tip_mm, mask: covered });
            }
        }
        mask = whole.take(c_arm);
    }
    // The mouth belongs to both.
    let shaft = shaft.iter().chain(points.first().filter(|_| !shaft.is_empty()));
    let shaft: Vec<[f64; 2]> = shaft.filter_map(|p| seen(c_arm, &p.position_mm)).collect();
    let shaft_px = within(&shaft, c_arm.size_px());
    let shown = points.iter().map(|p| p.position_mm).filter_map(|p| Some((seen(c_arm, &p)?, p)));
    let (centre_line_px, places): (Vec<[f64; 2]>, Vec<Vec3>) = shown.unzip();
    let tip = points.last().map(|p| p.position_mm);
    let tip_px = tip.and_then(|tip| seen(c_arm, &tip));
    Ok(DeviceLabel {
        shown: None,
        shaft_px,
        centre_line_px,
        depth_mm: places.iter().map(|p| c_arm.depth_mm(p)).collect(),
        centre_line_mm: places.into_iter().map(Into::into).collect(),
        tip_px,
        tip_mm: tip.map(Into::into),
        tip_visible: tip_px.is_some_and(|p| c_arm.sees(p)),
        parts,
        mask,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_comes_into_the_picture_begins_at_its_edge() {
        let line = [[5.0, 5.0], [50.0, 300.0], [50.0, 100.0], [40.0, 60.0]];
        assert_eq!(within(&line, [100, 120]), [[50.0, 120.0], [50.0, 100.0], [40.0, 60.0]]);
        assert_eq!(within(&line[2..], [100, 120]), line[2..]);
        assert!(within(&line[..2], [100, 120]).is_empty());
    }
}
