//! Text in pixel pictures.

use std::collections::HashMap;

use ab_glyph::{Font, FontRef, ScaleFont, point};

/// A picture in memory; each pixel is 0x00RRGGBB.
pub(super) struct Canvas {
    pub(super) size: [usize; 2],
    pub(super) pixels: Vec<u32>,
    /// How large text is drawn, and the room for it.
    pub(super) scale: Scale,
}

/// Pixels for each one in a window of the usual size and density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale(f64);

impl Scale {
    /// That of a window: text grows with both of its sides, and is never smaller than on its screen elsewhere.
    pub(super) fn of(size: [usize; 2], usual: [usize; 2], density: f64) -> Self {
        let [wide, high] = [0, 1].map(|side| size[side] as f64 / usual[side] as f64);
        Self(wide.min(high).max(density).max(1.0))
    }

    /// So many pixels of the usual size.
    pub(super) fn px(self, usual: usize) -> usize {
        (usual as f64 * self.0).round() as usize
    }
}

impl Canvas {
    pub(super) fn new(size: [usize; 2], scale: Scale) -> Self {
        Self { size, pixels: vec![0; size[0] * size[1]], scale }
    }

    /// Fills a rectangle, clipped to the picture.
    pub(super) fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], colour: u32) {
        let right = (x + width).min(self.size[0]);
        for row in y..(y + height).min(self.size[1]) {
            if x < right {
                self.pixels[row * self.size[0] + x..row * self.size[0] + right].fill(colour);
            }
        }
    }

    /// Blends a colour into a pixel by a fraction.
    fn blend(&mut self, x: usize, y: usize, colour: u32, share: f32) {
        if x >= self.size[0] || y >= self.size[1] {
            return;
        }
        let pixel = &mut self.pixels[y * self.size[0] + x];
        let part = |shift: u32| {
            let (old, new) = ((*pixel >> shift & 255) as f32, (colour >> shift & 255) as f32);
            ((old + (new - old) * share.clamp(0.0, 1.0)) as u32) << shift
        };
        *pixel = part(16) | part(8) | part(0);
    }
}

/// A rasterised glyph: offset of its corner from the pen, width, coverage of its pixels, and advance of the pen.
struct Glyph {
    corner: [i64; 2],
    width: usize,
    shares: Vec<f32>,
    advance: f32,
}

/// Draws text and caches its glyphs.
pub(super) struct Writer {
    font: FontRef<'static>,
    glyphs: HashMap<(char, u32), Glyph>,
}

impl Writer {
    /// Uses the font that is part of the program, since a bare machine has none. `None` if it cannot be read.
    pub(super) fn new() -> Option<Self> {
        let font = FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR).ok()?;
        Some(Self { font, glyphs: HashMap::new() })
    }

    /// Writes a line from a position on its base line, with letters of `usual_px` at the usual size; returns where it
    /// ends.
    pub(super) fn write(
        &mut self,
        canvas: &mut Canvas,
        [x, y]: [usize; 2],
        usual_px: usize,
        colour: u32,
        text: &str,
    ) -> usize {
        let size_px = canvas.scale.px(usual_px) as u32;
        let mut pen = x as f32;
        for c in text.chars() {
            let font = &self.font;
            let glyph = self.glyphs.entry((c, size_px)).or_insert_with(|| outlined(font, c, size_px));
            for (index, share) in glyph.shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                let column = pen as i64 + glyph.corner[0] + (index % glyph.width) as i64;
                let row = y as i64 + glyph.corner[1] + (index / glyph.width) as i64;
                if let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) {
                    canvas.blend(column, row, colour, *share);
                }
            }
            pen += glyph.advance;
        }
        pen as usize
    }
}

fn outlined(font: &FontRef<'_>, c: char, size_px: u32) -> Glyph {
    let scaled = font.as_scaled(size_px as f32);
    let glyph = font.glyph_id(c).with_scale_and_position(size_px as f32, point(0.0, 0.0));
    let advance = scaled.h_advance(glyph.id);
    let Some(outline) = font.outline_glyph(glyph) else {
        return Glyph { corner: [0; 2], width: 1, shares: vec![], advance };
    };
    let bounds = outline.px_bounds();
    let width = bounds.width().max(1.0) as usize;
    let mut shares = vec![0.0; width * bounds.height().max(1.0) as usize];
    outline.draw(|x, y, share| {
        if let Some(place) = shares.get_mut(y as usize * width + x as usize) {
            *place = share;
        }
    });
    Glyph { corner: [bounds.min.x as i64, bounds.min.y as i64], width, shares, advance }
}
