//! Moving pictures as animated PNG: lossless, 8 or 16 bits, read by browsers.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use endowire_core::{Error, Result};

use super::Image;

/// Writes frames into one animated PNG as they come.
pub struct Animation {
    path: PathBuf,
    writer: png::Writer<BufWriter<File>>,
    like: Image,
}

impl std::fmt::Debug for Animation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Animation").field("path", &self.path).finish_non_exhaustive()
    }
}

impl Animation {
    /// Begins an endless loop of `frames` frames of the size and format of `like`.
    ///
    /// # Errors
    /// [`Error::File`] naming `path`; [`Error::Parameter`] without frames.
    pub fn new(path: impl AsRef<Path>, like: &Image, frames: u32, frames_per_s: f64) -> Result<Self> {
        let path = path.as_ref();
        if frames == 0 {
            return Err(Error::parameter("frames", frames, "an animation needs at least one frame"));
        }
        let failed = |error: png::EncodingError| Error::file(path, std::io::Error::other(error));
        let mut encoder = like.png_encoder(path)?;
        encoder.set_animated(frames, 0).map_err(failed)?;
        // In thousandths of a second.
        let delay = (1000.0 / frames_per_s).round().clamp(1.0, 65_535.0) as u16;
        encoder.set_frame_delay(delay, 1000).map_err(failed)?;
        let writer = encoder.write_header().map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), writer, like: like.clone() })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// [`Error::Parameter`] for one of another size or format, [`Error::File`] where it cannot be written.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let shape = |i: &Image| (i.width(), i.height(), i.format());
        if shape(image) != shape(&self.like) {
            let mend = format!("all frames of an animation are alike: {:?}", shape(&self.like));
            return Err(Error::parameter("frame", format!("{:?}", shape(image)), mend));
        }
        let failed = |error| Error::file(&self.path, std::io::Error::other(error));
        self.writer.write_image_data(image.data()).map_err(failed)
    }

    /// Ends the file; it must have all its frames.
    ///
    /// # Errors
    /// [`Error::File`] where that fails.
    pub fn finish(self) -> Result<()> {
        let Self { path, writer, .. } = self;
        writer.finish().map_err(|error| Error::file(&path, std::io::Error::other(error)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::PixelFormat;

    #[test]
    fn an_animation_reads_back_frame_by_frame() {
        let path = std::env::temp_dir().join(format!("endowire-animation-{}.png", std::process::id()));
        let frame = |k: u8| Image::new(2, 2, PixelFormat::Gray8, vec![k, 1, 2, 3]);
        let mut animation = Animation::new(&path, &frame(0), 3, 15.0).unwrap();
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
            assert_eq!(reader.info().frame_control.unwrap().delay_num, 67);
        }
        std::fs::remove_file(&path).unwrap();
    }
}
