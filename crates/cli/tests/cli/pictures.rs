//! The pictures of the documents are what the program draws: those that are kept are drawn anew and compared.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::process::Command;

use crate::common::workspace;

/// Mean difference that two pictures of one thing may have, grey levels of 255, and the part of their bytes that may differ by more than `FAR`: a
/// rod whose last bits are others moves the edge of a shadow by no pixel. A wire that is moved by one in the largest picture is five times the part.
const MEAN: f64 = 0.05;
const FAR: u8 = 12;
const PART_FAR: f64 = 2e-4;

/// Size and bytes of a picture.
type Picture = ((u32, u32), Vec<u8>);

fn read(path: &Path) -> Picture {
    let file = File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    bytes.truncate(info.buffer_size());
    ((info.width, info.height), bytes)
}

/// Mean difference of two pictures, and the part of their bytes that differ by much; all where they are not of one size.
fn differences((size, one): &Picture, (other_size, other): &Picture) -> [f64; 2] {
    if size != other_size || one.len() != other.len() {
        return [255.0, 1.0];
    }
    let off = || one.iter().zip(other).map(|(a, b)| a.abs_diff(*b));
    let far = off().filter(|off| *off > FAR).count();
    [off().map(f64::from).sum::<f64>(), far as f64].map(|sum| sum / one.len() as f64)
}

fn are_alike(one: &Picture, other: &Picture) -> bool {
    let [mean, far] = differences(one, other);
    mean <= MEAN && far <= PART_FAR
}

#[test]
fn pictures_of_the_documents_are_drawn_as_they_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(workspace().join("assets/pictures.sh"))
        .arg(env!("CARGO_BIN_EXE_endowire"))
        .arg(folder.path())
        .env("ENDOWIRE_CACHE", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut drawn: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    drawn.sort();
    let kept = |name: &str| read(&workspace().join("assets/pictures").join(name));
    let mut stale = Vec::new();
    for name in &drawn {
        let (now, kept) = (read(&folder.path().join(name)), kept(name));
        let [mean, far] = differences(&now, &kept);
        eprintln!("{name}: {mean:.4} grey levels on average, {far:.1e} of it by more than {FAR}");
        if !are_alike(&now, &kept) {
            stale.push(name);
        }
        // The twin: a picture that is moved by a pixel is another.
        let mut moved = kept.clone();
        moved.1.rotate_right(kept.1.len() / (kept.0.0 * kept.0.1) as usize);
        assert!(!are_alike(&moved, &kept), "{name}: {:?}", differences(&moved, &kept));
    }
    assert!(stale.is_empty(), "{stale:?}: run assets/pictures.sh, and look at what has changed");
    // That none is drawn would also be no difference.
    let documents = [
        "README.md",
        "docs/guide/0-first-five-minutes.md",
        "docs/guide/1-vessel.md",
        "docs/guide/15-pictures.md",
    ];
    let texts = documents.map(|name| std::fs::read_to_string(workspace().join(name)).unwrap()).concat();
    let shown: Vec<&str> = texts
        .split("assets/pictures/")
        .skip(1)
        .map(|rest| &rest[..rest.find([')', '`']).unwrap()])
        // An example draws the poses, and a browser the page.
        .filter(|name| name.ends_with(".png") && !name.starts_with("poses_") && *name != "browser.png")
        .collect();
    assert!(
        shown.len() > 10 && shown.iter().all(|name| drawn.iter().any(|d| d == name)),
        "{shown:?} {drawn:?}"
    );
    // The twins: the mean of the last frames is no frame, and one size is not another.
    for (one, other) in [("arch_fluoro.png", "arch_hold.png"), ("arch_turn_1.png", "arch_cine.png")] {
        assert!(!are_alike(&kept(one), &kept(other)), "{one} {other}");
    }
}
