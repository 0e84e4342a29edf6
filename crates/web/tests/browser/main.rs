//! The page in a real browser: it works by keys, drops and links, has the program's numbers and pictures, and keeps pace. Left out, with a word, where
//! there is no browser or the page is not built.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod chromium;
mod hands;
mod native;
mod training;

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use chromium::Browser;
use endowire_play::Input;
use native::Dice;
use serde_json::{Value, json};

const LAPTOP: [u32; 2] = [1280, 800];
const PHONE: [u32; 2] = [390, 844];
/// What gives a headless browser an adapter for WebGPU.
const WEBGPU: [&str; 2] = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"];

/// Has tests run one after another: they measure, and each is a browser.
fn alone() -> MutexGuard<'static, ()> {
    static MACHINE: Mutex<()> = Mutex::new(());
    MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The page has a session.
const READY: &str = "document.querySelector('#instruments')?.children.length > 0";

/// Imports the module beside the page's own; `opened` makes sessions of a scene there, whose text may be changed before, and `session` is
/// one.
fn module(browser: &mut Browser, scene: &str, side_px: u32) {
    module_of(browser, &format!("scenes/{scene}"), side_px);
}

/// The module with a scene in a browser that has WebGPU; none, and a word, where there is no such browser.
fn with_webgpu(scene: &str, side_px: u32) -> Option<Browser> {
    let mut browser = Browser::with(&WEBGPU, "", LAPTOP)?;
    module(&mut browser, scene, side_px);
    if browser.eval("navigator.gpu?.requestAdapter().then((adapter) => adapter !== null)") != true {
        eprintln!("skipped: this browser has no adapter for WebGPU");
        return None;
    }
    Some(browser)
}

/// The same of a scene or a subject by its path.
fn module_of(browser: &mut Browser, path: &str, side_px: u32) {
    browser.wait(READY);
    browser.eval(&format!(
        "(async () => {{
            const module = await import('./pkg/endowire.js');
            await module.default();
            const path = '{path}';
            const files = await (await import('./files.js')).filesOf(path);
            window.opened = (change = (text) => text) => {{
                const text = change(new TextDecoder().decode(files.get(path)));
                return new module.Session(new Map([...files, [path, new TextEncoder().encode(text)]]), path, {side_px});
            }};
            window.session = opened();
        }})()"
    ));
}

/// Bits of the coordinates that an expression gives.
fn bits(browser: &mut Browser, positions: &str) -> Vec<u64> {
    let text = format!(
        "(async () => [...new BigUint64Array(Float64Array.from({positions}).buffer)].map(String).join(' '))()"
    );
    let reported = browser.eval(&text);
    reported.as_str().unwrap().split_whitespace().map(|word| word.parse().unwrap()).collect()
}

/// What the page measures of itself.
fn pace(browser: &mut Browser, what: &str) -> f64 {
    let reported = browser.eval(&format!("document.getElementById('pace').dataset.{what}"));
    reported.as_str().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}

#[test]
fn two_thousand_inputs_have_the_programs_bits_and_repeat_by_their_script() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    module(&mut browser, "arch_carotid.toml", 64);
    let mut dice = Dice(1);
    let inputs: Vec<Input> = (0..2000).map(|_| dice.input()).collect();
    let (mut session, _) = native::session("arch_carotid.toml", 64);
    for input in &inputs {
        let _ = session.apply(input);
        session.tick();
    }
    let carried_out = format!(
        "for (const input of {}) {{ try {{ session.apply(input); }} catch {{}} session.tick(); }}",
        serde_json::to_string(&inputs).unwrap()
    );
    browser.eval(&carried_out);
    let steps = browser.eval("session.readout().step");
    assert_eq!(steps, session.steps(), "steps");
    let expected = native::bits(session.simulation());
    assert!(expected.len() > 20);
    let script = browser.eval("session.script()");
    assert_eq!(script, session.script().as_str());
    assert_eq!(bits(&mut browser, "session.positions()"), expected);
    assert_eq!(native::bits(&native::run("arch_carotid.toml", script.as_str().unwrap())), expected);
    // The twin: another tick is another place.
    browser.eval("session.apply({ do: 'move', mm_per_s: -10 }); session.tick()");
    assert_ne!(bits(&mut browser, "session.positions()"), expected);
}

#[test]
fn pictures_are_those_of_the_program() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    module(&mut browser, "arch_vertebral.toml", 128);
    let (mut session, mut pictures) = native::session("arch_vertebral.toml", 128);
    let inputs = [
        json!({ "do": "nudge", "mm": 60.0 }),
        json!({ "do": "pedal", "down": true, "mode": "cine" }),
        json!({ "do": "turn_c_arm", "lao_deg": 15.0 }),
        json!({ "do": "zoom", "factor": 1.5 }),
    ];
    for input in &inputs {
        session.apply(&serde_json::from_value(input.clone()).unwrap()).unwrap();
    }
    (0..60).for_each(|_| session.tick());
    browser.eval(&format!("for (const input of {}) session.apply(input);", json!(inputs)));
    browser.eval("for (let tick = 0; tick < 60; tick++) session.tick();");
    let snapshot = session.snapshot();
    let native = [
        native::rgb(&pictures.fluoro(&snapshot).unwrap()[0]),
        native::rgb(&pictures.three_d(&snapshot).unwrap()),
    ];
    for (expression, expected) in ["session.fluoro()[0]", "session.threeD()"].into_iter().zip(native) {
        let reported =
            browser.eval(&format!("[...({expression}).data].filter((_, k) => k % 4 < 3).join(' ')"));
        let seen: Vec<u8> = reported.as_str().unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
        assert_eq!(seen.len(), expected.len());
        let apart = seen.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(apart.unwrap() <= 2, "{expression}: {apart:?} of 255");
        if expression.contains("fluoro") {
            assert_eq!(apart, Some(0), "the same physics");
        }
        let spread = expected.iter().max().unwrap() - expected.iter().min().unwrap();
        assert!(spread > 100, "there is something to see: {spread}");
    }
}

#[test]
fn pictures_by_webgpu_are_those_of_the_reference() {
    let _alone = alone();
    let Some(mut browser) = with_webgpu("arch_carotid.toml", 192) else { return };
    let reported = browser.eval(
        "(async () => {
            const { Graphics } = await import('./pkg/endowire.js');
            const sharp = async (session, graphics) => {
                if (graphics) session.useGraphics(graphics);
                session.apply({ do: 'pedal', down: true });
                for (let frame = 0; frame < 5; frame++) session.fluoroSoon();
                session.sharpen();
                const done = () => session.backend() === (graphics?.name ?? 'CPU reference');
                while (!done()) {
                    await new Promise((resolve) => setTimeout(resolve, 20));
                    session.fluoroSoon();
                }
                return session.fluoroSoon()[0];
            };
            // A quantum more or less is no difference of the rays.
            const still = (text) => text.replace('[view.xray]', '[view.detector]\\nnoise = false\\n[view.xray]');
            const graphics = await Graphics.open();
            const grey = ({ data }) => data.filter((_, k) => k % 4 === 0);
            const turned = opened(still);
            turned.apply({ do: 'turn_c_arm', lao_deg: 1 });
            const [first, second, other] =
                [await sharp(opened(still), null), await sharp(opened(still), graphics), await sharp(turned, graphics)].map(grey);
            const apart = (picture) => Math.max(...first.map((value, k) => Math.abs(value - picture[k])));
            const range = Math.max(...first) - Math.min(...first);
            return [graphics.name, apart(second), range, apart(other)];
        })()",
    );
    assert_eq!(reported[0], "WebGPU");
    let [most, range, other] = [1, 2, 3].map(|k| reported[k].as_f64().unwrap());
    eprintln!("fluoroscopy by WebGPU: at most {most} of 255 apart at any pixel");
    assert!(most <= 2.0 && range > 100.0, "{reported}");
    assert!(other > 2.0, "another place must differ: {reported}");
    browser.eval("document.getElementById('lock').click()");
    // The page takes what is quicker for all of them, and says what that is: here software imitates a graphics processor.
    browser
        .wait("/^pictures by (WebGPU|CPU reference)$/.test(document.getElementById('backend').textContent)");
    let backend = browser.eval("document.getElementById('backend').textContent");
    eprintln!("the page tells {backend}");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_wire_goes_into_the_carotid_by_keys_at_pace() {
    let _alone = alone();
    let begun = Instant::now();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait("document.readyState === 'complete'");
    browser.wait(
        "document.querySelector('#three canvas').getContext('2d').getImageData(192, 300, 1, 1).data[3] > 0",
    );
    let first_s = begun.elapsed().as_secs_f64();
    let instrument = "document.querySelector('.instrument').textContent";
    let inserted = format!("Number({instrument}.match(/([\\d.]+) mm in/)[1])");
    let turned = format!("Number({instrument}.match(/(-?\\d+)°/)[1])");
    browser.key("Enter", true);
    browser.key("Enter", false);
    // As the scene's script does it, by hand.
    for (code, until) in [
        ("ArrowRight", format!("{turned} >= 197")),
        ("ArrowUp", format!("{inserted} >= 239")),
        ("ArrowRight", format!("{turned} >= 347")),
        ("ArrowUp", format!("{inserted} >= 284")),
    ] {
        browser.key(code, true);
        browser.wait(&until);
        browser.key(code, false);
    }
    let [ticks, frames, input_ms, mib] =
        ["ticks", "frames", "inputMs", "mib"].map(|what| pace(&mut browser, what));
    eprintln!(
        "first picture {first_s:.2} s after the browser was started, {ticks:.0} ticks/s, {frames:.0} frames/s of 384², {input_ms:.0} ms from an \
         input to its picture, {mib:.0} MiB"
    );
    browser.wait("document.querySelector('#told').textContent.startsWith('step')");
    // Until the device has followed its hands.
    let step = "(async () => (await import('./screen.js')).readout.step)()";
    while {
        let before = browser.eval(step);
        std::thread::sleep(std::time::Duration::from_millis(500));
        browser.eval(step) != before
    } {}
    let ask = "await (await import('./simulator.js')).ask";
    let script = browser.eval(&format!("(async () => {ask}('script'))()"));
    let tip = bits(&mut browser, &format!("{ask}('positions')"));
    let run = native::run("arch_carotid.toml", script.as_str().unwrap());
    assert_eq!(native::bits(&run), tip, "what a browser has recorded repeats to the bit");
    let tip_mm = run.shape().tip_mm().unwrap();
    let carotid = native::scene("arch_carotid.toml").1;
    let tree = carotid.centreline(&endowire_core::vessel::NoStore).unwrap();
    let target = tree.targets().iter().find(|target| target.name.contains("carotid")).unwrap();
    let way = tree.path_to(target.row).unwrap();
    let near = way.nearest(&tip_mm);
    // Beyond the arch.
    let inside = near.distance_mm < near.radius_mm && near.arc_mm > 0.7 * way.length_mm();
    assert!(
        inside,
        "the tip at {tip_mm:?} is no place in {}: {near:?} of {} mm",
        target.name,
        way.length_mm()
    );
    assert!(browser.console.is_empty(), "{:?}", browser.console);
    // Half of the pace that the page keeps on two idle cores: this machine may be shared.
    assert!(
        ticks > 30.0 && frames > 8.0 && mib < 600.0,
        "{ticks} ticks, {frames} frames a second, {mib} MiB"
    );
}

#[test]
fn five_thousand_random_inputs_break_nothing() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_friction.toml", LAPTOP) else { return };
    module(&mut browser, "curved_tube_friction.toml", 64);
    let mut dice = Dice(7);
    let inputs: Vec<Value> = (0..5000).map(|_| dice.wild()).collect();
    let reported = browser.eval(&format!(
        "(() => {{
            let refused = 0;
            for (const [number, input] of {}.entries()) {{
                try {{ session.apply(input); }} catch (error) {{
                    if (!(error instanceof Error) || error instanceof WebAssembly.RuntimeError) throw error;
                    refused += 1;
                }}
                session.tick();
                if (number % 50 === 0) {{ session.fluoroSoon(); session.threeD(); }}
            }}
            return [refused, session.readout().step];
        }})()",
        json!(inputs)
    ));
    let refused = reported[0].as_u64().unwrap();
    assert!((500..4500).contains(&refused) && reported[1].as_u64().unwrap() > 50, "{reported}");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

/// Drops a file of this name, whose bytes an expression gives, on the page.
fn drop_file(browser: &mut Browser, name: &str, bytes: &str) {
    browser.eval(&format!(
        "(async () => {{
            const transfer = new DataTransfer();
            transfer.items.add(new File([{bytes}], '{name}'));
            dispatchEvent(new DragEvent('drop', {{ dataTransfer: transfer, cancelable: true }}));
        }})()"
    ));
}

#[test]
fn a_dropped_surface_is_entered_and_other_files_are_refused_as_by_the_core() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", PHONE) else { return };
    browser.wait(READY);
    let tube = "await (await fetch('assets/vessels/curved_tube.stl')).arrayBuffer()";
    drop_file(&mut browser, "tube.stl", tube);
    browser.wait("document.querySelectorAll('.picture button').length === 2");
    assert_eq!(browser.eval("document.getElementById('opening').textContent"), "0");
    browser.eval(
        "[...document.querySelectorAll('.picture button')].find((one) => one.textContent === '1').click()",
    );
    assert_eq!(browser.eval("document.getElementById('opening').textContent"), "1");
    browser.eval("document.getElementById('vessel-go').click()");
    browser.wait("!document.querySelector('dialog[open]') && document.title === 'endowire: own'");
    drop_file(&mut browser, "broken.stl", &format!("({tube}).slice(0, 200)"));
    browser.wait("document.getElementById('vessel-error').textContent.startsWith('broken.stl: ') && \
                  document.getElementById('vessel-go').disabled && !document.getElementById('vessel-error').textContent.endsWith('…')");
    browser.eval("document.getElementById('vessel-dialog').close()");
    drop_file(&mut browser, "scene.toml", "'[vessel]\\ntreee = 1'");
    browser.wait("document.getElementById('told').textContent.includes('did you mean `tree`?')");
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}

#[test]
fn a_link_carries_scene_and_script_and_a_hidden_page_stands_still() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("#scene=scenes/curved_tube_exact.toml", PHONE) else { return };
    browser.wait(READY);
    browser.key("ArrowUp", true);
    browser.wait("document.querySelector('.instrument').textContent.match(/([\\d.]+) mm in/)[1] > 8");
    browser.key("ArrowUp", false);
    browser.eval("document.getElementById('share').click()");
    browser.wait("location.hash.startsWith('#s=')");
    let ask = "await (await import('./simulator.js')).ask";
    let expected = bits(&mut browser, &format!("{ask}('positions')"));
    let fragment = browser.eval("location.hash").as_str().unwrap().to_owned();
    let Some(mut other) = Browser::open(&fragment, LAPTOP) else { return };
    other.wait(READY);
    other.wait("document.getElementById('told').textContent.includes('at its end')");
    assert_eq!(bits(&mut other, &format!("{ask}('positions')")), expected);
    // Nothing goes by while nobody looks, and hands let go.
    other.key("ArrowDown", true);
    other.eval("Object.defineProperty(document, 'hidden', { value: true, configurable: true }); document.dispatchEvent(new Event('visibilitychange'))");
    std::thread::sleep(std::time::Duration::from_millis(200));
    let before = bits(&mut other, &format!("{ask}('positions')"));
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert_eq!(bits(&mut other, &format!("{ask}('positions')")), before);
    other.eval("delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))");
    let metrics = json!({ "width": 500, "height": 400, "deviceScaleFactor": 1, "mobile": false });
    other.call("Emulation.setDeviceMetricsOverride", &metrics);
    other.key("KeyI", true);
    other.wait("document.getElementById('told').textContent.length > 0");
    assert!(other.console.is_empty(), "{:?}", other.console);
}

#[test]
fn nothing_but_the_pages_own_files_is_asked_for() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait(READY);
    let address = browser.address.clone();
    let asked = browser.eval("performance.getEntriesByType('resource').map((one) => one.name)");
    let asked = asked.as_array().unwrap();
    assert!(asked.len() > 8, "{asked:?}");
    assert!(asked.iter().all(|url| url.as_str().unwrap().starts_with(&address)), "{asked:?}");
    // The twin: the browser refuses what would leave the page.
    let left = browser.eval("fetch('http://127.0.0.1:9/').then(() => 'sent', (error) => error.name)");
    assert_eq!(left, "TypeError");
    assert!(
        browser.console.iter().any(|text| text.contains("Content Security Policy")),
        "{:?}",
        browser.console
    );
}

#[test]
fn it_works_without_a_network_once_it_was_loaded() {
    let _alone = alone();
    let Some(mut browser) = Browser::open("", LAPTOP) else { return };
    browser.wait(READY);
    browser
        .wait("navigator.serviceWorker.getRegistration().then((one) => one?.active?.state === 'activated')");
    browser.cut_off();
    browser.eval("location.hash = '#scene=scenes/hepatic_breathing.toml'");
    browser.wait("document.title === 'endowire: hepatic_breathing'");
    browser.eval("window.before = true");
    browser.call("Page.reload", &json!({}));
    browser.wait(&format!("!window.before && document.title === 'endowire: hepatic_breathing' && {READY}"));
    // The twin: what the page does not have is not there.
    assert_eq!(browser.eval("fetch('other.txt').then((answer) => answer.ok, () => 'none')"), "none");
}
