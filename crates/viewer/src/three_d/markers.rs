//! Letters for directions, a legend of forces, and all text on a 3D frame.

use endowire_core::Vec3;

use crate::output::{Image, PixelFormat};
use crate::spec::CameraSpec;
use crate::three_d::Camera;
use crate::three_d::room::Room;
use crate::three_d::scale_bar::{self, INK};
use crate::three_d::solids::{ContactView, FORCE, scale_and_px_per_n};
use crate::three_d::text::{ROWS, columns, text};

const WHITE: [u8; 4] = [255; 4];

/// Size of a dot, pixels.
fn dot(image: &Image) -> u32 {
    (image.height() / 320).max(1)
}

/// The letter of the patient axis nearest to a direction.
fn letter(direction: &Vec3) -> &'static str {
    let names = [["L", "R"], ["P", "A"], ["H", "F"]];
    let most = direction.iamax();
    names[most][usize::from(direction[most] < 0.0)]
}

/// Letters in the middles of the borders of an image with these directions of columns and rows.
pub(crate) fn draw(image: &mut Image, directions: [Vec3; 2]) {
    let mut room = Room::new(image);
    letters(image, directions, &mut room);
}

fn letters(image: &mut Image, [right, up]: [Vec3; 2], room: &mut Room) {
    let dot = 2 * dot(image);
    let ink = if image.format() == PixelFormat::Rgba8 { INK } else { WHITE };
    let [width, height] = [image.width(), image.height()];
    let [across, down] = [3 * dot, ROWS * dot];
    let middle = [width.saturating_sub(across) / 2, height.saturating_sub(down) / 2];
    let far = [width.saturating_sub(across + 2 * dot), height.saturating_sub(down + 2 * dot)];
    for (at, direction) in [
        ([2 * dot, middle[1]], -right),
        ([far[0], middle[1]], right),
        ([middle[0], 2 * dot], up),
        ([middle[0], far[1]], -up),
    ] {
        if room.take(at, [across, down]) {
            text(image, at, dot, letter(&direction), ink);
        }
    }
}

/// Annotates a 3D frame as its camera specifies: scale, directions, and the scale of these contact forces, as far as
/// there is room.
pub(crate) fn annotate(image: &mut Image, camera: &Camera, spec: &CameraSpec, contacts: &[ContactView]) {
    let mut room = Room::new(image);
    if spec.scale_bar {
        scale_bar::draw(image, camera, &mut room);
    }
    if spec.markers {
        letters(image, camera.right_and_up(), &mut room);
        legend(image, scale_and_px_per_n(contacts, spec.force_n), &mut room);
    }
}

/// An arrow as long as that of the force that sets the scale, with its magnitude.
fn legend(image: &mut Image, (strongest, px_per_n): (f64, f64), room: &mut Room) {
    // An arrow of less than a pixel is none.
    if strongest * px_per_n < 1.0 {
        return;
    }
    let label =
        if strongest < 0.1 { format!("{:.2} mN", 1e3 * strongest) } else { format!("{strongest:.2} N") };
    let dot = dot(image);
    let longer = f64::from(image.width().max(image.height()));
    let length = (strongest * px_per_n * longer / 640.0).round() as u32;
    let wide = length.max(columns(&label) * dot);
    let [left, bottom] =
        [image.width().saturating_sub(wide + 8 * dot), image.height().saturating_sub(8 * dot)];
    // The text, and the arrow with its head.
    if !room.take([left, bottom.saturating_sub(10 * dot)], [wide, 12 * dot]) {
        return;
    }
    image.fill([left, bottom.saturating_sub(dot)], [length, dot], FORCE);
    for back in 0..3 * dot {
        let x = left + length.saturating_sub(back);
        let half = back / 2;
        image.fill([x, bottom.saturating_sub(dot + half)], [1, 2 * half + dot], FORCE);
    }
    text(image, [left, bottom.saturating_sub(10 * dot)], dot, &label, INK);
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::SurfaceMesh;

    use super::*;

    #[test]
    fn annotations_of_a_small_frame_do_not_cover_each_other() {
        let wall = SurfaceMesh {
            vertices_mm: vec![Vec3::zeros(), Vec3::x() * 40.0, Vec3::y() * 40.0, Vec3::z() * 40.0],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let contact = ContactView { position_mm: Vec3::repeat(5.0), force_n: Vec3::x() * 0.05 };
        let pixels = |side: u32, contacts: &[ContactView]| {
            let spec = CameraSpec::default();
            let camera = Camera::new(&spec, [side; 2], &wall, &[]);
            let white = vec![255; 4 * (side * side) as usize];
            let mut image = Image::new(side, side, PixelFormat::Rgba8, white);
            annotate(&mut image, &camera, &spec, contacts);
            image.into_data()
        };
        // There is no room for a legend beside the scale.
        assert!(pixels(64, &[contact]) == pixels(64, &[]));
        assert!(pixels(320, &[contact]) != pixels(320, &[]), "the twin: there is");
        // A given scale has its legend in every frame of a film, also where there are no contacts.
        let given = |contacts: &[ContactView]| {
            let spec = CameraSpec { force_n: Some(0.05), ..CameraSpec::default() };
            let camera = Camera::new(&spec, [320; 2], &wall, &[]);
            let mut image = Image::new(320, 320, PixelFormat::Rgba8, vec![255; 4 * 320 * 320]);
            annotate(&mut image, &camera, &spec, contacts);
            image.into_data()
        };
        assert!(given(&[]) == pixels(320, &[contact]) && given(&[]) == given(&[contact]));
        let ink = pixels(64, &[]).chunks_exact(4).filter(|pixel| *pixel != [255; 4]).count();
        assert!(ink > 40, "{ink} pixels of a scale and of letters");
        // Smaller than a letter.
        assert!(pixels(4, &[contact]).iter().all(|byte| *byte == 255));
    }
}
