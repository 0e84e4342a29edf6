//! Text in images: a font of 3 × 5 dots.

use crate::output::Image;

/// A row in three bits, the left one highest.
const DIGITS: [[u8; 5]; 10] = [
    [7, 5, 5, 5, 7],
    [2, 6, 2, 2, 7],
    [7, 1, 7, 4, 7],
    [7, 1, 7, 1, 7],
    [5, 5, 7, 1, 1],
    [7, 4, 7, 1, 7],
    [7, 4, 7, 5, 7],
    [7, 1, 1, 2, 2],
    [7, 5, 7, 5, 7],
    [7, 5, 7, 1, 7],
];
const LETTERS: [(char, [u8; 5]); 7] = [
    ('A', [2, 5, 7, 5, 5]),
    ('F', [7, 4, 6, 4, 4]),
    ('H', [5, 5, 7, 5, 5]),
    ('L', [4, 4, 4, 4, 7]),
    ('P', [6, 5, 6, 4, 4]),
    ('R', [6, 5, 6, 5, 5]),
    ('.', [0, 0, 0, 0, 2]),
];
/// These take five columns.
const M: [u8; 5] = [0, 0b11010, 0b10101, 0b10101, 0b10101];
const N: [u8; 5] = [0b10001, 0b11001, 0b10101, 0b10011, 0b10001];

/// Number of rows of dots.
pub(super) const ROWS: u32 = 5;

/// Rows and columns of a character; empty if the font lacks it.
fn glyph(letter: char) -> ([u8; 5], u32) {
    match letter {
        'm' => (M, 5),
        'N' => (N, 5),
        digit if digit.is_ascii_digit() => (DIGITS[(digit as u8 - b'0') as usize], 3),
        other => LETTERS.iter().find(|l| l.0 == other).map_or(([0; 5], 1), |l| (l.1, 3)),
    }
}

/// Number of columns of dots of a text.
pub(super) fn columns(text: &str) -> u32 {
    text.chars().map(|letter| glyph(letter).1 + 1).sum()
}

/// Writes a text with its upper left corner at a pixel, with a given size of dots.
pub(super) fn text(image: &mut Image, [mut x, top]: [u32; 2], dot: u32, text: &str, ink: [u8; 4]) {
    for letter in text.chars() {
        let (rows, columns) = glyph(letter);
        for (row, bits) in (0..).zip(rows) {
            for column in (0..columns).filter(|column| bits >> (columns - 1 - column) & 1 == 1) {
                image.fill([x + column * dot, top + row * dot], [dot; 2], ink);
            }
        }
        x += (columns + 1) * dot;
    }
}
