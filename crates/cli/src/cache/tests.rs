use std::path::Path;

use endowire_core::vessel::{CentrelineEnd, CentrelineTree, Resolution, anatomy};

use super::*;

fn tube() -> CentrelineTree {
    anatomy::tree("curved_tube").unwrap()
}

/// A wall that takes a multiple of [`LEAST`] to compute.
fn recipe(tree: &CentrelineTree) -> WallRecipe<'_> {
    WallRecipe::Generated { tree, resolution: Resolution::EdgeMm(0.6) }
}

fn cache(folder: &Path) -> Cache {
    Cache { folder: Some(folder.to_path_buf()), reported: AtomicBool::new(false) }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Changes the content of a file and updates the hash at its end.
fn forge(path: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    use sha2::{Digest, Sha256};
    let mut bytes = std::fs::read(path).unwrap();
    bytes.truncate(bytes.len() - 32);
    change(&mut bytes);
    let end = Sha256::digest(&bytes);
    bytes.extend(end);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_kept_wall_is_the_one_that_was_made_and_is_not_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, cache) = (tube(), cache(&folder.path().join("new/walls")));
    let made = cache.wall(&recipe(&tree)).unwrap();
    let [file] = files(&folder.path().join("new/walls")).try_into().unwrap();
    assert_eq!(file.extension().unwrap(), EXTENSION);
    let kept = cache.wall(&recipe(&tree)).unwrap();
    assert!(kept.mesh() == made.mesh() && kept.openings() == made.openings());
    assert_eq!((kept.report(), kept.caps()), (made.report(), made.caps()));
    // Changes one bit of the mesh, which shows whether the file is read.
    forge(&file, |bytes| bytes[FORGED] ^= 1);
    assert_ne!(cache.wall(&recipe(&tree)).unwrap().mesh(), made.mesh());
}

/// Offset of a byte in the first coordinate's mantissa: after the first line, the key, and the two or three bytes of
/// the number of vertices.
const FORGED: usize = 16 + 32 + 2 + 3;

#[test]
fn a_file_that_is_not_whole_or_not_ours_is_ignored_and_written_anew() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, cache) = (tube(), cache(folder.path()));
    let made = cache.wall(&recipe(&tree)).unwrap();
    let [file] = files(folder.path()).try_into().unwrap();
    let whole = std::fs::read(&file).unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    for wrong in
        [&[] as &[u8], b"endowire wall 1\n", &whole[..whole.len() - 1], &whole[..40], &damaged, b"mine"]
    {
        std::fs::write(&file, wrong).unwrap();
        assert_eq!(cache.wall(&recipe(&tree)).unwrap().mesh(), made.mesh());
        assert!(std::fs::read(&file).unwrap() == whole, "{} bytes were left", wrong.len());
    }
    for (what, change) in [
        ("another format", (|bytes| bytes[14] = b'2') as fn(&mut Vec<u8>)),
        ("the wall of another key", |bytes| bytes[20] ^= 1),
        ("no wall", |bytes| bytes.truncate(60)),
    ] {
        forge(&file, change);
        assert_eq!(cache.wall(&recipe(&tree)).unwrap().mesh(), made.mesh());
        assert!(std::fs::read(&file).unwrap() == whole, "{what}");
    }
}

#[test]
fn a_place_that_cannot_be_written_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").unwrap();
    let (tree, cache) = (tube(), cache(&file.join("walls")));
    assert!(cache.wall(&recipe(&tree)).is_ok() && cache.reported.load(Ordering::Relaxed));
    assert_eq!(std::fs::read(&file).unwrap(), b"mine");
}

#[test]
fn walls_that_cannot_be_made_are_reported_and_not_cached() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, cache) = (tube(), cache(folder.path()));
    let wrong = WallRecipe::Generated { tree: &tree, resolution: Resolution::EdgeMm(-1.0) };
    let reported = cache.wall(&wrong).unwrap_err().to_string();
    assert_eq!(reported, wrong.make().unwrap_err().to_string());
    assert_eq!(files(folder.path()), [] as [PathBuf; 0]);
}

#[test]
fn many_may_want_the_same_wall_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let tree = tube();
    let made = recipe(&tree).make().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..20 {
                    let key = entry::key(&Recipe::Wall(&recipe(&tree))).unwrap();
                    write(folder.path(), &key, &made).unwrap();
                    assert_eq!(cache(folder.path()).wall(&recipe(&tree)).unwrap().mesh(), made.mesh());
                }
            });
        }
    });
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn a_kept_centre_line_is_the_one_that_was_found_with_its_targets_and_is_that_of_its_beginning() {
    let folder = tempfile::tempdir().unwrap();
    let (tree, cache) = (tube(), cache(folder.path()));
    let wall = recipe(&tree).make().unwrap();
    let of = |opening| CentrelineRecipe { wall: &wall, from: Some(CentrelineEnd::Opening(opening)) };
    let found = cache.centreline(&of(0)).unwrap();
    let [file] = files(folder.path()).try_into().unwrap();
    assert_eq!(cache.centreline(&of(0)).unwrap(), found);
    assert_eq!(found.targets()[0].name, "opening 1");
    assert_eq!(cache.centreline(&of(1)).unwrap().targets()[0].name, "opening 0");
    assert_eq!(files(folder.path()).len(), 2);
    // Changes a digit in the table, which shows whether the file is read.
    forge(&file, |bytes| {
        let at = 16 + 32 + "x,y,z,radius,parent,target\n".len();
        bytes[at] = b'7';
    });
    assert_ne!(cache.centreline(&of(0)).unwrap(), found);
}
