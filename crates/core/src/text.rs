//! Text as programs write it: any bytes in comments, any line ends, byte order marks.

use std::borrow::Cow;

/// Code units of UTF-16 without a mark that must be ASCII to tell it.
const TOLD_BY: usize = 32;

/// The bytes of a file without a byte order mark; UTF-16 becomes UTF-8, without a mark if it begins with ASCII.
pub(crate) fn without_mark(bytes: &[u8]) -> Cow<'_, [u8]> {
    let units = |bytes: &[u8], of: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    };
    // ASCII text in UTF-16 has a zero in every other place, and no binary format begins so.
    let is_ascii = |letter: usize| {
        let told = bytes.chunks_exact(2).take(TOLD_BY);
        bytes.len() >= 8
            && told.into_iter().all(|pair| {
                pair[1 - letter] == 0 && matches!(pair[letter], b'\t' | b'\n' | b'\r' | b' '..=b'~')
            })
    };
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, _, 0, ..] => units(&bytes[2..], u16::from_le_bytes),
        [0xfe, 0xff, 0, _, ..] => units(&bytes[2..], u16::from_be_bytes),
        _ if is_ascii(0) => units(bytes, u16::from_le_bytes),
        _ if is_ascii(1) => units(bytes, u16::from_be_bytes),
        _ => Cow::Borrowed(bytes),
    }
}

/// Lines with their numbers, from 1. They end with LF, CR LF or CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = (!text.is_empty()).then_some(text);
    let mut number = 0;
    std::iter::from_fn(move || {
        let text = rest?;
        number += 1;
        let at = text.bytes().position(|byte| byte == b'\n' || byte == b'\r');
        let (line, after) = match at {
            None => (text, None),
            Some(at) if text[at..].starts_with("\r\n") => (&text[..at], Some(&text[at + 2..])),
            Some(at) => (&text[..at], Some(&text[at + 1..])),
        };
        rest = after.filter(|after| !after.is_empty());
        Some((number, line))
    })
}

/// A number in the syntax of various languages: Fortran's exponent is a D.
pub(crate) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| word.replace(['d', 'D'], "e").parse().ok())
}

/// The beginning of a text, which may be a whole binary file, for messages.
pub(crate) fn shown(text: &str) -> String {
    /// Largest length shown.
    const SHOWN: usize = 60;
    text.chars().take(SHOWN).chain((text.chars().count() > SHOWN).then_some('…')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_any_way_and_keep_their_numbers() {
        let all = |text| lines(text).collect::<Vec<_>>();
        assert_eq!(all("a\nb\r\nc\rd\n\re"), [(1, "a"), (2, "b"), (3, "c"), (4, "d"), (5, ""), (6, "e")]);
        assert_eq!(all("a\n"), [(1, "a")]);
        assert_eq!(all(""), []);
    }

    #[test]
    fn marks_go_and_what_only_begins_like_one_stays() {
        assert_eq!(*without_mark(b"\xef\xbb\xbfv 1"), *b"v 1");
        assert_eq!(*without_mark(b"\xff\xfev\0 \x001\0"), *b"v 1");
        assert_eq!(*without_mark(b"\xfe\xff\0v\0 \x001"), *b"v 1");
        assert_eq!(*without_mark(b"v\0 \x001\0\n\0"), *b"v 1\n");
        assert_eq!(*without_mark(b"\0v\0 \x001\0\n"), *b"v 1\n");
        for other in [&b"\xff\xfe\x01\x02"[..], b"v\0\0\0\0\0\0\0", b"\xff", b"", b"v 1"] {
            assert_eq!(*without_mark(other), *other);
        }
    }
}
