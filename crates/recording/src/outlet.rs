//! Where contrast medium leaves.

use endowire_core::Vec3;
use endowire_core::insertion::Simulation;
use serde::{Deserialize, Serialize};

/// Where medium leaves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outlet {
    /// Name of the instrument whose tip it leaves; `None` if it leaves through the sheath.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// Its position in the undisplaced vessel, mm: that of the tip when the injection began, or of the sheath's mouth.
    pub at_mm: Vec3,
    /// Sum of the magnitudes of wall forces at that tip when the injection began, N; `None` if it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_force_n: Option<f64>,
}

impl Outlet {
    /// The outlet of what is injected now: the tip of the instrument with this index, or the sheath's mouth if there
    /// is none or it is not inserted.
    pub fn of(simulation: &Simulation, instrument: Option<usize>) -> Self {
        let report = simulation.report();
        let lengths_mm = report.lengths_mm();
        let at_tip = instrument.and_then(|index| {
            let inserted_mm = lengths_mm.get(index).copied().filter(|mm| *mm > 0.0)?;
            let one = &simulation.stack().instruments()[index];
            let line = simulation.shape().behind(report.inserted_mm - inserted_mm);
            let radius_mm = one.device.section_at(0.0).radius_mm;
            Some((one.name.clone(), line.tip_mm()?, report.wall_force(&line, radius_mm).tip_n))
        });
        let displacement = simulation.displacement();
        let at_rest = |place: Vec3| displacement.as_ref().map_or(place, |now| now.material(&place));
        match at_tip {
            Some((name, tip_mm, force_n)) => {
                Self { instrument: Some(name), at_mm: at_rest(tip_mm), tip_force_n: Some(force_n) }
            }
            None => {
                let mouth_mm = simulation.sheath().position_mm;
                Self { instrument: None, at_mm: at_rest(mouth_mm), tip_force_n: Some(0.0) }
            }
        }
    }
}
