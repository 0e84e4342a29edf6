//! Arrays of XML files in all encodings: as text, or as bytes in base64 or raw, in place or appended, compressed or
//! not.
//!
//! "VTK XML Formats" in the documentation of VTK, and `vtkXMLDataParser.cxx` where that is incomplete.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::ZlibDecoder;
use roxmltree::Node;

use super::super::scalar::{Order, Scalar};
use super::super::{Reason, SIZE_LIMIT};
use crate::text::{number, shown};

/// Compression of arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    None,
    ZLib,
    Lz4,
}

/// Properties common to all arrays of a file.
#[derive(Debug)]
pub(super) struct Encoding<'a> {
    order: Order,
    /// Type of the counts before an array's bytes.
    header: Scalar,
    packing: Packing,
    /// The data appended after the XML, and whether it is base64.
    appended: Option<(&'a [u8], bool)>,
}

impl<'a> Encoding<'a> {
    /// From the attributes of the file's first element.
    pub(super) fn new(file: Node<'_, '_>, appended: Option<(&'a [u8], bool)>) -> Result<Self, Reason> {
        let unknown = |name: &str, value: &str| Err(format!("{name} = {:?} is not known", shown(value)));
        Ok(Self {
            order: match file.attribute("byte_order") {
                None | Some("LittleEndian") => Order::Little,
                Some("BigEndian") => Order::Big,
                Some(other) => return unknown("byte_order", other),
            },
            header: match file.attribute("header_type") {
                None | Some("UInt32") => Scalar::U32,
                Some("UInt64") => Scalar::U64,
                Some(other) => return unknown("header_type", other),
            },
            packing: match file.attribute("compressor") {
                None | Some("") => Packing::None,
                Some("vtkZLibDataCompressor") => Packing::ZLib,
                Some("vtkLZ4DataCompressor") => Packing::Lz4,
                Some(other) => {
                    return Err(format!(
                        "it is compressed by {:?}, and ZLib and LZ4 are read: write it again so, or uncompressed",
                        shown(other)
                    ));
                }
            },
            appended,
        })
    }

    /// The numbers of a `DataArray` (or of an `Array` of letters).
    pub(super) fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, Reason> {
        let name = array.attribute("Name").unwrap_or("Points");
        self.read(array).map_err(|why| format!("array {:?}: {why}", shown(name)))
    }

    fn read(&self, array: Node<'_, '_>) -> Result<Vec<f64>, Reason> {
        let kind = array.attribute("type").unwrap_or_default();
        let kind = scalar(kind).ok_or_else(|| format!("type {:?} is not known", shown(kind)))?;
        // Other elements may stand before or behind the numbers of an array.
        let text =
            || array.children().filter(Node::is_text).filter_map(|node| node.text()).collect::<String>();
        let bytes = match (array.attribute("format"), array.attribute("offset")) {
            (Some("appended"), offset) => {
                let reported = offset.unwrap_or_default();
                let (data, is_base64) =
                    self.appended.ok_or("its data are appended, but nothing is: the file is cut off")?;
                let data = reported.trim().parse().ok().and_then(|offset: usize| data.get(offset..));
                let data = data.ok_or_else(|| {
                    format!("offset {:?} is not in the file: it is cut off", shown(reported))
                })?;
                if is_base64 {
                    self.unpacked(&base64(data))?.into_owned()
                } else {
                    self.unpacked(data)?.into_owned()
                }
            }
            (Some("binary"), _) => self.unpacked(&base64(text().as_bytes()))?.into_owned(),
            (None | Some("ascii"), _) => {
                let word = |word: &str| number(word).ok_or_else(|| format!("{:?} is no number", shown(word)));
                return text().split_whitespace().map(word).collect();
            }
            (Some(other), _) => return Err(format!("format {:?} is not known", shown(other))),
        };
        Ok(bytes.chunks_exact(kind.size()).filter_map(|bytes| kind.read(bytes, self.order)).collect())
    }

    /// The bytes of the array that begins here, after its header: one count, or those of its blocks.
    fn unpacked<'b>(&self, data: &'b [u8]) -> Result<Cow<'b, [u8]>, Reason> {
        let size = self.header.size();
        let count = |k: usize| {
            let value =
                data.get(k.saturating_mul(size)..).and_then(|bytes| self.header.read(bytes, self.order));
            value.map(|value| value as usize).ok_or("its header is cut off")
        };
        let short = |wanted: usize, there: usize| {
            format!(
                "{wanted} bytes are announced and {there} are there: the file is cut off, or its header_type is wrong"
            )
        };
        if self.packing == Packing::None {
            let (length, there) = (count(0)?, data.len() - size);
            let bytes = data[size..].get(..length).ok_or_else(|| short(length, there))?;
            return Ok(Cow::Borrowed(bytes));
        }
        let blocks = count(0)?;
        if blocks == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        let (block, last) = (count(1)?, count(2)?);
        let mut bytes = Vec::new();
        let mut rest = blocks
            .checked_add(3)
            .and_then(|counts| data.get(counts.checked_mul(size)?..))
            .ok_or("its header is cut off")?;
        for k in 0..blocks {
            let packed = count(3 + k)?;
            let part = rest.get(..packed).ok_or_else(|| short(packed, rest.len()))?;
            rest = &rest[packed..];
            // A size of 0 of the last block means that it is full.
            let length = if k + 1 == blocks && last > 0 { last } else { block };
            if bytes.len().saturating_add(length) as u64 > SIZE_LIMIT {
                return Err(format!("it is more than {SIZE_LIMIT} bytes long unpacked"));
            }
            self.unpack(part, length, &mut bytes)
                .map_err(|why| format!("block {k} cannot be unpacked: {why}"))?;
        }
        Ok(Cow::Owned(bytes))
    }

    /// Appends the `length` bytes compressed in `part`.
    fn unpack(&self, part: &[u8], length: usize, bytes: &mut Vec<u8>) -> Result<(), Reason> {
        let before = bytes.len();
        match self.packing {
            Packing::Lz4 => {
                /// Upper bound of LZ4's compression ratio.
                const BEST: usize = 256;
                if length > part.len().saturating_mul(BEST) {
                    return Err(format!("{} bytes cannot hold {length}", part.len()));
                }
                bytes.extend(lz4_flex::block::decompress(part, length).map_err(|e| e.to_string())?);
            }
            _ => {
                let mut unpacked = ZlibDecoder::new(part).take(length as u64);
                unpacked.read_to_end(bytes).map_err(|e| e.to_string())?;
            }
        }
        match bytes.len() - before {
            found if found == length => Ok(()),
            found => Err(format!("it holds {found} bytes in place of {length}")),
        }
    }
}

/// A type by its XML name. Letters are bytes.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "Int8" => Scalar::I8,
        "UInt8" | "String" => Scalar::U8,
        "Int16" => Scalar::I16,
        "UInt16" => Scalar::U16,
        "Int32" => Scalar::I32,
        "UInt32" => Scalar::U32,
        "Int64" => Scalar::I64,
        "UInt64" => Scalar::U64,
        "Float32" => Scalar::F32,
        "Float64" => Scalar::F64,
        _ => return None,
    })
}

/// The bytes of base64 text, up to the first invalid character. Several texts padded with `=` may follow each other:
/// a header has one of its own.
fn base64(text: &[u8]) -> Vec<u8> {
    let digit = |byte: u8| match byte {
        b'A'..=b'Z' => Some(u32::from(byte - b'A')),
        b'a'..=b'z' => Some(u32::from(byte - b'a') + 26),
        b'0'..=b'9' => Some(u32::from(byte - b'0') + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        b'=' => Some(64),
        _ => None,
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let mut digits = text.iter().filter(|byte| !byte.is_ascii_whitespace()).map_while(|byte| digit(*byte));
    while let (Some(a), Some(b), Some(c), Some(d)) =
        (digits.next(), digits.next(), digits.next(), digits.next())
    {
        let word = (a & 63) << 18 | (b & 63) << 12 | (c & 63) << 6 | (d & 63);
        let filled = usize::from(c == 64) + usize::from(d == 64);
        bytes.extend(&word.to_be_bytes()[1..4 - filled]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn base64_is_read_as_the_standard_says_and_on_beyond_its_filling() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("ffoo", "Zg==Zm9v")]
        {
            assert_eq!(base64(text.as_bytes()), bytes.as_bytes());
        }
        assert_eq!(base64(b" Zm\n9v <Zm9v"), b"foo");
    }
}
