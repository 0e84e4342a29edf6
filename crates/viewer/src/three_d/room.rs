//! Places of annotations in a picture: in a small one there is no room for all of them.

use crate::output::Image;

/// What is taken of a picture.
#[derive(Debug)]
pub(super) struct Room {
    size_px: [u32; 2],
    /// Upper left corners and sizes, pixels.
    taken: Vec<[[u32; 2]; 2]>,
}

impl Room {
    pub(super) fn new(image: &Image) -> Self {
        Self { size_px: [image.width(), image.height()], taken: vec![] }
    }

    /// Takes a rectangle, given its upper left corner and its size; false if it leaves the picture or covers what is
    /// there already: then the annotation is left out.
    pub(super) fn take(&mut self, at: [u32; 2], size_px: [u32; 2]) -> bool {
        let inside = [0, 1].iter().all(|&k| at[k].saturating_add(size_px[k]) <= self.size_px[k]);
        let apart = |[other, other_px]: &[[u32; 2]; 2]| {
            [0, 1].iter().any(|&k| at[k] + size_px[k] <= other[k] || other[k] + other_px[k] <= at[k])
        };
        let free = inside && self.taken.iter().all(apart);
        if free {
            self.taken.push([at, size_px]);
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::PixelFormat;

    #[test]
    fn what_covers_another_or_leaves_the_picture_has_no_room() {
        let image = Image::new(20, 10, PixelFormat::Gray8, vec![0; 200]);
        let mut room = Room::new(&image);
        assert!(room.take([0, 0], [10, 5]) && room.take([10, 0], [10, 5]) && room.take([0, 5], [20, 5]));
        assert!(!room.take([9, 4], [1, 1]) && !room.take([0, 0], [20, 10]));
        let mut room = Room::new(&image);
        assert!(!room.take([15, 0], [6, 1]) && !room.take([0, u32::MAX], [1, 1]));
        assert!(room.take([14, 0], [6, 10]), "what had no room took none");
    }
}
