//! The catalogue of devices: every file is read, carries its sources, and can be inserted.

use std::path::{Path, PathBuf};

use endowire_core::device::DeviceFile;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

fn catalogue() -> Vec<(PathBuf, DeviceFile)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/devices");
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), DeviceFile::read(&path).unwrap())).collect()
}

#[test]
fn every_part_of_the_catalogue_has_a_material_and_a_source() {
    let catalogue = catalogue();
    assert!(catalogue.len() >= 21, "{} files", catalogue.len());
    for (path, file) in catalogue {
        // Files of sections are older than parts, and have their sources in comments.
        if file.kind.is_none() {
            continue;
        }
        for part in &file.parts {
            let place = format!("{}: {}", path.display(), part.name);
            assert!(part.material.is_some(), "{place}");
            assert!(part.source.as_ref().is_some_and(|source| !source.is_empty()), "{place}");
            // Contact feels the radius: it is never off by more than a twentieth of a millimetre.
            assert!(part.cut_error().radius_mm < 0.05, "{place}: {:?}", part.cut_error());
        }
        // Neighbours agree in size where no step is meant: half a French.
        for pair in file.parts.windows(2) {
            let step_mm = (pair[0].at(1.0).radius_mm - pair[1].at(0.0).radius_mm).abs();
            assert!(step_mm < 0.1, "{}: {} to {}", path.display(), pair[0].name, pair[1].name);
        }
    }
}

#[test]
fn every_device_of_the_catalogue_goes_50_mm_into_the_curved_tube() {
    let tube = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&tube.wall, tube.inlet, 2.0).unwrap();
    let method = KirchhoffOptions { element_mm: 4.0, ..KirchhoffOptions::default() };
    for (path, file) in catalogue() {
        let mut simulation =
            Simulation::builder(tube.wall.clone(), file.device, sheath).method(&method).build().unwrap();
        for _ in 0..25 {
            let report = simulation.step(Command::advance(2.0)).unwrap();
            assert!(report.converged, "{}: at {} mm", path.display(), report.inserted_mm);
        }
        assert!((simulation.report().inserted_mm - 50.0).abs() < 1e-9, "{}", path.display());
        assert!(simulation.shape().positions_mm.iter().flat_map(|p| p.iter()).all(|x| x.is_finite()));
    }
}
