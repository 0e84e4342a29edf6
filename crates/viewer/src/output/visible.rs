//! How well an object stands out from its surroundings in a picture: its contrast to noise.
//!
//! In each tile of the picture the mean grey of the object is compared with that of a ring about it, outside all
//! devices. Contrast is the mean difference over tiles, noise the root mean square of the standard deviations in the
//! rings, both weighted by the object's pixels:
//!
//! ```text
//! CNR = |Σ n (ring − object)| / √(Σ n · Σ n σ²)
//! ```
//!
//! Whether an object is told from its surroundings depends on its size, too: by the criterion of Rose, a disc of n
//! pixels is from CNR · √n of about 5 on.

use endowire_core::{Error, Result};

use super::{Image, Mask, PixelFormat};

/// Side of a tile, pixels.
const TILE: usize = 16;
/// Distances from the object between which the ring is, pixels.
const RING: [usize; 2] = [3, 6];
/// Fewest pixels of a ring in a tile whose deviation is worth something.
const FEWEST: f64 = 8.0;

/// Sums over a tile.
#[derive(Debug, Clone, Copy, Default)]
struct Tile {
    object: [f64; 2],
    /// Number, sum and sum of squares.
    ring: [f64; 3],
}

impl Mask {
    /// Contrast to noise of what this mask holds in a picture of its size; pixels of `others` do not count as its
    /// surroundings. `None` where nothing surrounds it, or nothing varies there.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a picture or mask of another size, or a picture with colours.
    pub fn contrast_to_noise(&self, image: &Image, others: &[&Self]) -> Result<Option<f64>> {
        if image.format() == PixelFormat::Rgba8 {
            return Err(Error::parameter("image", "with colours", "must be grey"));
        }
        self.check_size([image.width(), image.height()])?;
        Ok(contrast_to_noise(image, self, &self.all_of(others)?))
    }

    /// The same without the pixels of `others`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a mask of another size.
    pub fn without(&self, others: &[&Self]) -> Result<Self> {
        let hidden = self.all_of(others)?;
        let left = self.pixels().iter().copied().filter(|&pixel| !hidden[pixel as usize]);
        Ok(Self::new(self.size_px(), left.collect()))
    }

    /// Which pixels any of these masks holds.
    fn all_of(&self, masks: &[&Self]) -> Result<Vec<bool>> {
        masks.iter().try_for_each(|mask| self.check_size(mask.size_px()))?;
        let mut all = vec![false; self.size_px().map(|n| n as usize).iter().product()];
        masks.iter().flat_map(|mask| mask.pixels()).for_each(|&pixel| all[pixel as usize] = true);
        Ok(all)
    }

    fn check_size(&self, other: [u32; 2]) -> Result<()> {
        if other == self.size_px() {
            return Ok(());
        }
        let remedy = format!("the mask has {:?}", self.size_px());
        Err(Error::parameter("pixels", format!("{other:?}"), remedy))
    }
}

fn contrast_to_noise(image: &Image, object: &Mask, hidden: &[bool]) -> Option<f64> {
    let [width, height] = object.size_px().map(|n| n as usize);
    let mut own = vec![false; width * height];
    object.pixels().iter().for_each(|&pixel| own[pixel as usize] = true);
    let grey = |pixel: usize| match image.format() {
        PixelFormat::Gray16 => {
            f64::from(u16::from_be_bytes([image.data()[2 * pixel], image.data()[2 * pixel + 1]]))
        }
        _ => f64::from(image.data()[pixel]),
    };
    let [near, far] = RING.map(|reach| grown(&own, [width, height], reach));
    let columns = width.div_ceil(TILE);
    let mut tiles = vec![Tile::default(); columns * height.div_ceil(TILE)];
    for pixel in (0..width * height).filter(|&pixel| far[pixel]) {
        let tile = &mut tiles[pixel / width / TILE * columns + pixel % width / TILE];
        let v = grey(pixel);
        if own[pixel] {
            tile.object = [tile.object[0] + 1.0, tile.object[1] + v];
        } else if !near[pixel] && !hidden[pixel] {
            tile.ring = [tile.ring[0] + 1.0, tile.ring[1] + v, tile.ring[2] + v * v];
        }
    }
    let [mut count, mut contrast, mut variance] = [0.0; 3];
    for tile in tiles.iter().filter(|tile| tile.object[0] > 0.0 && tile.ring[0] >= FEWEST) {
        let n = tile.object[0];
        let mean = tile.ring[1] / tile.ring[0];
        count += n;
        contrast += n * (mean - tile.object[1] / n);
        variance += n * (tile.ring[2] / tile.ring[0] - mean * mean).max(0.0);
    }
    (variance > 0.0).then(|| contrast.abs() / (count * variance).sqrt())
}

/// The pixels at most this far from those given, along rows and columns.
fn grown(own: &[bool], [width, height]: [usize; 2], reach: usize) -> Vec<bool> {
    let mut rows = vec![false; own.len()];
    let mut all = rows.clone();
    for (pixel, _) in own.iter().enumerate().filter(|(_, own)| **own) {
        let (y, x) = (pixel / width, pixel % width);
        rows[y * width + x.saturating_sub(reach)..y * width + (x + reach + 1).min(width)].fill(true);
    }
    for (pixel, _) in rows.iter().enumerate().filter(|(_, row)| **row) {
        let (y, x) = (pixel / width, pixel % width);
        (y.saturating_sub(reach)..(y + reach + 1).min(height)).for_each(|y| all[y * width + x] = true);
    }
    all
}

#[cfg(test)]
mod tests {
    use endowire_core::random::{splitmix64, unit};

    use super::*;

    /// A dark vertical line of a depth in noise of a deviation.
    fn line(depth: f64, deviation: f64) -> (Image, Mask) {
        let (mut data, mut pixels) = (vec![], vec![]);
        for pixel in 0..64 * 64_u32 {
            let on = pixel % 64 == 32;
            // Even from −√3 to √3.
            let noise = (unit(splitmix64(7, u64::from(pixel))) - 0.5) * 12.0_f64.sqrt();
            let grey = 30_000.0 - if on { depth } else { 0.0 } + deviation * noise;
            data.extend((grey as u16).to_be_bytes());
            if on {
                pixels.push(pixel);
            }
        }
        (Image::new(64, 64, PixelFormat::Gray16, data), Mask::new([64, 64], pixels))
    }

    #[test]
    fn a_line_in_noise_has_its_depth_over_the_deviation() {
        let none = vec![false; 64 * 64];
        for (depth, deviation) in [(900.0, 300.0), (300.0, 600.0)] {
            let (image, mask) = line(depth, deviation);
            let found = contrast_to_noise(&image, &mask, &none).unwrap();
            // More than two standard deviations of a mean of 64 pixels.
            assert!((found - depth / deviation).abs() < 0.3, "{found} {}", depth / deviation);
        }
        // Counter-checks: what is not there, and what has no surroundings.
        let (image, mask) = line(0.0, 300.0);
        assert!(contrast_to_noise(&image, &mask, &none).unwrap() < 0.3);
        assert_eq!(contrast_to_noise(&image, &mask, &vec![true; 64 * 64]), None);
    }
}
