//! Letters for directions, a legend of forces, and all text on a 3D frame.

use endowire_core::Vec3;

use crate::output::{Image, PixelFormat};
use crate::spec::CameraSpec;
use crate::three_d::Camera;
use crate::three_d::scale_bar::{self, INK};
use crate::three_d::solids::{ContactView, FORCE, largest_and_px_per_n};
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
pub(crate) fn draw(image: &mut Image, [right, up]: [Vec3; 2]) {
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
        text(image, at, dot, letter(&direction), ink);
    }
}

/// Annotates a 3D frame as its camera specifies: scale, directions, and the largest of these contact forces.
pub(crate) fn annotate(image: &mut Image, camera: &Camera, spec: &CameraSpec, contacts: &[ContactView]) {
    if spec.scale_bar {
        scale_bar::draw(image, camera);
    }
    if spec.markers {
        draw(image, camera.right_and_up());
        legend(image, contacts);
    }
}

/// An arrow as long as that of the largest force, with its magnitude.
fn legend(image: &mut Image, contacts: &[ContactView]) {
    let (strongest, px_per_n) = largest_and_px_per_n(contacts);
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
    image.fill([left, bottom.saturating_sub(dot)], [length, dot], FORCE);
    for back in 0..3 * dot {
        let x = left + length.saturating_sub(back);
        let half = back / 2;
        image.fill([x, bottom.saturating_sub(dot + half)], [1, 2 * half + dot], FORCE);
    }
    text(image, [left, bottom.saturating_sub(10 * dot)], dot, &label, INK);
}
