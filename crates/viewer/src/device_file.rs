//! Radiopacity from a device file, as parts to draw.

use endowire_core::device::{Device, DeviceFile, Part, Section};
use endowire_core::{Error, Result};

use crate::device::DevicePart;
use crate::material::Material;

/// The parts of a device to draw: walls of tubes and wires, and the coats on them. Empty for a solid device without
/// materials.
///
/// # Errors
/// [`Error::Parameter`] for an unknown material, with the part that names it and the most similar name.
pub fn device_parts(file: &DeviceFile) -> Result<Vec<DevicePart>> {
    Ok(named_parts(file)?.into_iter().map(|(part, _)| part).collect())
}

/// The names of these parts in the file; empty if materials are unknown.
pub(crate) fn device_part_names(file: &DeviceFile) -> Vec<String> {
    named_parts(file).unwrap_or_default().into_iter().map(|(_, name)| name).collect()
}

fn named_parts(file: &DeviceFile) -> Result<Vec<(DevicePart, String)>> {
    let plain = |part: &Part| {
        part.material.is_none() && part.coat.is_none() && part.at(0.0).inner_radius_mm.is_none()
    };
    if file.parts.iter().all(plain) {
        return Ok(vec![]);
    }
    let mut named = Vec::new();
    for part in &file.parts {
        let layers = Layers::of(part)?;
        let mut begin_mm = part.from_tip_mm[0];
        let mut drawn: Vec<DevicePart> = Vec::new();
        for section in part.sections() {
            let end_mm = begin_mm + section.length_mm;
            for layer in layers.across(&section, [begin_mm, end_mm]) {
                push(&mut drawn, layer);
            }
            begin_mm = end_mm;
        }
        named.extend(drawn.into_iter().map(|layer| (layer, part.name.clone())));
    }
    Ok(named)
}

/// The sections of a device without a file, as tubes to draw; empty if all are solid.
pub fn section_parts(device: &Device) -> Vec<DevicePart> {
    if device.sections().iter().all(|section| section.inner_radius_mm.is_none()) {
        return Vec::new();
    }
    let mut begin = 0.0;
    let part = |section: &Section| {
        let from = begin;
        begin += section.length_mm;
        let from_tip_mm = Some([from, begin]);
        let inner_radius_mm = section.inner_radius_mm.unwrap_or(0.0);
        DevicePart { from_tip_mm, inner_radius_mm, ..DevicePart::default() }
    };
    device.sections().iter().map(part).collect()
}

/// Adds a stretch of a layer, or extends the layer if it continues.
fn push(drawn: &mut Vec<DevicePart>, layer: DevicePart) {
    let alike = |before: &&mut DevicePart| {
        DevicePart { from_tip_mm: None, ..**before } == DevicePart { from_tip_mm: None, ..layer }
    };
    match (drawn.iter_mut().find(alike).and_then(|before| before.from_tip_mm.as_mut()), layer.from_tip_mm) {
        (Some(before), Some(more)) => before[1] = more[1],
        _ => drawn.push(layer),
    }
}

/// Materials of a part, from the inside outwards.
struct Layers {
    wall: Option<Material>,
    coat: Option<(Material, f64)>,
}

impl Layers {
    fn of(part: &Part) -> Result<Self> {
        let material = |name: &str, key: &str| {
            name.parse::<Material>().map_err(|error| match error {
                Error::Parameter { value, remedy, .. } => {
                    Error::parameter(format!("part \"{}\".{key}", part.name), value, remedy)
                }
                other => other,
            })
        };
        let wall = part.material.as_deref().map(|name| material(name, "material")).transpose()?;
        let coat = match &part.coat {
            Some(coat) => Some((material(&coat.material, "coat.material")?, coat.thickness_mm)),
            None => None,
        };
        Ok(Self { wall, coat })
    }

    /// The layers of a section between two arc lengths from the tip, the outermost last.
    fn across(&self, section: &Section, from_tip_mm: [f64; 2]) -> impl Iterator<Item = DevicePart> {
        let from_tip_mm = Some(from_tip_mm);
        let inner_radius_mm = section.inner_radius_mm.unwrap_or(0.0);
        let under = self.coat.map(|(_, thickness_mm)| section.radius_mm - thickness_mm);
        let wall = DevicePart { from_tip_mm, material: self.wall, outer_radius_mm: under, inner_radius_mm };
        let coat = self.coat.zip(under).map(|((material, _), under)| DevicePart {
            from_tip_mm,
            material: Some(material),
            outer_radius_mm: None,
            inner_radius_mm: under,
        });
        std::iter::once(wall).chain(coat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> DeviceFile {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.toml");
        std::fs::write(&path, text).unwrap();
        DeviceFile::read(&path).unwrap()
    }

    const TIP: &str = "name = \"d\"\nkind = \"catheter\"\n[[part]]\nname = \"band\"\nlength_mm = 2.0\nouter_diameter_mm = 2.0\n\
                       inner_diameter_mm = 1.0\nbending_stiffness_nmm2 = 1.0\nmaterial = \"pebax_baso4_40\"\n\
                       coat = { material = \"platinum\", thickness_mm = 0.1 }\n";
    const TAPER: &str = "[[part]]\nname = \"taper\"\nlength_mm = 8.0\nouter_diameter_mm = [2.0, 3.0]\ninner_diameter_mm = 1.0\n\
                         bending_stiffness_nmm2 = 1.0\nsections = 4\nmaterial = \"nitinol\"\n";

    #[test]
    fn a_band_is_a_ring_on_its_wall_and_a_taper_with_an_even_lumen_is_one_part() {
        let parts = device_parts(&file(&format!("{TIP}{TAPER}"))).unwrap();
        let part = |from_tip_mm, material, outer_radius_mm, inner_radius_mm| DevicePart {
            from_tip_mm: Some(from_tip_mm),
            material: Some(material),
            outer_radius_mm,
            inner_radius_mm,
        };
        let expected = [
            part([0.0, 2.0], Material::PebaxBariumSulphate40, Some(0.9), 0.5),
            part([0.0, 2.0], Material::Platinum, None, 0.9),
            part([2.0, 10.0], Material::Nitinol, None, 0.5),
        ];
        assert_eq!(parts, expected);
    }

    #[test]
    fn under_a_coat_a_taper_is_drawn_section_by_section() {
        let coated = TAPER
            .replace("\"nitinol\"", "\"nitinol\"\ncoat = { material = \"tungsten\", thickness_mm = 0.2 }");
        let parts = device_parts(&file(&format!("kind = \"catheter\"\n{coated}"))).unwrap();
        assert_eq!(parts.len(), 8);
        assert!(parts.iter().all(|part| part.validate("part").is_ok()));
    }

    #[test]
    fn a_plain_rod_has_no_parts_and_an_unknown_material_is_named() {
        let rod = file("[[section]]\nlength_mm = 5.0\nradius_mm = 1.0\nbending_stiffness_nmm2 = 1.0\n");
        assert!(device_parts(&rod).unwrap().is_empty());
        for (from, key) in [("pebax_baso4_40", "material"), ("\"platinum", "coat.material")] {
            let error = device_parts(&file(&TIP.replace(from, &format!("{from}x")))).unwrap_err().to_string();
            assert!(error.starts_with(&format!("part \"band\".{key} = ")), "{error}");
            assert!(error.contains("did you mean"), "{error}");
        }
    }
}
