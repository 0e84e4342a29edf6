//! Layout of the window: the live picture, the 3D view, forces, help.

use endowire_play::{IdleKey, InstrumentReadout, LabReadout, Readout};
use endowire_viewer::{Image, Mode, PixelFormat};

use super::super::live::Shown;
use super::task;
use super::text::{Canvas, Scale, Writer};

const BACK: u32 = 0x10_1418;
const PANEL: u32 = 0x1a_2026;
pub(super) const TEXT: u32 = 0xd8_dee4;
const FAINT: u32 = 0x86_9098;
pub(super) const WARN: u32 = 0xff_5a4a;
const LIVE: u32 = 0xff_c020;
pub(super) const CHOSEN: u32 = 0x5a_c8fa;
/// Height of the panel below the pictures, and of a line of text, at the usual size.
const PANEL_PX: usize = 196;
/// Smallest lag of a device behind its commanded motion that is shown, mm.
const LAG_MM: f64 = 0.05;

/// A key and its effect.
pub(super) type Help = (&'static str, &'static str);

/// Layout of the pictures: side of the live ones, which start at the left, and corner and size of the 3D view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layout {
    planes: usize,
    pub(super) side: usize,
    pub(super) three_d: ([usize; 2], [usize; 2]),
    panel: usize,
}

impl Layout {
    pub(super) fn of([width, height]: [usize; 2], planes: usize, scale: Scale) -> Self {
        let panel = scale.px(PANEL_PX).min(height / 3);
        // The 3D view gets at least two fifths of the width, or one fifth with two planes.
        let most = if planes > 1 { width * 2 / 5 } else { width * 3 / 5 };
        let side = (height - panel).min(most);
        let left = planes * side;
        Self { planes, side, three_d: ([left, 0], [width - left, height - panel]), panel: height - panel }
    }

    /// Corners of the live pictures.
    fn corners(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let side = self.side;
        (0..self.planes).map(move |plane| [plane * side, 0])
    }

    /// The plane whose picture is at a position in the window.
    pub(super) fn plane_at(&self, x: f64, y: f64) -> Option<usize> {
        let plane = (x / self.side.max(1) as f64) as usize;
        (plane < self.planes && y < self.side as f64).then_some(plane)
    }
}

/// Draws the whole window, with help if requested and the name of a gamepad if one is connected.
pub(super) fn compose(
    writer: &mut Writer,
    shown: &Shown<'_>,
    (size, scale): ([usize; 2], Scale),
    help: Option<&[Help]>,
    gamepad: Option<&str>,
) -> Canvas {
    let mut canvas = Canvas::new(size, scale);
    canvas.fill([0, 0], size, BACK);
    let readout = &shown.moment.snapshot.readout;
    let layout = Layout::of(size, planes(readout), scale);
    let side = layout.side;
    for (plane, corner) in layout.corners().enumerate() {
        match shown.fluoro.get(plane) {
            Some(image) => paint(&mut canvas, image, corner, [side; 2]),
            None => {
                canvas.fill(corner, [side; 2], 0);
                let at = [corner[0] + side / 2 - scale.px(150).min(side / 2), corner[1] + side / 2];
                writer.write(&mut canvas, at, 16, FAINT, "hold SPACE for fluoroscopy, F1 for help");
            }
        }
    }
    if let Some(image) = shown.three_d {
        let (corner, [width, height]) = layout.three_d;
        let side = width.min(height);
        let middle = [corner[0] + (width - side) / 2, corner[1] + (height - side) / 2];
        canvas.fill(corner, [width, height], background(image));
        paint(&mut canvas, image, middle, [side; 2]);
    }
    over_picture(writer, &mut canvas, readout, layout);
    canvas.fill([0, layout.panel], [size[0], size[1] - layout.panel], PANEL);
    panel(writer, &mut canvas, shown, gamepad, layout);
    if let Some(standing) = &readout.subject {
        let left = layout.three_d.0[0];
        let below = ([left, layout.panel], [size[0] - left, size[1] - layout.panel]);
        let places = task::Places { over: layout.three_d, below };
        task::show(writer, &mut canvas, standing, readout.step > 0, &places);
    }
    if let Some(help) = help {
        show_help(writer, &mut canvas, help, &readout.idle_keys);
    }
    canvas
}

/// Number of planes of fluoroscopy.
pub(super) fn planes(readout: &Readout) -> usize {
    1 + usize::from(readout.lab.second_deg.is_some())
}

/// Writes the usual annotations of a cath lab onto the pictures.
fn over_picture(writer: &mut Writer, canvas: &mut Canvas, readout: &Readout, layout: Layout) {
    let lab = &readout.lab;
    let mode = match lab.mode {
        Mode::Fluoro => "FLUORO",
        Mode::Cine => "CINE",
        Mode::Dsa => "DSA",
        Mode::Roadmap => "ROADMAP",
    };
    let angle = |deg: f64, plus: &str, minus: &str| {
        format!("{} {:.0}°", if deg < 0.0 { minus } else { plus }, deg.abs())
    };
    let (state, colour) = if lab.live { (mode.to_owned(), LIVE) } else { (format!("{mode} held"), TEXT) };
    let angles = std::iter::once([lab.lao_deg, lab.cra_deg]).chain(lab.second_deg);
    let (side, scale) = (layout.side, canvas.scale);
    let [edge, below, lamp] = [12, 26, 16].map(|px| scale.px(px));
    for ([left, top], [lao_deg, cra_deg]) in layout.corners().zip(angles) {
        let pose = format!("{}  {}", angle(lao_deg, "LAO", "RAO"), angle(cra_deg, "CRA", "CAU"));
        shadowed(writer, canvas, [left + edge, top + below], 18, colour, &state);
        if lab.live {
            canvas.fill([left + side.saturating_sub(edge + lamp), top + edge], [lamp; 2], LIVE);
        }
        let bottom = top + side.saturating_sub(scale.px(14));
        shadowed(writer, canvas, [left + edge, bottom], 16, TEXT, &pose);
        let zoom = format!("{:.0} mm", lab.field_mm);
        shadowed(writer, canvas, [left + side.saturating_sub(scale.px(90)), bottom], 16, TEXT, &zoom);
    }
}

fn panel(writer: &mut Writer, canvas: &mut Canvas, shown: &Shown<'_>, gamepad: Option<&str>, layout: Layout) {
    let readout = &shown.moment.snapshot.readout;
    let (width, top, scale) = (canvas.size[0], layout.panel, canvas.scale);
    let [left, first, row, spacing] = [12, 28, 26, 24].map(|px| scale.px(px));
    for (line, one) in readout.instruments.iter().rev().enumerate() {
        let y = top + first + row * line;
        let chosen = one.name == readout.selected;
        if chosen {
            canvas.fill([0, y - scale.px(19)], [width, scale.px(25)], 0x26_3440);
        }
        instrument(writer, canvas, one, y, chosen);
    }
    let lab = &readout.lab;
    let y = top + first + row * readout.instruments.len() + scale.px(8);
    writer.write(canvas, [left, y], 15, TEXT, &beam(lab));
    let sac = readout.packing.as_ref().map_or_else(String::new, |packing| {
        // Rounding must not leave a minus sign before zero.
        let full = (1e3 * packing.density).round() / 10.0 + 0.0;
        format!("   sac {full:.1} % full, {:.1} mm of coils outside", packing.outside_mm)
    });
    let contacts = format!("contacts {}, {} in all", readout.contacts, force(readout.wall_force_n));
    let contrast = format!("contrast {:.0} ml   ", lab.contrast_ml);
    writer.write(canvas, [left, y + spacing], 15, TEXT, &[contrast, contacts, sac].concat());
    let frame = |ms: f64| format!("   {:.1} ms a step   {ms:.1} ms a frame", shown.moment.step_ms);
    let times = [
        format!("step {}", readout.step),
        shown.frame_ms.map_or_else(String::new, frame),
        "   F1 help".to_owned(),
        gamepad.map_or_else(String::new, |name| format!("   gamepad: {name}")),
    ]
    .concat();
    writer.write(canvas, [left, y + 2 * spacing], 15, FAINT, &times);
    let reported = shown.failure.map(str::to_owned).or_else(|| {
        let shown = |event: &&endowire_play::Event| event.is_shown(readout.step, readout.time_s);
        readout.event.as_ref().filter(shown).map(|event| event.text.clone())
    });
    let reported = reported
        .or_else(|| readout.demonstrates.then(|| "the script is shown: move to take over".to_owned()));
    if let Some(text) = reported {
        writer.write(canvas, [left, y + 3 * spacing], 15, WARN, &text);
    }
}

/// Tube and doses: kerma at the patient's entrance and kerma–area product once a picture was drawn.
fn beam(lab: &LabReadout) -> String {
    let clock = format!("beam {:02.0}:{:04.1}", (lab.beam_s / 60.0).floor(), lab.beam_s % 60.0);
    let current = lab.current_ma.map_or_else(String::new, |ma| format!(" {ma:.0} mA"));
    let tube = format!("   {:.0} kV{current}   SID {:.0} mm", lab.kvp, lab.sid_mm);
    let kerma = match (lab.entrance_ugy, lab.kerma_area_ugym2) {
        (Some(ugy), Some(area)) => format!("   entrance {:.2} mGy, {area:.1} µGy·m²", ugy / 1000.0),
        _ => format!("   detector {:.1} µGy", lab.dose_ugy),
    };
    [clock, tube, kerma].concat()
}

fn instrument(writer: &mut Writer, canvas: &mut Canvas, one: &InstrumentReadout, y: usize, chosen: bool) {
    let colour = if chosen { CHOSEN } else { TEXT };
    let mark = if chosen { ">" } else { " " };
    let steered = one.steer.map_or_else(String::new, |value| format!("  tip {}", bend(value)));
    let length = format!(
        "{mark} {:<12} {:>7.1} mm in  {:>8.0}°{steered}",
        one.name, one.inserted_mm, one.rotation_deg
    );
    let [left, gap] = [12, 20].map(|px| canvas.scale.px(px));
    let x = writer.write(canvas, [left, y], 16, colour, &length);
    let push = one.push_force_n.map_or_else(|| "--".to_owned(), force);
    let force = format!("  push {push:>9}  torque {:>7} N·mm", signed(format!("{:.3}", one.torque_nmm)));
    let colour = if one.warns { WARN } else { TEXT };
    let x = writer.write(canvas, [x, y], 16, colour, &force);
    let x = if one.warns { writer.write(canvas, [x + gap, y], 16, WARN, "LIMIT") } else { x };
    if one.behind_mm.abs() >= LAG_MM {
        writer.write(canvas, [x + gap, y], 16, FAINT, &format!("hand {:+.1} mm ahead", one.behind_mm));
    }
}

/// A force with its unit: those of microwires and coils are in millinewtons.
fn force(newtons: f64) -> String {
    if newtons.abs() >= 0.1 {
        return format!("{newtons:.3} N");
    }
    format!("{} mN", signed(format!("{:.1}", 1000.0 * newtons)))
}

/// The value to which a tip is steered.
fn bend(value: f64) -> String {
    let rounded = (100.0 * value).round() / 100.0;
    if rounded == 0.0 { "straight".to_owned() } else { format!("{rounded:+.2}") }
}

/// A rounded number without a minus sign before zero.
fn signed(number: String) -> String {
    let is_zero = !number.contains(|c: char| ('1'..='9').contains(&c));
    number.strip_prefix('-').filter(|_| is_zero).map(str::to_owned).unwrap_or(number)
}

/// Keys, which begin with those of [`endowire_play::KEYS`]; those that do nothing now are faint, with the reason.
fn show_help(writer: &mut Writer, canvas: &mut Canvas, help: &[Help], idle: &[IdleKey]) {
    let scale = canvas.scale;
    let [edge, spacing, first, column] = [24, 22, 52, 270].map(|px| scale.px(px));
    let width = canvas.size[0].saturating_sub(2 * edge).min(scale.px(1180));
    canvas.fill([edge; 2], [width, spacing * help.len() + edge], 0x08_0c10);
    for (line, (keys, what)) in help.iter().enumerate() {
        let y = first + spacing * line;
        let why = endowire_play::idle_words(line, idle);
        writer.write(canvas, [scale.px(40), y], 15, if why.is_some() { FAINT } else { CHOSEN }, keys);
        let end = writer.write(canvas, [column, y], 15, if why.is_some() { FAINT } else { TEXT }, what);
        if let Some(why) = why {
            writer.write(canvas, [end.max(scale.px(560)) + scale.px(20), y], 15, FAINT, &why);
        }
    }
}

/// Draws text that is legible on black and white.
fn shadowed(
    writer: &mut Writer,
    canvas: &mut Canvas,
    [x, y]: [usize; 2],
    size: usize,
    colour: u32,
    text: &str,
) {
    let off = canvas.scale.px(1);
    writer.write(canvas, [x + off, y + off], size, 0, text);
    writer.write(canvas, [x, y], size, colour, text);
}

/// The background colour of a picture: that of its first pixel.
fn background(image: &Image) -> u32 {
    image.pixel(0, 0).map_or(BACK, |bytes| match bytes {
        [red, green, blue, _] => u32::from(*red) << 16 | u32::from(*green) << 8 | u32::from(*blue),
        grey => u32::from(grey[0]) * 0x01_0101,
    })
}

/// Paints a picture, scaled with interpolation.
fn paint(canvas: &mut Canvas, image: &Image, [left, top]: [usize; 2], [width, height]: [usize; 2]) {
    let (columns, rows) = (image.width() as usize, image.height() as usize);
    let places = |length: usize, pixels: usize| -> Vec<(usize, usize, u32)> {
        let at = |k: usize| {
            let place =
                ((k as f64 + 0.5) * pixels as f64 / length as f64 - 0.5).clamp(0.0, (pixels - 1) as f64);
            let low = place as usize;
            (low, (low + 1).min(pixels - 1), ((place - low as f64) * 256.0) as u32)
        };
        (0..length).map(at).collect()
    };
    let (across, down) = (places(width, columns), places(height, rows));
    let bytes = image.format().bytes();
    let data = image.data();
    for (row, (y0, y1, fy)) in down.into_iter().enumerate().take(canvas.size[1].saturating_sub(top)) {
        let (first, second) = (y0 * columns * bytes, y1 * columns * bytes);
        for (column, (x0, x1, fx)) in across.iter().enumerate().take(canvas.size[0].saturating_sub(left)) {
            let value = |channel: usize| {
                let at = |start: usize, x: usize| u32::from(data[start + x * bytes + channel]);
                let mix = |a: u32, b: u32, f: u32| (a * (256 - f) + b * f) >> 8;
                mix(mix(at(first, *x0), at(first, *x1), *fx), mix(at(second, *x0), at(second, *x1), *fx), fy)
            };
            let colour = match image.format() {
                PixelFormat::Rgba8 => value(0) << 16 | value(1) << 8 | value(2),
                PixelFormat::Gray8 | PixelFormat::Gray16 => value(0) * 0x01_0101,
            };
            canvas.pixels[(top + row) * canvas.size[0] + left + column] = colour;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_any_size_have_a_place_for_all() {
        for size in [[1280, 800], [1, 1], [3, 900], [900, 3], [4000, 2000]] {
            for planes in [1, 2] {
                let layout = Layout::of(size, planes, Scale::of(size, [1280, 860], 1.0));
                assert!(planes * layout.side <= size[0] && layout.side <= size[1], "{layout:?}");
                assert!(layout.three_d.0[0] + layout.three_d.1[0] <= size[0], "{layout:?}");
                assert_eq!(layout.plane_at((planes * layout.side) as f64 + 0.5, 0.0), None);
            }
            let usual = [1280, 860];
            let [one, two] = [1, 2].map(|planes| Layout::of(usual, planes, Scale::of(usual, usual, 1.0)));
            assert_eq!((one.plane_at(600.0, 5.0), two.plane_at(600.0, 5.0)), (Some(0), Some(1)));
            assert_eq!(two.plane_at(600.0, 600.0), None, "below the pictures");
        }
    }

    #[test]
    fn text_and_boxes_at_the_edge_do_not_leave_the_picture() {
        let usual = Scale::of([20, 10], [20, 10], 1.0);
        let mut canvas = Canvas::new([20, 10], usual);
        let mut writer = Writer::new().unwrap();
        canvas.fill([15, 5], [100, 100], 0xff_ffff);
        assert_eq!(canvas.pixels.iter().filter(|pixel| **pixel != 0).count(), 25);
        let end = writer.write(&mut canvas, [2, 8], 15, 0xff_0000, "wire 12.5 mm");
        assert!(end > 50 && canvas.pixels.iter().any(|pixel| pixel & 0xff_0000 != 0));
    }

    #[test]
    fn text_grows_with_the_window_and_with_the_density_of_its_screen() {
        let usual = [1280, 860];
        let width = |size: [usize; 2], density: f64| {
            let mut canvas = Canvas::new([900, 40], Scale::of(size, usual, density));
            Writer::new().unwrap().write(&mut canvas, [0, 30], 15, 0xff_ffff, "beam 00:12.5")
        };
        let one = width(usual, 1.0);
        for (size, density, times) in [
            ([2560, 1720], 1.0, 2),
            ([2560, 1720], 2.0, 2),
            ([1280, 860], 2.0, 2),
            ([390, 800], 1.0, 1),
            ([3840, 860], 1.0, 1),
        ] {
            assert!(width(size, density).abs_diff(times * one) <= times, "{size:?} {density}");
        }
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(signed("-0.000".to_owned()), "0.000");
        assert_eq!(signed("-0.001".to_owned()), "-0.001");
        assert_eq!(signed("0.000".to_owned()), "0.000");
        assert_eq!((force(-1e-9).as_str(), force(-0.25).as_str()), ("0.0 mN", "-0.250 N"));
    }
}
