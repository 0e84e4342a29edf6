//! The tomogram and label map in `assets/ct` are those that the code draws.

use std::io::Read;
use std::path::Path;

use endowire_tests::phantom;
use flate2::read::GzDecoder;

#[test]
fn the_files_in_the_assets_are_the_drawn_ones_and_small() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/ct");
    // Compressed bytes may differ between versions of the library.
    let voxels = |path: &Path| {
        let mut bytes = Vec::new();
        GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_end(&mut bytes).unwrap();
        bytes
    };
    let folder = std::env::temp_dir().join(format!("endowire-phantom-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    phantom::write(&folder).unwrap();
    for name in [phantom::CT, phantom::LABELS] {
        let kept = assets.join(name);
        let said = "cargo run -p endowire-tests --example phantom -- assets/ct";
        assert!(voxels(&kept) == voxels(&folder.join(name)), "{name} is out of date: {said}");
        assert!(kept.metadata().unwrap().len() < 50_000);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
