//! Files as they are after a broken transfer, a wrong export or a slip of the hand: a valid file with a few faults from a seed.

use crate::noise::Noise;

/// Numbers that readers meet and do not expect.
const NUMBERS: [&str; 12] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-308",
    "0",
    "-1",
    "4294967295",
    "-9223372036854775808",
    "18446744073709551616",
    "0.5",
];

/// Lines that belong to no format, or to another place of one.
const LINES: [&str; 7] =
    ["unknown_key = 1", "[unknown]", "[[script]]", "f 1 2 3 4 5", "v", "\u{1}\"[[", "-1,,;0"];

/// Most faults in a file.
const MOST: usize = 3;

/// `file` with one to three faults.
pub fn damaged(file: &[u8], noise: &mut Noise) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for _ in 0..=noise.below(MOST) {
        match noise.below(8) {
            0 => flip_bit(&mut bytes, noise),
            1 => bytes.truncate(noise.below(bytes.len())),
            2 => overwrite(&mut bytes, noise),
            3 => change_lines(&mut bytes, noise, |lines, at, _| lines.insert(at, lines[at].clone())),
            4 => change_lines(&mut bytes, noise, |lines, at, _| drop(lines.remove(at))),
            5 => change_lines(&mut bytes, noise, |lines, at, noise| {
                lines.insert(at, LINES[noise.below(LINES.len())].into());
            }),
            // What matters most in text is its numbers.
            _ => replace_number(&mut bytes, noise),
        }
    }
    bytes
}

fn flip_bit(bytes: &mut [u8], noise: &mut Noise) {
    let at = noise.below(bytes.len());
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << noise.below(8);
    }
}

/// Counts and floats of binary files: all bits of four bytes set or cleared, −1, NaN and 0 among what they may mean.
fn overwrite(bytes: &mut [u8], noise: &mut Noise) {
    let at = noise.below(bytes.len());
    let value = [0x00, 0x7f, 0xff][noise.below(3)];
    bytes.iter_mut().skip(at).take(4).for_each(|byte| *byte = value);
}

fn change_lines(
    bytes: &mut Vec<u8>,
    noise: &mut Noise,
    change: impl Fn(&mut Vec<Vec<u8>>, usize, &mut Noise),
) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
    let at = noise.below(lines.len());
    change(&mut lines, at, noise);
    *bytes = lines.join(&b'\n');
}

/// Replaces a number of the text by another that may not be meant.
fn replace_number(bytes: &mut Vec<u8>, noise: &mut Noise) {
    let part = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'-' | b'.');
    let starts: Vec<usize> =
        (0..bytes.len()).filter(|&i| part(&bytes[i]) && (i == 0 || !part(&bytes[i - 1]))).collect();
    let Some(&start) = starts.get(noise.below(starts.len())) else { return };
    let length = bytes[start..].iter().take_while(|byte| part(byte)).count();
    bytes.splice(start..start + length, NUMBERS[noise.below(NUMBERS.len())].bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_does_the_same_damage_and_files_of_any_length_can_be_damaged() {
        let text = b"a = 1.5\n[b]\nc = [2, -3e4]\n";
        let all = |seed| {
            let mut noise = Noise::new(seed);
            (0..500).map(|_| damaged(text, &mut noise)).collect::<Vec<_>>()
        };
        assert_eq!(all(1), all(1));
        assert_ne!(all(1), all(2));
        let changed = all(1).iter().filter(|bytes| *bytes != text).count();
        assert!(changed > 450, "{changed} of 500");
        let mut noise = Noise::new(3);
        for _ in 0..500 {
            damaged(b"", &mut noise);
            damaged(b"1", &mut noise);
        }
    }
}
