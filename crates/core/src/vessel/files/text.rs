//! Text as programs write it: any bytes in comments, any line ends, byte order marks.

use std::borrow::Cow;

/// The bytes of a file without a byte order mark. ASCII text in UTF-16 with its mark becomes UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> Cow<'_, [u8]> {
    let units = |of: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    };
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, _, 0, ..] => units(u16::from_le_bytes),
        [0xfe, 0xff, 0, _, ..] => units(u16::from_be_bytes),
        _ => Cow::Borrowed(bytes),
    }
}

/// Lines with their numbers, from 1. They end with LF, CR LF or CR.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
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
pub(super) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| word.replace(['d', 'D'], "e").parse().ok())
}

/// The beginning of a text, which may be a whole binary file, for messages.
pub(super) fn shown(text: &str) -> String {
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
        for other in [&b"\xff\xfe\x01\x02"[..], b"\xff", b"", b"v 1"] {
            assert_eq!(*without_mark(other), *other);
        }
    }
}
