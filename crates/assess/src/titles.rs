//! Names of measures as people read them: one list for the window, the page, the program's text and reports.

/// Names in commands and files, and what people read. Units stand beside values.
const TITLES: [(&str, &str); 45] = [
    ("total_s", "time in all"),
    ("idle_s", "time at rest"),
    ("beam_on_s", "beam on"),
    ("beam_on_idle_s", "beam on, hands at rest"),
    ("kerma_ugy", "dose at the detector"),
    ("kerma_area_ugycm2", "dose times area at the detector"),
    ("entrance_ugy", "dose at the patient's entrance"),
    ("entrance_area_ugycm2", "dose times area at the patient's entrance"),
    ("acquisition_s", "cine and subtraction"),
    ("moving_in_acquisition_s", "hands moving in cine or subtraction"),
    ("runs", "times the beam was switched on"),
    ("frames", "frames"),
    ("field_cm2", "mean open field"),
    ("c_arm_moves", "moves of the C-arm"),
    ("contrast_ml", "contrast medium"),
    ("injections", "injections"),
    ("largest_rate_ml_per_s", "fastest injection"),
    ("against_wall_ml", "medium injected against a wall"),
    ("tip_path_mm", "way of the tip"),
    ("path_ratio", "way of the tip over the shortest"),
    ("tip_speed_mm_per_s", "mean speed of the tip"),
    ("spectral_arc_length", "smoothness (spectral arc length)"),
    ("submovements", "submovements"),
    ("submovement_s", "mean submovement"),
    ("reversals", "changes between push and pull"),
    ("turns", "turns in all"),
    ("needless_turns", "needless turns"),
    ("retracted_mm", "length pulled back"),
    ("wall_force_n", "largest force on the wall"),
    ("wall_force_95_n", "force on the wall, 95 % of the time below"),
    ("tip_force_n", "largest force at the tip"),
    ("wall_impulse_ns", "force on the wall times time"),
    ("hand_force_n", "largest force of a hand"),
    ("hand_torque_nmm", "largest torque of a hand"),
    ("jumps", "jumps"),
    ("catheter_ahead_s", "catheter ahead of its wire"),
    ("moving_without_beam_s", "hands moving without beam"),
    ("unseen_share", "share of motion that was not seen"),
    ("push_speed_mm_per_s", "fastest push"),
    ("wrong_branches", "wrong branches"),
    ("time_in_trunk_s", "time up to the first fork"),
    ("arrived", "arrived"),
    ("placement_error_mm", "distance from the target"),
    ("packing_density", "part of the sac that is filled"),
    ("coil_outside_mm", "coil outside the neck"),
];

/// What people read for a measure; its name if it has none.
pub(crate) fn title(name: &'static str) -> &'static str {
    TITLES.iter().find(|(known, _)| *known == name).map_or(name, |(_, title)| title)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_measure_has_a_title_of_its_own() {
        let metrics = crate::assess(&crate::Record::default(), None);
        assert_eq!(metrics.len(), TITLES.len());
        for metric in &metrics {
            assert!(
                TITLES.iter().any(|(name, title)| *name == metric.name && *title == metric.title),
                "{}",
                metric.name
            );
            assert!(!metric.title.contains('_'), "{}", metric.title);
            assert_eq!(
                metrics.iter().filter(|other| other.title == metric.title).count(),
                1,
                "{}",
                metric.title
            );
        }
    }
}
