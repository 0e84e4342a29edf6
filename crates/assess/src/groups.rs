//! The measures, group by group. All values come from the record: nothing is simulated again.

use crate::hands::{
    moving, moving_in_acquisition_s, needless_turns, push_speed_mm_per_s, reversals, unseen_share,
};
use crate::injection::flowed_ml;
use crate::metric::{Better, Group, Metric};
use crate::record::{BeamMode, Record};
use crate::smoothness::{PAUSE_S, smoothness_of_movements, speeds, submovements};
use crate::titles::title;
use crate::total::total;
use crate::way::Way;

/// Fraction of the time in which forces are at most the 95th percentile.
const MOST_OF_TIME: f64 = 0.95;
/// Shortest path, mm, with which a path length is compared.
const SHORTEST_MM: f64 = 1.0;

const ESTRADA: &str = "Estrada et al. 2014: smoothness of the tool's motion";
const RAFII: &str = "Rafii-Tari et al. 2017: motion and forces of hands and catheters";
const BOYLE: &str = "Boyle et al. 2011: scores of errors";
const SLUZEWSKI: &str = "Sluzewski et al. 2004: packing of aneurysms and compaction of coils";
const REVIEW: &str =
    "review of simulator studies, European Journal of Vascular and Endovascular Surgery 2016";

/// A measure of which less is better.
fn lower(
    group: Group,
    (name, unit): (&'static str, &'static str),
    value: Option<f64>,
    definition: &'static str,
    study: &'static str,
) -> Metric {
    Metric { name, title: title(name), group, value, unit, better: Better::Lower, definition, study }
}

fn higher(metric: Metric) -> Metric {
    Metric { better: Better::Higher, ..metric }
}

/// All measures of a procedure, ordered by group; `way` is the way to the target, if known.
pub fn assess(record: &Record, way: Option<&Way>) -> Vec<Metric> {
    let mut all = Vec::new();
    all.extend(time(record));
    all.extend(radiation(record));
    all.extend(contrast(record));
    all.extend(motion(record, way));
    all.extend(safety(record));
    all.extend(on_way(record, way));
    all.extend(task(record, way));
    all
}

fn rests(record: &Record) -> impl Iterator<Item = (f64, f64)> {
    let rest = record.timed().filter(|(_, sample)| sample.rests());
    rest.map(|(took_s, sample)| (sample.time_s - took_s, sample.time_s))
}

/// Time during which no instrument is moved, s.
fn idle_s(record: &Record) -> f64 {
    total(rests(record).map(|(from, to)| to - from))
}

/// Time during which no instrument is moved and the beam is on, s; `None` if the beam was not recorded.
fn beam_on_idle_s(record: &Record) -> Option<f64> {
    record.beam.as_ref()?;
    Some(total(rests(record).filter_map(|(from, to)| record.beam_on_s(from, to))))
}

fn time(record: &Record) -> Vec<Metric> {
    let of = |name, value, definition, study| lower(Group::Time, (name, "s"), value, definition, study);
    let beam_s = record.beam_on_s(0.0, record.end_s());
    vec![
        of("total_s", Some(record.end_s()), "time from the start to the end of the last step", REVIEW),
        of("idle_s", Some(idle_s(record)), "time of steps in which no hand moves or turns", RAFII),
        of("beam_on_s", beam_s, "time with the beam on", REVIEW),
        of(
            "beam_on_idle_s",
            beam_on_idle_s(record),
            "time with the beam on while no hand moves or turns",
            REVIEW,
        ),
    ]
}

fn radiation(record: &Record) -> Vec<Metric> {
    let of = |name, unit, value, definition| lower(Group::Radiation, (name, unit), value, definition, REVIEW);
    let sum = |each: fn(&crate::BeamState) -> f64| {
        let on = record.beam_stretches()?.filter(|(state, _)| state.on);
        Some(total(on.map(|(state, end_s)| each(state) * (end_s - state.time_s))))
    };
    // Known only where it was recorded all the while.
    let known = |is: fn(&crate::BeamState) -> bool| {
        record.beam.as_ref().is_some_and(|beam| beam.iter().filter(|state| state.on).all(is))
    };
    let entrance = sum(|state| state.frames_per_s * state.entrance_ngy.unwrap_or(0.0) * 1e-3)
        .filter(|_| known(|state| state.entrance_ngy.is_some()));
    let entrance_area = sum(|state| {
        let each_ugy = state.entrance_ngy.unwrap_or(0.0) * 1e-3;
        state.frames_per_s * each_ugy * state.entrance_mm2.unwrap_or(0.0) * 1e-2
    });
    let entrance_area =
        entrance_area.filter(|_| known(|state| state.entrance_ngy.and(state.entrance_mm2).is_some()));
    let acquired = sum(|state| f64::from(u8::from(state.mode.is_some_and(BeamMode::acquires))))
        .filter(|_| known(|state| state.mode.is_some()));
    let frames = sum(|state| state.frames_per_s);
    let kerma = sum(|state| state.frames_per_s * state.dose_ngy * 1e-3);
    // 1 µGy·mm² is 10⁻² µGy·cm².
    let kerma_area = sum(|state| state.frames_per_s * state.dose_ngy * 1e-3 * state.field_mm2 * 1e-2);
    let area_s = sum(|state| state.field_mm2 * 1e-2);
    let field = area_s.zip(sum(|_| 1.0)).filter(|(_, on_s)| *on_s > 0.0).map(|(area, on_s)| area / on_s);
    let beam = record.beam.as_deref();
    let pairs = |change: fn(&crate::BeamState, &crate::BeamState) -> bool| {
        beam.map(|beam| beam.windows(2).filter(|pair| change(&pair[0], &pair[1])).count() as f64)
    };
    let first = beam.map(|beam| f64::from(u8::from(beam.first().is_some_and(|state| state.on))));
    let runs = pairs(|a, b| !a.on && b.on).zip(first).map(|(later, first)| later + first);
    let moves = pairs(|a, b| a.primary_deg != b.primary_deg || a.secondary_deg != b.secondary_deg);
    vec![
        of("kerma_ugy", "µGy", kerma, "air kerma at the detector, summed over frames"),
        of(
            "kerma_area_ugycm2",
            "µGy·cm²",
            kerma_area,
            "air kerma at the detector times the open area, summed over frames",
        ),
        of(
            "entrance_ugy",
            "µGy",
            entrance,
            "air kerma at the patient entrance reference point, 150 mm before the isocentre, summed over frames",
        ),
        of(
            "entrance_area_ugycm2",
            "µGy·cm²",
            entrance_area,
            "the same times the open area there: the kerma–area product",
        ),
        of("acquisition_s", "s", acquired, "time with the beam on in cine or subtraction"),
        of(
            "moving_in_acquisition_s",
            "s",
            moving_in_acquisition_s(record),
            "time of it in which a hand moves: fluoroscopy shows as much, at a tenth of the dose",
        ),
        of("runs", "1", runs, "how often the beam was switched on"),
        of("frames", "1", frames.map(f64::round), "frames while the beam was on, as a whole number"),
        of("field_cm2", "cm²", field, "mean open area at the detector while the beam was on"),
        of("c_arm_moves", "1", moves, "changes of the C-arm's angles"),
    ]
}

fn contrast(record: &Record) -> Vec<Metric> {
    let of = |name, unit, value, definition| lower(Group::Contrast, (name, unit), value, definition, REVIEW);
    let end_s = record.end_s();
    let fastest = record.injections.iter().map(|one| one.rate_ml_per_s).fold(0.0, f64::max);
    let each = record.injections.iter().map(|one| Some((one.flowed_ml(end_s), record.is_against_wall(one)?)));
    let against: Option<Vec<(f64, bool)>> = each.collect();
    let at_wall = against.map(|all| total(all.into_iter().filter(|one| one.1).map(|one| one.0)));
    let count = record.injections.len() as f64;
    vec![
        of(
            "contrast_ml",
            "ml",
            Some(flowed_ml(&record.injections, end_s)),
            "contrast medium that has flowed",
        ),
        of("injections", "1", Some(count), "how often it was injected"),
        of("largest_rate_ml_per_s", "ml/s", Some(fastest), "fastest injection"),
        of(
            "against_wall_ml",
            "ml",
            at_wall,
            "medium of injections that began with the tip that it leaves held by a wall with more than 1 mN",
        ),
    ]
}

fn motion(record: &Record, way: Option<&Way>) -> Vec<Metric> {
    let of =
        |name, unit, value, definition, study| lower(Group::Motion, (name, unit), value, definition, study);
    let path = record.path_of_tip();
    let path_mm = total(path.windows(2).map(|pair| (pair[1].1 - pair[0].1).norm()));
    let mut tips =
        record.start_mm.into_iter().chain(record.samples.iter().filter_map(|sample| sample.tip_mm));
    let first = tips.next();
    let ends = first.zip(tips.next_back().or(first));
    let shortest_mm = way.zip(ends).map(|(way, (from, to))| way.length_mm(&from, &to));
    let ratio = shortest_mm.filter(|mm| *mm >= SHORTEST_MM).map(|mm| path_mm / mm);
    let speeds = speeds(&path);
    // Of the same stretch of time as the path.
    let begins_s = path.first().map_or(0.0, |first| first.0);
    let moves = |(_, sample): &(f64, &crate::Sample)| sample.time_s > begins_s && !sample.rests();
    let moving_s = total(record.timed().filter(moves).map(|(took_s, _)| took_s));
    let turned_back = reversals(record);
    let (count, mean_s) = submovements(&speeds, begins_s, &turned_back);
    let hands = || record.samples.iter().flat_map(|sample| sample.hands.iter().enumerate());
    let turned = total(hands().map(|(_, hand)| hand.rotate_rad.abs()));
    let retracted = total(hands().map(|(_, hand)| (-hand.advance_mm).max(0.0)));
    vec![
        of("tip_path_mm", "mm", Some(path_mm), "way of the foremost tip, without what undo does", RAFII),
        of(
            "path_ratio",
            "1",
            ratio,
            "way of the tip over the length of the centre line between its ends",
            RAFII,
        ),
        higher(of(
            "tip_speed_mm_per_s",
            "mm/s",
            (moving_s > 0.0).then(|| path_mm / moving_s),
            "way of the tip over the time in which a hand moves meanwhile",
            ESTRADA,
        )),
        higher(of(
            "spectral_arc_length",
            "1",
            smoothness_of_movements(&speeds, begins_s, &moving(record, PAUSE_S)),
            "less the arc length of the scaled amplitude spectrum of the tip's speed, sampled each 0.05 s, to 5 % of its largest amplitude; of each movement between pauses of half a second, as a mean over their time",
            ESTRADA,
        )),
        of(
            "submovements",
            "1",
            Some(count as f64),
            "stretches of at least 0.1 s with the tip faster than 2 mm/s, divided where a hand turns back",
            ESTRADA,
        ),
        higher(of("submovement_s", "s", mean_s, "mean duration of these", ESTRADA)),
        of(
            "reversals",
            "1",
            Some(turned_back.len() as f64),
            "changes of hands between pushing and pulling",
            RAFII,
        ),
        of("turns", "1", Some(turned / std::f64::consts::TAU), "turns of hands to either side", RAFII),
        of(
            "needless_turns",
            "1",
            Some(needless_turns(record)),
            "turns beyond the shortest way to each direction and half a turn to look, for each 20 mm of the way",
            RAFII,
        ),
        of("retracted_mm", "mm", Some(retracted), "length pulled back by hands", REVIEW),
    ]
}

fn safety(record: &Record) -> Vec<Metric> {
    let of =
        |name, unit, value, definition, study| lower(Group::Safety, (name, unit), value, definition, study);
    let samples = &record.samples;
    let most = |each: &dyn Fn(&crate::Sample) -> f64| samples.iter().map(each).fold(0.0, f64::max);
    let mut forces: Vec<(f64, f64)> = record.timed().map(|(s, sample)| (sample.wall_force_n, s)).collect();
    forces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left_s = MOST_OF_TIME * record.end_s();
    let percentile = forces.iter().find(|(_, took_s)| {
        left_s -= took_s;
        left_s <= 0.0
    });
    let impulse = total(record.timed().map(|(took_s, sample)| sample.wall_force_n * took_s));
    let hand_n = most(&|sample| {
        let forces = sample.hands.iter().filter_map(|hand| hand.push_force_n);
        forces.map(f64::abs).fold(0.0, f64::max)
    });
    let torque = most(&|sample| sample.hands.iter().map(|hand| hand.torque_nmm.abs()).fold(0.0, f64::max));
    let several = samples.iter().any(|sample| sample.hands.len() > 1);
    let ahead_s = total(record.timed().filter(|(_, sample)| sample.is_ahead()).map(|(s, _)| s));
    let idle_s = idle_s(record);
    let blind_s = record
        .beam_on_s(0.0, record.end_s())
        .zip(beam_on_idle_s(record))
        .map(|(on_s, on_idle_s)| (record.end_s() - idle_s - (on_s - on_idle_s)).max(0.0));
    let jumps = samples.iter().filter(|sample| sample.jumped).count();
    vec![
        of("wall_force_n", "N", Some(most(&|s| s.wall_force_n)), "largest sum of wall forces", RAFII),
        of(
            "wall_force_95_n",
            "N",
            percentile.map(|one| one.0),
            "sum of wall forces that is not exceeded in 95 % of the time",
            RAFII,
        ),
        of("tip_force_n", "N", Some(most(&|s| s.tip_force_n)), "largest wall force at the tip", RAFII),
        of(
            "wall_impulse_ns",
            "N·s",
            Some(impulse),
            "sum of wall forces times the time that they last",
            RAFII,
        ),
        of("hand_force_n", "N", Some(hand_n), "largest force of a hand, pushing or pulling", RAFII),
        of("hand_torque_nmm", "N·mm", Some(torque), "largest torque of a hand", RAFII),
        of(
            "jumps",
            "1",
            Some(jumps as f64),
            "steps in which the device snapped to another equilibrium",
            REVIEW,
        ),
        of(
            "catheter_ahead_s",
            "s",
            several.then_some(ahead_s),
            "time with an instrument farther in than the one in it",
            BOYLE,
        ),
        of("moving_without_beam_s", "s", blind_s, "time with a hand moving and the beam off", BOYLE),
        of(
            "unseen_share",
            "1",
            unseen_share(record),
            "share of the time with a hand moving in which the beam is off or the tip that moves is not in the picture",
            BOYLE,
        ),
        of(
            "push_speed_mm_per_s",
            "mm/s",
            push_speed_mm_per_s(record),
            "fastest push of a hand, as a mean over half a second",
            RAFII,
        ),
    ]
}

fn on_way(record: &Record, way: Option<&Way>) -> Vec<Metric> {
    let wrong = way.map(|way| {
        let known = record.samples.iter().filter_map(|one| Some((one.undone, one.on_centreline_mm()?)));
        let branches: Vec<(bool, Option<usize>)> =
            known.map(|(undone, tip)| (undone, way.wrong_branch(&tip))).collect();
        let first = branches.first().is_some_and(|first| first.1.is_some());
        // Undo may put a tip into a branch that it has left.
        let entered = |pair: &&[(bool, Option<usize>)]| {
            let [(_, before), (undone, now)] = [pair[0], pair[1]];
            now.is_some() && before != now && !undone
        };
        (branches.windows(2).filter(entered).count() + usize::from(first)) as f64
    });
    let up_s = way.and_then(|way| {
        let past = |sample: &&crate::Sample| {
            sample.on_centreline_mm().is_some_and(|tip| way.is_past_first_fork(&tip) == Some(true))
        };
        record.samples.iter().find(past).map(|sample| sample.time_s)
    });
    let of = |name, unit, value, definition, study| lower(Group::Way, (name, unit), value, definition, study);
    vec![
        of(
            "wrong_branches",
            "1",
            wrong,
            "how often the tip went deeper than its radius into a branch that is not on the way",
            BOYLE,
        ),
        of(
            "time_in_trunk_s",
            "s",
            up_s,
            "time until the tip is a radius beyond the first fork on its way: of arches, the time up the aorta",
            REVIEW,
        ),
    ]
}

fn task(record: &Record, way: Option<&Way>) -> Vec<Metric> {
    let instrument = way.and_then(|way| way.instrument);
    let last = record.samples.iter().rev().find_map(|sample| sample.tip_of_mm(instrument));
    let packed = record.samples.last().and_then(|sample| sample.packing);
    let target = way.and_then(Way::target_mm);
    let error = target.map(|(target, _)| last.map_or(f64::INFINITY, |tip| (tip - target).norm()));
    let arrived = target.zip(error).map(|((_, within_mm), mm)| f64::from(u8::from(mm <= within_mm)));
    vec![
        higher(lower(
            Group::Task,
            ("arrived", "1"),
            arrived,
            "1 where the tip, that of the instrument that the goal names, ends within the target's reach, else 0",
            REVIEW,
        )),
        lower(
            Group::Task,
            ("placement_error_mm", "mm"),
            error.filter(|mm| mm.is_finite()),
            "distance of this tip from the target at the end",
            REVIEW,
        ),
        higher(lower(
            Group::Task,
            ("packing_density", "1"),
            packed.map(|packed| packed.density),
            "volume of coils in the sac over that of the sac at the end",
            SLUZEWSKI,
        )),
        lower(
            Group::Task,
            ("coil_outside_mm", "mm"),
            packed.map(|packed| packed.outside_mm),
            "length of coils outside the neck of the sac at the end",
            SLUZEWSKI,
        ),
    ]
}
