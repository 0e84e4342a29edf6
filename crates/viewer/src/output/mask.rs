//! The pixels of a frame that show one object.

use super::{Image, PixelFormat};

/// A set of pixels.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Mask {
    size_px: [u32; 2],
    pixels: Vec<u32>,
}

impl Mask {
    /// From ascending pixel indices, counted row by row.
    pub(crate) fn new(size_px: [u32; 2], pixels: Vec<u32>) -> Self {
        Self { size_px, pixels }
    }

    /// Width and height of the frame.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// Indices of the pixels, counted row by row from the top left, ascending.
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// As an image of 8 bits: 255 inside, 0 elsewhere.
    pub fn image(&self) -> Image {
        let mut data = vec![0; self.size_px.iter().map(|&n| n as usize).product()];
        self.pixels.iter().for_each(|&pixel| data[pixel as usize] = 255);
        Image::new(self.size_px[0], self.size_px[1], PixelFormat::Gray8, data)
    }

    /// Left, top, width and height of its bounding box, as in COCO; `None` if empty.
    pub fn bounds(&self) -> Option<[u32; 4]> {
        let width = self.size_px[0];
        let (first, last) = (self.pixels.first()? / width, self.pixels.last()? / width);
        let columns = self.pixels.iter().map(|pixel| pixel % width);
        let (left, right) = columns.fold((u32::MAX, 0), |(l, r), x| (l.min(x), r.max(x)));
        Some([left, first, right - left + 1, last - first + 1])
    }

    /// Alternating lengths of runs outside and inside, down the columns from the left, as in COCO's uncompressed run
    /// lengths.
    pub fn run_lengths(&self) -> Vec<u32> {
        let [width, height] = self.size_px;
        let mut places: Vec<u32> = self.pixels.iter().map(|p| p % width * height + p / width).collect();
        places.sort_unstable();
        let (mut runs, mut at) = (Vec::new(), 0);
        for run in places.chunk_by(|a, b| a + 1 == *b) {
            runs.extend([run[0] - at, run.len() as u32]);
            at = run[0] + run.len() as u32;
        }
        runs.push(width * height - at);
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_down_the_columns_and_fill_the_picture() {
        // . # .
        // # # .
        let mask = Mask::new([3, 2], vec![1, 3, 4]);
        assert_eq!(mask.run_lengths(), [1, 3, 2]);
        assert_eq!(mask.bounds(), Some([0, 0, 2, 2]));
        assert_eq!(mask.image().data(), [0, 255, 0, 255, 255, 0]);
        let nothing = Mask::new([3, 2], vec![]);
        assert_eq!((nothing.run_lengths(), nothing.bounds()), (vec![6], None));
    }
}
