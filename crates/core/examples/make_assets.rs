//! Writes the built-in vessels to a folder: centre lines as tables, walls as binary STL.
//!
//! `cargo run --release -p endowire-core --example make_assets -- assets/vessels`

use std::path::Path;

use endowire_core::vessel::{GeneratedWall, anatomy, check};

fn main() -> endowire_core::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "assets/vessels".into());
    let folder = Path::new(&folder);
    for name in anatomy::NAMES {
        let (Some(tree), Some(about)) = (anatomy::tree(name), anatomy::description(name)) else {
            continue;
        };
        tree.write(&folder.join(format!("{name}.csv")), about)?;
        let made = GeneratedWall::new(&tree, anatomy::asset_resolution(name))?;
        made.wall.mesh().write(&folder.join(format!("{name}.stl")))?;
        let report = check(made.wall.mesh())?;
        println!(
            "{name}: {} triangles, edge {:.2} mm, {} openings, inlet {}, {:.0} mm³, edges {:.2}/{:.2}/{:.2} mm, sound: {}",
            report.triangles,
            made.edge_mm,
            report.openings.len(),
            made.inlet,
            report.volume_mm3,
            report.edge_min_mm,
            report.edge_median_mm,
            report.edge_max_mm,
            report.is_sound()
        );
    }
    Ok(())
}
