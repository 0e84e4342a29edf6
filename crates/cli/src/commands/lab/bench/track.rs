//! Tracks from the command line.

use std::path::Path;

use endowire_core::vessel::{CentrelineTree, SurfaceFrame, SurfaceMesh, Wall, anatomy};
use endowire_lab::bench::track::{Bend, Track, TrackSize};
use serde::Serialize;

use super::output::as_flag;
use crate::args::TrackArgs;
use crate::failure::Failure;
use crate::output::curves::Band;
use crate::output::provenance::read_input;

/// The track of a test.
pub(super) struct NamedTrack {
    pub(super) track: Track,
    pub(super) document: TrackDocument,
    /// Bytes of its file.
    pub(super) input: Vec<u8>,
}

/// A track in the JSON document of a test.
#[derive(Serialize)]
pub(super) struct TrackDocument {
    name: String,
    #[serde(flatten)]
    size: TrackSize,
    bends: Vec<Bend>,
}

/// Reads the track that was asked for.
pub(super) fn read(args: &TrackArgs) -> Result<NamedTrack, Failure> {
    let (name, track, input) = match &args.track {
        None => ("standard tortuous path".to_owned(), Track::standard()?, Vec::new()),
        Some(which) => {
            let (track, input) = of_file(which)?;
            (which.display().to_string(), track, input)
        }
    };
    let document = TrackDocument { name, size: track.size(), bends: track.bends() };
    Ok(NamedTrack { track, document, input })
}

fn of_file(which: &Path) -> Result<(Track, Vec<u8>), Failure> {
    let named = which.to_str().filter(|_| !which.exists()).and_then(anatomy::tree);
    let in_file = |e| as_flag(e).at(which.display());
    if let Some(tree) = named {
        return Ok((Track::of_tree(tree).map_err(in_file)?, Vec::new()));
    }
    let input = read_input(which).map_err(|failure| {
        Failure::Input(format!("--track {failure} (built-in anatomies: {})", anatomy::NAMES.join(", ")))
    })?;
    let is_surface = which.extension().and_then(|extension| extension.to_str()).is_some_and(|extension| {
        ["stl", "obj", "ply", "vtp", "vtk"].iter().any(|known| extension.eq_ignore_ascii_case(known))
    });
    let track = if is_surface {
        let surface = SurfaceMesh::read(which, SurfaceFrame::from(1.0))?;
        Track::of_wall(Wall::from_surface(&surface).map_err(in_file)?)
    } else {
        Track::of_tree(CentrelineTree::read(which)?)
    };
    Ok((track.map_err(in_file)?, input))
}

impl TrackDocument {
    /// In words, for a page.
    pub(super) fn words(&self) -> String {
        let bends = self
            .bends
            .iter()
            .map(|bend| format!("{:.0}° of radius {:.0} mm", bend.angle_deg, bend.radius_mm));
        let bends = match self.bends.len() {
            0 => "without bends".to_owned(),
            _ => format!("bends of {}", bends.collect::<Vec<_>>().join(", ")),
        };
        format!(
            "Track: {}, a lumen of {:.1} mm at its narrowest, {:.0} mm long, {bends}.",
            self.name,
            2.0 * self.size.lumen_radius_mm,
            self.size.length_mm
        )
    }

    /// Its bends as bands of a plot over inserted length.
    pub(super) fn bands(&self) -> Vec<Band> {
        let band = |bend: &Bend| Band {
            from: bend.from_mm,
            to: bend.to_mm,
            caption: format!("{:.0}°, R {:.0} mm", bend.angle_deg, bend.radius_mm),
        };
        self.bends.iter().map(band).collect()
    }
}
