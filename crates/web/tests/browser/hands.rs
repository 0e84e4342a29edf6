//! What hands do on the page itself: planes, gamepads, files that are saved, a lost graphics processor, keys at random.

use serde_json::json;

use crate::chromium::Browser;
use crate::native::Dice;
use crate::{LAPTOP, PHONE, READY, alone, drop_file, native, with_webgpu};

/// Millimetres that the first instrument is in.
const INSERTED: &str =
    "Number(document.querySelector('.instrument').textContent.match(/([\\d.]+) mm in/)[1])";

/// Whether a canvas shows something.
fn shows(canvas: &str) -> String {
    format!(
        "new Set(document.querySelector('#{canvas} canvas').getContext('2d').getImageData(0, 0, 384, 384).data).size > 40"
    )
}

#[test]
fn two_planes_are_shown_beside_each_other_and_saved_with_the_3d_view() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait(READY);
    assert_eq!(browser.eval("document.getElementById('second').hidden"), true);
    let scene = "(await (await fetch('assets/scenes/curved_tube_exact.toml')).text()).replace('[view]\\n', '[view]\\nbiplane_deg = 90.0\\n')";
    drop_file(&mut browser, "two.toml", scene);
    browser.wait("document.title === 'endowire: own'");
    browser.key("Enter", true);
    browser.key("Enter", false);
    browser.wait(&format!("{} && {} && {}", shows("fluoro"), shows("second"), shows("three")));
    browser.wait("document.getElementById('second-arm').textContent === 'LAO 90°'");
    // They are not the same picture.
    let differ = "(() => {
        const [a, b] = ['fluoro', 'second'].map((id) => document.querySelector(`#${id} canvas`).getContext('2d').getImageData(0, 0, 384, 384).data);
        return a.some((value, k) => Math.abs(value - b[k]) > 50);
    })()";
    browser.wait(differ);
    browser.eval("URL.createObjectURL = (blob) => { window.saved = blob; return '#'; }");
    browser.eval("document.getElementById('save-picture').click()");
    browser.wait("Boolean(window.saved)");
    let size = browser.eval("createImageBitmap(window.saved).then(({ width, height }) => [width, height])");
    assert_eq!(size, json!([3 * 384, 384]));
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_gamepad_moves_the_wire_while_its_stick_leans_and_its_trigger_is_the_pedal() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_exact.toml", LAPTOP) else { return };
    browser.wait(READY);
    browser.eval(
        "(() => {
            const pad = window.pad = {
                mapping: 'standard', axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false })),
            };
            navigator.getGamepads = () => [null, pad];
            dispatchEvent(new Event('gamepadconnected'));
        })()",
    );
    let live = "document.getElementById('fluoro').classList.contains('live')";
    // Worn sticks do not come back to the middle.
    browser.eval("pad.axes[1] = -0.1");
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(browser.eval(INSERTED), 0.0);
    assert_eq!(browser.eval(live), false);
    browser.eval("pad.axes[1] = -1; pad.buttons[7].pressed = true");
    browser.wait(&format!("{INSERTED} > 10 && {live}"));
    browser.eval("pad.axes[1] = 0; pad.axes[2] = 1; pad.buttons[7].pressed = false");
    browser.wait(&format!(
        "!{live} && Number(document.querySelector('.instrument').textContent.match(/(-?\\d+)°/)[1]) > 30"
    ));
    // One that is pulled out lets go.
    browser
        .eval("navigator.getGamepads = () => [null, null]; dispatchEvent(new Event('gamepaddisconnected'))");
    std::thread::sleep(std::time::Duration::from_millis(300));
    let turned = "document.querySelector('.instrument').textContent.match(/(-?\\d+)°/)[1]";
    let before = browser.eval(turned);
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert_eq!(browser.eval(turned), before);
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn script_and_table_that_are_saved_tell_what_hands_did() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_exact.toml", LAPTOP) else { return };
    browser.wait(READY);
    browser.key("ArrowUp", true);
    browser.wait(&format!("{INSERTED} > 10"));
    browser.key("ArrowUp", false);
    browser.eval("URL.createObjectURL = (blob) => { window.saved = blob.text(); return '#'; }");
    let mut saved = |button: &str| {
        browser.eval(&format!("window.saved = null; document.getElementById('{button}').click()"));
        browser.wait("Boolean(window.saved)");
        browser.eval("window.saved").as_str().unwrap().to_owned()
    };
    let script = saved("save-script");
    assert!(script.contains("endowire run") && script.contains("[[script]]"), "{script}");
    let table = saved("save-table");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..4], ["time_s", "tip_x_mm", "tip_y_mm", "tip_z_mm"]);
    assert!(rows.len() > 20 && rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
    let inserted = rows[0].iter().position(|name| name.ends_with("_inserted_mm")).unwrap();
    let [first, last] = [&rows[1], &rows[rows.len() - 1]].map(|row| row[inserted].parse::<f64>().unwrap());
    assert!(last > first + 8.0, "{first} {last}");
    let run = native::run("curved_tube_exact.toml", &script);
    assert!((run.report().inserted_mm - last).abs() < 0.5, "{last}");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_graphics_processor_that_is_lost_leaves_pictures_to_the_processor_which_is_said() {
    let _alone = alone();
    let Some(mut browser) = with_webgpu("curved_tube_exact.toml", 128) else { return };
    let reported = browser.eval(
        "(async () => {
            const { Graphics } = await import('./pkg/endowire.js');
            const request = GPUAdapter.prototype.requestDevice;
            let device;
            GPUAdapter.prototype.requestDevice = async function (...all) { return device = await request.apply(this, all); };
            const graphics = await Graphics.open();
            session.useGraphics(graphics);
            session.draw3DBy(graphics);
            const rest = () => new Promise((resolve) => setTimeout(resolve, 10));
            const until = async (done) => { for (let time = 0; !done(); time++) { if (time > 1500) throw new Error('too long'); await rest(); } };
            session.apply({ do: 'pedal', down: true });
            const turn = () => {
                session.apply({ do: 'turn_c_arm', lao_deg: 5 });
                session.apply({ do: 'turn_camera', azimuth_deg: 5 });
            };
            const look = () => { session.fluoroSoon(); session.sharpen(); return Boolean(session.threeD()); };
            await until(() => { look(); return session.backend() === 'WebGPU'; });
            turn();
            let views = 0;
            await until(() => { views += look(); return views > 0 && session.backend() === 'WebGPU'; });
            const before = [session.backend(), session.backend3D()];
            device.destroy();
            turn();
            let pictures = 0;
            await until(() => { pictures += look(); return session.backend().includes('failed') && pictures > 0; });
            return [...before, session.backend(), session.backend3D(), session.fluoroSoon()[0].data.some((one) => one > 100)];
        })()",
    );
    assert_eq!([&reported[0], &reported[1]], ["WebGPU", "WebGPU"]);
    for backend in [&reported[2], &reported[3]] {
        assert!(backend.as_str().unwrap().starts_with("CPU reference (adapter failed: "), "{reported}");
    }
    assert_eq!(reported[4], true);
}

#[test]
fn thousands_of_keys_at_random_break_nothing_on_a_phone_whose_page_is_no_wider() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_friction.toml", PHONE) else { return };
    browser.wait(READY);
    assert_eq!(browser.eval("document.documentElement.scrollWidth"), PHONE[0]);
    let mut dice = Dice(11);
    let keys: Vec<_> = (0..5000).map(|_| dice.key()).collect();
    let most = browser.eval(&format!(
        "(async () => {{
            const screen = await import('./screen.js');
            let most = 0;
            for (const [number, [code, down]] of {}.entries()) {{
                dispatchEvent(new KeyboardEvent(down ? 'keydown' : 'keyup', {{ code, shiftKey: number % 7 === 0, cancelable: true }}));
                // A tick: more keys in one would undo all that was done in the one before.
                if (number % 10 === 0) await new Promise((resolve) => setTimeout(resolve, 17));
                most = Math.max(most, screen.readout.step);
            }}
            return most;
        }})()",
        json!(keys)
    ));
    assert!(most.as_u64().unwrap() > 0, "steps were done, and undone: {most}");
    browser.eval("dispatchEvent(new Event('blur'))");
    // It goes on.
    let time_s = "(async () => (await import('./screen.js')).readout.time_s)()";
    let before = browser.eval(time_s).as_f64().unwrap();
    browser.wait(&format!("{time_s}.then((now) => now > {})", before + 0.5));
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_tomogram_is_refused_in_one_line() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait(READY);
    drop_file(&mut browser, "chest.nii.gz", "new Uint8Array([31, 139, 8, 0])");
    browser.wait("document.getElementById('told').textContent === 'chest.nii.gz: tomograms are read by the program alone'");
    let scene = "(await (await fetch('assets/scenes/curved_tube_exact.toml')).text()) + '\\n[view.patient.ct]\\nfile = \"chest.nii\"\\n'";
    drop_file(&mut browser, "own.toml", scene);
    browser.wait("document.getElementById('told').textContent.includes('tomograms are read by the program alone: leave [view.patient.ct] out here')");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}
