//! Finished frames: images, row by row from the top left.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::Path;

use endowire_core::file::whole::Part;
use endowire_core::{Error, Result};

/// How a pixel of an [`Image`] is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    /// One byte a pixel, 0 = black.
    Gray8,
    /// Two bytes a pixel, the more significant first, 0 = black.
    Gray16,
    /// Red, green, blue, alpha; one byte each, display (sRGB) values.
    Rgba8,
}

impl PixelFormat {
    /// Bytes a pixel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Gray8 => 1,
            Self::Gray16 => 2,
            Self::Rgba8 => 4,
        }
    }
}

/// A picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    format: PixelFormat,
    data: Vec<u8>,
}

impl Image {
    /// Wraps `data`; its length must be `width · height · format.bytes()`.
    pub(crate) fn new(width: u32, height: u32, format: PixelFormat, data: Vec<u8>) -> Self {
        debug_assert_eq!(data.len(), width as usize * height as usize * format.bytes());
        Self { width, height, format, data }
    }

    /// A picture of one grey, as RGBA.
    pub fn blank([width, height]: [u32; 2], grey: u8) -> Self {
        let data = [grey, grey, grey, 255].repeat(width as usize * height as usize);
        Self::new(width, height, PixelFormat::Rgba8, data)
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// What a pixel consists of.
    pub fn format(&self) -> PixelFormat {
        self.format
    }

    /// All pixels, row by row from the top left.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// All pixels, without a copy.
    pub fn into_data(self) -> Vec<u8> {
        self.data
    }

    /// The bytes of the pixel in column `x` and row `y`, or `None` outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<&[u8]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let start = (y as usize * self.width as usize + x as usize) * self.format.bytes();
        self.data.get(start..start + self.format.bytes())
    }

    /// Fills the visible part of a rectangle, given its upper left corner; grey images use the red value.
    pub(crate) fn fill(&mut self, [left, top]: [u32; 2], size_px: [u32; 2], rgba: [u8; 4]) {
        let bytes = self.format.bytes();
        let ink = if self.format == PixelFormat::Rgba8 { rgba } else { [rgba[0]; 4] };
        for y in top..top.saturating_add(size_px[1]).min(self.height) {
            for x in left..left.saturating_add(size_px[0]).min(self.width) {
                let start = bytes * (y as usize * self.width as usize + x as usize);
                self.data[start..start + bytes].copy_from_slice(&ink[..bytes]);
            }
        }
    }

    /// Both images side by side as RGBA, the lower one padded with white.
    pub fn beside(&self, right: &Self) -> Self {
        let (width, height) = (self.width + right.width, self.height.max(right.height));
        let mut data = Vec::with_capacity(4 * width as usize * height as usize);
        for y in 0..height {
            for image in [self, right] {
                for x in 0..image.width {
                    let rgba = match (image.format, image.pixel(x, y)) {
                        (PixelFormat::Rgba8, Some(p)) => [p[0], p[1], p[2], p[3]],
                        (_, Some(p)) => [p[0], p[0], p[0], 255],
                        (_, None) => [255; 4],
                    };
                    data.extend(rgba);
                }
            }
        }
        Self { width, height, format: PixelFormat::Rgba8, data }
    }

    /// Writes the image as a PNG file, completely or not at all.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a name that ends like that of another kind of picture; [`Error::File`] naming `path` if
    /// the file cannot be written.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        check_png_name(path)?;
        let failed = |error| Error::file(path, std::io::Error::other(error));
        let in_file = |error| Error::file(path, error);
        let mut part = Part::new(path).map_err(in_file)?;
        let mut writer =
            self.png_encoder(part.file().try_clone().map_err(in_file)?).write_header().map_err(failed)?;
        writer.write_image_data(&self.data).map_err(failed)?;
        writer.finish().map_err(failed)?;
        part.finish().map_err(in_file)
    }

    /// Reads a file written by [`Image::write_png`].
    ///
    /// # Errors
    /// [`Error::File`] naming `path` if it cannot be read, or is a PNG of another kind.
    pub fn read_png(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let failed = |error: String| Error::file(path, std::io::Error::other(error));
        let file = File::open(path).map_err(|source| Error::file(path, source))?;
        let mut reader =
            png::Decoder::new(BufReader::new(file)).read_info().map_err(|e| failed(e.to_string()))?;
        let size = reader.output_buffer_size().ok_or_else(|| failed("is too large".to_owned()))?;
        let mut data = vec![0; size];
        let info = reader.next_frame(&mut data).map_err(|e| failed(e.to_string()))?;
        let format = match (info.color_type, info.bit_depth) {
            (png::ColorType::Grayscale, png::BitDepth::Eight) => PixelFormat::Gray8,
            (png::ColorType::Grayscale, png::BitDepth::Sixteen) => PixelFormat::Gray16,
            (png::ColorType::Rgba, png::BitDepth::Eight) => PixelFormat::Rgba8,
            other => return Err(failed(format!("is no frame of this program: {other:?}"))),
        };
        Ok(Self::new(info.width, info.height, format, data))
    }

    /// An encoder for images of this format.
    pub(super) fn png_encoder(&self, file: File) -> png::Encoder<'static, BufWriter<File>> {
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width, self.height);
        let (colour, depth) = match self.format {
            PixelFormat::Gray8 => (png::ColorType::Grayscale, png::BitDepth::Eight),
            PixelFormat::Gray16 => (png::ColorType::Grayscale, png::BitDepth::Sixteen),
            PixelFormat::Rgba8 => (png::ColorType::Rgba, png::BitDepth::Eight),
        };
        // Noise hardly compresses: the balanced mode would double the time of a live frame and its file.
        encoder.set_compression(png::Compression::Fast);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        encoder
    }
}

/// Endings of the names of pictures that are not PNG.
const OTHER_KINDS: [&str; 9] = ["jpg", "jpeg", "gif", "bmp", "tif", "tiff", "webp", "svg", "pdf"];

/// Refuses a name by which other programs would take a PNG for something else.
fn check_png_name(path: &Path) -> Result<()> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    if OTHER_KINDS.iter().any(|other| other.eq_ignore_ascii_case(ending)) {
        let remedy =
            format!("the picture is written as PNG: name it {}", path.with_extension("png").display());
        return Err(Error::parameter("picture", path.display(), remedy));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_another_kind_of_picture_is_refused_and_says_which_to_take() {
        let folder = std::env::temp_dir().join(format!("endowire-kinds-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let image = Image::new(1, 1, PixelFormat::Gray8, vec![9]);
        for name in ["a.jpg", "a.JPEG", "a.tiff", "a.svg"] {
            let refused = image.write_png(folder.join(name)).unwrap_err();
            assert!(refused.is_input() && refused.to_string().contains("a.png"), "{refused}");
            assert!(!folder.join(name).exists(), "{name}");
        }
        // The twins: names of unfinished files, and without an ending.
        for name in ["a.png", "a.png.part", "a"] {
            image.write_png(folder.join(name)).unwrap();
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_png_reads_back_as_it_was_written() {
        let path = std::env::temp_dir().join(format!("endowire-image-{}.png", std::process::id()));
        let data: Vec<u8> = (0..24).map(|k| 10 * k).collect();
        for format in [PixelFormat::Gray8, PixelFormat::Gray16, PixelFormat::Rgba8] {
            let image = Image::new(3, 2, format, data[..6 * format.bytes()].to_vec());
            image.write_png(&path).unwrap();
            assert_eq!(Image::read_png(&path).unwrap(), image);
        }
        std::fs::write(&path, b"no picture").unwrap();
        assert!(Image::read_png(&path).is_err_and(|e| e.to_string().contains("endowire-image")));
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn an_unwritable_path_is_named() {
        let image = Image::new(1, 1, PixelFormat::Rgba8, vec![0; 4]);
        let error = image.write_png("no-such-folder/frame.png").unwrap_err();
        assert!(error.to_string().contains("no-such-folder"), "{error}");
    }

    #[test]
    fn pixels_outside_are_none() {
        let image = Image::new(2, 1, PixelFormat::Gray8, vec![7, 9]);
        assert_eq!(image.pixel(1, 0), Some(&[9][..]));
        assert_eq!(image.pixel(2, 0), None);
    }
}
