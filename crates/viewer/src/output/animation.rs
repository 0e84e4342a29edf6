//! Animations: animated PNG, lossless, 8 or 16 bits, supported by browsers; GIF, 256 colours, supported everywhere;
//! films with the feature `mp4`.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use color_quant::NeuQuant;
use endowire_core::file::whole::Part;
use endowire_core::{Error, Result};

#[cfg(feature = "mp4")]
use super::film::Film;
use super::{Image, Pace, PixelFormat};

/// One in this many pixels is sampled to choose 256 colours.
const SAMPLED: i32 = 30;
/// Bits per colour component by which pixels are grouped in the search for the nearest of the 256: it is made once
/// per group.
const BITS: u32 = 6;

/// Writes frames into an animation as they come.
pub struct Animation {
    path: PathBuf,
    /// Under a temporary name until it is complete.
    part: Part,
    writer: Writer,
    like: Image,
    pace: Pace,
    pushed: usize,
}

/// The encoder.
enum Writer {
    Png(png::Writer<BufWriter<File>>),
    Gif(gif::Encoder<BufWriter<File>>),
    #[cfg(feature = "mp4")]
    Film(Box<Film>),
}

/// Kinds of files by extension.
#[derive(Clone, Copy)]
enum Kind {
    Png,
    Gif,
    #[cfg(feature = "mp4")]
    Film,
}

impl std::fmt::Debug for Animation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Animation").field("path", &self.path).finish_non_exhaustive()
    }
}

impl Animation {
    /// Checks that the extension of a file is that of an animation: `png`, `apng` or `gif`, and `mp4` with the
    /// feature of that name.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the supported ones.
    pub fn check_name(path: &Path) -> Result<()> {
        kind(path).map(drop)
    }

    /// Begins an endless loop of `frames` frames at a pace, of the size and format of `like`.
    ///
    /// # Errors
    /// [`Error::File`] naming `path`; [`Error::Parameter`] without frames, or as [`Animation::check_name`].
    pub fn new(path: impl AsRef<Path>, like: &Image, frames: u32, pace: Pace) -> Result<Self> {
        let path = path.as_ref();
        if frames == 0 {
            return Err(Error::parameter("frames", frames, "an animation needs at least one frame"));
        }
        let kind = kind(path)?;
        let in_file = |source| Error::file(path, source);
        let mut part = Part::new(path).map_err(in_file)?;
        let file = part.file().try_clone().map_err(in_file)?;
        let writer = match kind {
            Kind::Png => {
                let failed = |error: png::EncodingError| Error::file(path, std::io::Error::other(error));
                let mut encoder = like.png_encoder(file);
                encoder.set_animated(frames, 0).map_err(failed)?;
                Writer::Png(encoder.write_header().map_err(failed)?)
            }
            Kind::Gif => {
                let (width, height) = (like.width() as u16, like.height() as u16);
                let failed = |error: gif::EncodingError| Error::file(path, std::io::Error::other(error));
                let mut encoder =
                    gif::Encoder::new(BufWriter::new(file), width, height, &[]).map_err(failed)?;
                encoder.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
                Writer::Gif(encoder)
            }
            #[cfg(feature = "mp4")]
            Kind::Film => {
                Writer::Film(Box::new(Film::new(file, like, 1.0 / pace.mean_s()).map_err(in_file)?))
            }
        };
        Ok(Self { path: path.to_path_buf(), part, writer, like: like.clone(), pace, pushed: 0 })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// [`Error::Parameter`] for one of another size or format, [`Error::File`] where it cannot be written.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let shape = |i: &Image| (i.width(), i.height(), i.format());
        if shape(image) != shape(&self.like) {
            let remedy = format!("all frames of an animation are alike: {:?}", shape(&self.like));
            return Err(Error::parameter("frame", format!("{:?}", shape(image)), remedy));
        }
        let stays_s = self.pace.stays_s(self.pushed);
        self.pushed += 1;
        let written = match &mut self.writer {
            Writer::Png(writer) => {
                // In milliseconds.
                let delay = (1000.0 * stays_s).round().clamp(1.0, 65_535.0) as u16;
                let delayed = writer.set_frame_delay(delay, 1000);
                delayed.and_then(|()| writer.write_image_data(image.data())).map_err(std::io::Error::other)
            }
            Writer::Gif(encoder) => {
                // In hundredths of a second; most programs show less than 2 as 10.
                let delay = (100.0 * stays_s).round().clamp(2.0, 65_535.0) as u16;
                encoder.write_frame(&gif_frame(image, delay)).map_err(std::io::Error::other)
            }
            #[cfg(feature = "mp4")]
            Writer::Film(film) => film.push(image, stays_s),
        };
        written.map_err(|error| Error::file(&self.path, error))
    }

    /// Completes the file; it must have all its frames.
    ///
    /// # Errors
    /// [`Error::File`] if that fails.
    pub fn finish(self) -> Result<()> {
        let Self { path, part, writer, .. } = self;
        let finished = match writer {
            Writer::Png(writer) => writer.finish().map_err(std::io::Error::other),
            Writer::Gif(encoder) => match encoder.into_inner() {
                Ok(file) => file.into_inner().map(drop).map_err(std::io::IntoInnerError::into_error),
                Err(error) => Err(std::io::Error::other(error)),
            },
            #[cfg(feature = "mp4")]
            Writer::Film(film) => film.finish(),
        };
        finished.and_then(|()| part.finish()).map_err(|error| Error::file(&path, error))
    }
}

/// The kind of file for a name.
fn kind(path: &Path) -> Result<Kind> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.as_str() {
        "gif" => Ok(Kind::Gif),
        "png" | "apng" => Ok(Kind::Png),
        #[cfg(feature = "mp4")]
        "mp4" => Ok(Kind::Film),
        _ => Err(Error::parameter("animate", path.display(), unknown(&extension))),
    }
}

/// A correction for an unsupported extension.
fn unknown(extension: &str) -> &'static str {
    match extension {
        "mp4" => {
            "films need the feature mp4: cargo build --release --features mp4; or end its name in .png, .apng or .gif"
        }
        _ => "is no moving picture that is written: end its name in .png, .apng, .gif or .mp4",
    }
}

/// A frame of 256 colours: all greys, or those that fit.
fn gif_frame(image: &Image, delay: u16) -> gif::Frame<'static> {
    let (width, height) = (image.width() as u16, image.height() as u16);
    let greys = || (0..=255_u8).flat_map(|grey| [grey; 3]).collect::<Vec<u8>>();
    let mut frame = match image.format() {
        PixelFormat::Gray8 => gif::Frame::from_palette_pixels(width, height, image.data(), greys(), None),
        PixelFormat::Gray16 => {
            let high: Vec<u8> = image.data().iter().copied().step_by(2).collect();
            gif::Frame::from_palette_pixels(width, height, high, greys(), None)
        }
        PixelFormat::Rgba8 => {
            let colours = NeuQuant::new(SAMPLED, 256, image.data());
            let mut known = vec![None; 1 << (3 * BITS)];
            let nearest = |pixel: &[u8]| {
                let part = |k: usize| usize::from(pixel[k] >> (8 - BITS)) << (BITS as usize * k);
                *known[part(0) | part(1) | part(2)].get_or_insert_with(|| colours.index_of(pixel) as u8)
            };
            let pixels: Vec<u8> = image.data().chunks_exact(4).map(nearest).collect();
            gif::Frame::from_palette_pixels(width, height, pixels, colours.color_map_rgb(), None)
        }
    };
    frame.delay = delay;
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::PixelFormat;

    #[test]
    fn a_gif_reads_back_frame_by_frame() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        let frame = |k: u8| Image::new(2, 2, PixelFormat::Gray8, vec![k, 100, 200, 255]);
        let mut animation = Animation::new(&path, &frame(0), 3, Pace::of(&[0.0, 0.07, 1.07], 15.0)).unwrap();
        (0..3).for_each(|k| animation.push(&frame(k)).unwrap());
        animation.finish().unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut reader = options.read_info(File::open(&path).unwrap()).unwrap();
        for k in 0..3 {
            let read = reader.read_next_frame().unwrap().unwrap();
            assert_eq!(read.delay, [7, 100, 54][usize::from(k)]);
            let greys: Vec<u8> = read.buffer.iter().copied().step_by(4).collect();
            assert_eq!(greys, frame(k).data());
        }
        assert!(reader.read_next_frame().unwrap().is_none());
    }

    #[test]
    fn animation_file_names_are_checked_before_writing() {
        for name in ["a.mpg", "a", "a.avi"] {
            let reported = Animation::check_name(Path::new(name)).unwrap_err().to_string();
            assert!(reported.contains(name) && reported.contains(".gif"), "{reported}");
        }
        assert!(Animation::check_name(Path::new("A.GIF")).is_ok());
        let film = Animation::check_name(Path::new("a.mp4")).map_err(|e| e.to_string());
        if cfg!(feature = "mp4") {
            assert_eq!(film, Ok(()));
        } else {
            assert!(film.is_err_and(|reported| reported.contains("cargo build --release --features mp4")));
        }
    }

    #[test]
    fn an_animation_reads_back_frame_by_frame() {
        let path = std::env::temp_dir().join(format!("endowire-animation-{}.png", std::process::id()));
        let frame = |k: u8| Image::new(2, 2, PixelFormat::Gray8, vec![k, 1, 2, 3]);
        let mut animation = Animation::new(&path, &frame(0), 3, Pace::of(&[0.0, 1.2, 1.5], 15.0)).unwrap();
        assert!(animation.push(&Image::new(1, 1, PixelFormat::Gray8, vec![0])).is_err());
        (0..3).for_each(|k| animation.push(&frame(k)).unwrap());
        animation.finish().unwrap();
        let decoder = png::Decoder::new(std::io::BufReader::new(File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for k in 0..3 {
            let mut data = vec![0; 4];
            reader.next_frame(&mut data).unwrap();
            assert_eq!(data, frame(k).data());
            assert_eq!(reader.info().frame_control.unwrap().delay_num, [1200, 300, 750][usize::from(k)]);
        }
        std::fs::remove_file(&path).unwrap();
    }
}
