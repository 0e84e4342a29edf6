//! Films: H.264 in an MP4 file (ISO/IEC 14496-12 and -15), one video track.

use std::fs::File;
use std::io::{BufWriter, Error, Result, Seek, SeekFrom, Write};

use openh264::OpenH264API;
use openh264::encoder::{Encoder, EncoderConfig, FrameRate, FrameType, RateControlMode};
use openh264::formats::{RgbSliceU8, YUVBuffer};

use super::{Image, PixelFormat};

/// Time units per second.
const TIMESCALE: u32 = 90_000;
/// Types of units of a stream: parameters of the sequence and of pictures.
const SPS: u8 = 7;
const PPS: u8 = 8;
/// One as a 16.16 fixed-point number.
const ONE: u32 = 0x0001_0000;

/// Writes frames into a film as they come.
pub(super) struct Film {
    file: BufWriter<File>,
    encoder: Encoder,
    size: [usize; 2],
    /// Start of the data, after their length field.
    begin: u64,
    sps: Vec<u8>,
    pps: Vec<u8>,
    samples: Vec<Sample>,
}

/// A frame.
struct Sample {
    bytes: u32,
    /// Whether it is a key frame.
    alone: bool,
    ticks: u32,
}

impl Film {
    pub(super) fn new(file: File, like: &Image, frames_per_s: f64) -> Result<Self> {
        // Colours are coded for two by two pixels.
        let size = [like.width(), like.height()].map(|side| side.next_multiple_of(2) as usize);
        let config = EncoderConfig::new()
            .max_frame_rate(FrameRate::from_hz(frames_per_s as f32))
            // Constant quality: the noise of photons would use up any bit rate.
            .rate_control_mode(RateControlMode::Off)
            .skip_frames(false)
            // The same film on every machine.
            .num_threads(1);
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config).map_err(Error::other)?;
        let mut file = BufWriter::new(file);
        file.write_all(&boxed(b"ftyp", &[&b"isom\0\0\x02\0isomiso2avc1mp41"[..]]))?;
        file.write_all(&[0, 0, 0, 0])?;
        file.write_all(b"mdat")?;
        let begin = file.stream_position()?;
        Ok(Self { file, encoder, size, begin, sps: vec![], pps: vec![], samples: vec![] })
    }

    /// Adds a frame with a duration.
    pub(super) fn push(&mut self, image: &Image, stays_s: f64) -> Result<()> {
        let rgb = even_rgb(image, self.size);
        let source = YUVBuffer::from_rgb8_source(RgbSliceU8::new(&rgb, (self.size[0], self.size[1])));
        let stream = self.encoder.encode(&source).map_err(Error::other)?;
        let alone = matches!(stream.frame_type(), FrameType::IDR | FrameType::I);
        let mut bytes = 0;
        for layer in (0..stream.num_layers()).filter_map(|k| stream.layer(k)) {
            for unit in (0..layer.nal_count()).filter_map(|k| layer.nal_unit(k)) {
                // After the start code of three or four bytes; a file has lengths instead.
                let unit = unit.iter().position(|byte| *byte == 1).map_or(unit, |k| &unit[k + 1..]);
                match unit.first().map(|head| head & 31) {
                    Some(SPS) => self.sps = unit.to_vec(),
                    Some(PPS) => self.pps = unit.to_vec(),
                    _ => {
                        self.file.write_all(&(unit.len() as u32).to_be_bytes())?;
                        self.file.write_all(unit)?;
                        bytes += 4 + unit.len() as u32;
                    }
                }
            }
        }
        let ticks = (f64::from(TIMESCALE) * stays_s).round().clamp(1.0, 1e9) as u32;
        self.samples.push(Sample { bytes, alone, ticks });
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<()> {
        let end = self.file.stream_position()?;
        let length = u32::try_from(end - self.begin + 8)
            .map_err(|_| Error::other("a film has at most 4 GB: draw fewer or smaller frames"))?;
        let movie = self.movie();
        self.file.write_all(&movie)?;
        self.file.seek(SeekFrom::Start(self.begin - 8))?;
        self.file.write_all(&length.to_be_bytes())?;
        self.file.flush()
    }

    /// The description of the data in the file.
    fn movie(&self) -> Vec<u8> {
        let ticks = self.samples.iter().fold(0_u32, |sum, sample| sum.saturating_add(sample.ticks));
        let [width, height] = self.size.map(|side| side as u32);
        let matrix = [ONE, 0, 0, 0, ONE, 0, 0, 0, 0x4000_0000];
        let mvhd = words(&[&[0, 0, 0, TIMESCALE, ticks, ONE, 0x0100_0000, 0, 0], &matrix, &[0; 6], &[2]]);
        let tkhd = words(&[&[3, 0, 0, 1, 0, ticks, 0, 0, 0, 0], &matrix, &[width << 16, height << 16]]);
        // The language is undetermined.
        let mdhd = words(&[&[0, 0, 0, TIMESCALE, ticks, 0x55c4_0000]]);
        let hdlr = [&[0; 8][..], b"vide", &[0; 12], b"video\0"].concat();
        let dref = [&words(&[&[0, 1]])[..], &boxed(b"url ", &[&words(&[&[1]])])].concat();
        let media = boxed(
            b"minf",
            &[
                &boxed(b"vmhd", &[&words(&[&[1, 0, 0]])]),
                &boxed(b"dinf", &[&boxed(b"dref", &[&dref])]),
                &boxed(b"stbl", &[&self.samples_table()]),
            ],
        );
        let mdia = boxed(b"mdia", &[&boxed(b"mdhd", &[&mdhd]), &boxed(b"hdlr", &[&hdlr]), &media]);
        let trak = boxed(b"trak", &[&boxed(b"tkhd", &[&tkhd]), &mdia]);
        boxed(b"moov", &[&boxed(b"mvhd", &[&mvhd]), &trak])
    }

    /// The coding of the track, and the positions of its frames: all of them in one chunk.
    fn samples_table(&self) -> Vec<u8> {
        let [width, height] = self.size.map(|side| side as u32);
        let profile = self.sps.get(1..4).unwrap_or(&[66, 192, 30]);
        let (sps, pps) = (self.sps.len() as u16, self.pps.len() as u16);
        let avcc = [
            &[1][..],
            profile,
            &[0xff, 0xe1],
            &sps.to_be_bytes(),
            &self.sps,
            &[1],
            &pps.to_be_bytes(),
            &self.pps,
        ]
        .concat();
        let avc1 = [
            &words(&[&[0, 1, 0, 0, 0, 0, width << 16 | height, 0x0048_0000, 0x0048_0000, 0, 1 << 16]])[..],
            &[0; 30],
            &[0, 24, 0xff, 0xff],
            &boxed(b"avcC", &[&avcc]),
        ]
        .concat();
        let stsd = [&words(&[&[0, 1]])[..], &boxed(b"avc1", &[&avc1])].concat();
        let count = self.samples.len() as u32;
        let alone: Vec<u32> =
            (1..).zip(&self.samples).filter(|(_, sample)| sample.alone).map(|(number, _)| number).collect();
        let sizes: Vec<u32> = self.samples.iter().map(|sample| sample.bytes).collect();
        // Runs of consecutive frames with equal durations.
        let runs: Vec<[u32; 2]> = self
            .samples
            .chunk_by(|a, b| a.ticks == b.ticks)
            .map(|run| [run.len() as u32, run[0].ticks])
            .collect();
        [
            boxed(b"stsd", &[&stsd]),
            boxed(b"stts", &[&words(&[&[0, runs.len() as u32], runs.as_flattened()])]),
            boxed(b"stss", &[&words(&[&[0, alone.len() as u32], &alone])]),
            boxed(b"stsc", &[&words(&[&[0, 1, 1, count, 1]])]),
            boxed(b"stsz", &[&words(&[&[0, 0, count], &sizes])]),
            boxed(b"stco", &[&words(&[&[0, 1, self.begin as u32]])]),
        ]
        .concat()
    }
}

/// A box of the file: its length, name and content.
fn boxed(name: &[u8; 4], content: &[&[u8]]) -> Vec<u8> {
    let length = 8 + content.iter().map(|part| part.len()).sum::<usize>();
    [&(length as u32).to_be_bytes()[..], name, &content.concat()].concat()
}

/// Numbers in big-endian bytes.
fn words(numbers: &[&[u32]]) -> Vec<u8> {
    numbers.iter().flat_map(|part| part.iter()).flat_map(|number| number.to_be_bytes()).collect()
}

/// RGB values of an image, with its last column and row repeated if its size is odd.
fn even_rgb(image: &Image, [width, height]: [usize; 2]) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height as u32 {
        for x in 0..width as u32 {
            let pixel = image.pixel(x.min(image.width() - 1), y.min(image.height() - 1)).unwrap_or(&[0; 4]);
            match image.format() {
                PixelFormat::Rgba8 => rgb.extend(&pixel[..3]),
                PixelFormat::Gray8 | PixelFormat::Gray16 => rgb.extend([pixel[0]; 3]),
            }
        }
    }
    rgb
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_has_its_parts_and_all_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mp4");
        let frame = |k: u8| Image::new(33, 17, PixelFormat::Gray8, vec![40 * k; 33 * 17]);
        let mut film = Film::new(&path, &frame(0), 15.0).unwrap();
        (0..5).for_each(|k| film.push(&frame(k), if k < 3 { 0.1 } else { 0.4 }).unwrap());
        assert_eq!(film.samples.len(), 5);
        assert!(film.samples[0].alone && film.samples.iter().all(|sample| sample.bytes > 4));
        film.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let times = [&b"stts"[..], &words(&[&[0, 2, 3, 9_000, 2, 36_000]])].concat();
        assert!(bytes.windows(times.len()).any(|window| window == times));
        let mut names = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let length =
                u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
            names.push(String::from_utf8_lossy(&bytes[at + 4..at + 8]).into_owned());
            at += length;
        }
        assert_eq!((at, names), (bytes.len(), vec!["ftyp".to_owned(), "mdat".into(), "moov".into()]));
    }
}
