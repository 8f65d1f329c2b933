//! The page in a real browser: what a person sees and does.

mod chromium;

use chromium::Browser;
use serde_json::json;

use crate::run::{Run, TOKEN};

/// Counts the pixels of a canvas near a colour of the page.
fn painted(browser: &mut Browser, canvas: &str, colour: &str) -> u64 {
    let script = format!(
        "(() => {{
            const canvas = document.getElementById({canvas:?});
            if (!canvas.width) return 0;
            const probe = document.createElement('canvas').getContext('2d');
            probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue({colour:?}).trim();
            probe.fillRect(0, 0, 1, 1);
            const wanted = probe.getImageData(0, 0, 1, 1).data;
            const points = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
            let found = 0;
            for (let i = 0; i < points.length; i += 4)
                if (points[i + 3] > 100 && [0, 1, 2].every((k) => Math.abs(points[i + k] - wanted[k]) < 24)) found += 1;
            return found;
        }})()"
    );
    browser.value(&script).as_u64().unwrap()
}

fn wait_painted(browser: &mut Browser, canvas: &str, colour: &str) {
    browser.wait_for(&format!("{canvas} has something in {colour}"), |browser| painted(browser, canvas, colour) > 20);
}

/// Waits until the picture of a canvas changes.
fn wait_moving(browser: &mut Browser, canvas: &str) {
    let picture = format!("document.getElementById({canvas:?}).toDataURL()");
    let before = browser.value(&picture);
    browser.wait_for(&format!("{canvas} moves"), |browser| browser.value(&picture) != before);
}

fn wait_told(browser: &mut Browser, run: &Run, links: &[usize], key: &str, value: &str) {
    let wanted = (links.to_vec(), vec![(key.to_owned(), value.to_owned())]);
    browser.wait_for(&format!("the editor was told {wanted:?}"), |_| run.told.lock().unwrap().last() == Some(&wanted));
}

fn text(browser: &mut Browser, selector: &str) -> String {
    browser.value(&format!("document.querySelector({selector:?}).innerText")).as_str().unwrap().to_owned()
}

fn in_dark(browser: &mut Browser, dark: bool) {
    let scheme = if dark { "dark" } else { "light" };
    browser.call("Emulation.setEmulatedMedia", json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] }));
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_person_sees_the_run_and_changes_it() {
    let Some(mut browser) = Browser::start() else { return };
    let run = Run::moving(6, 3, 1, 0);
    browser.open(&run.server().url());
    sees_the_run(&mut browser);
    moves_a_slider(&mut browser, &run);
    types_a_value(&mut browser, &run);
    sets_another_key_of_all_links(&mut browser, &run);
    is_told_what_was_wrong(&mut browser);
    browser.picture("light");
    in_dark(&mut browser, true);
    wait_painted(&mut browser, "delay-plot", "--c0");
    browser.picture("dark");
    assert_eq!(browser.complaints, [""; 0]);
    reloads(&mut browser);
    assert!(browser.complaints.iter().all(|complaint| complaint.contains("401")), "{:?}", browser.complaints);
    survives_the_server(browser, run);
}

fn sees_the_run(browser: &mut Browser) {
    browser.wait("document.querySelectorAll('#links tr').length === 6");
    let address = browser.value("location.href").to_string();
    assert!(!address.contains("token"), "{address}: the token does not stay in the address");
    browser.wait("document.querySelector('#links tr .delivered').textContent.length > 0");
    browser.wait("document.querySelector('#links tr .asked').textContent.includes('delay 24ms')");
    assert!(text(browser, "#links tr").contains("left → right"));
    // Names appear as text even if they contain HTML.
    assert_eq!(text(browser, "h1"), "cohaptic live three people lift a <b>cube</b>");
    assert_eq!(text(browser, "#valid"), "valid");
    browser.wait("document.querySelector('#peers .pill.stale').textContent === 'stale · heard 2.3 s ago'");
    browser.wait("document.querySelectorAll('#clocks tr').length === 2");
    browser.wait("document.getElementById('refused').textContent.includes('wrong-magic')");
    browser.wait("document.getElementById('drops').textContent.includes('queue-full')");
    browser.wait("document.getElementById('measures').textContent === 'energy_j0.25 Jtravel_sno value'");
    for canvas in ["delay-plot", "loss-plot", "rate-plot"] {
        wait_painted(browser, canvas, "--c0");
        wait_painted(browser, canvas, "--c5");
        wait_moving(browser, canvas);
    }
    for colour in ["--c0", "--c1", "--c2"] {
        wait_painted(browser, "copies", colour);
    }
    wait_moving(browser, "copies");
}

fn moves_a_slider(browser: &mut Browser, run: &Run) {
    browser.wait("document.getElementById('field-delay').value === '24ms'");
    browser.value("document.getElementById('slider-delay').focus()");
    for _ in 0..3 {
        browser.press("ArrowRight", 39);
    }
    wait_told(browser, run, &[0], "delay", "\"27ms\"");
    browser.wait("document.querySelector('#links tr .asked').textContent.includes('delay 27ms')");
    // The list of links can be used with the keyboard.
    browser.value("document.getElementById('link-0').focus()");
    browser.press("ArrowDown", 40);
    browser.wait("document.getElementById('link-1').checked && document.getElementById('field-delay').value === '25ms'");
    browser.click("#slider-loss");
    browser.wait_for("a click on the slider", |_| {
        run.told.lock().unwrap().last().is_some_and(|(links, keys)| links == &[1] && keys[0].0 == "loss" && keys[0].1.ends_with("%\""))
    });
}

fn types_a_value(browser: &mut Browser, run: &Run) {
    browser.type_into("#field-rate", "1.2Mbit");
    browser.press("Enter", 13);
    wait_told(browser, run, &[1], "rate", "\"1.2Mbit\"");
    browser.wait("document.getElementById('answer').textContent.includes('rate = 1.2Mbit')");
}

fn sets_another_key_of_all_links(browser: &mut Browser, run: &Run) {
    browser.click("#all");
    browser.wait("document.getElementById('target').textContent === 'all 6 links'");
    browser.type_into("#other-key", "duplicate");
    browser.type_into("#other-value", "{ probability = 0.01, correlation = 0.5 }");
    browser.click("#other-set");
    wait_told(browser, run, &[0, 1, 2, 3, 4, 5], "duplicate", "{ correlation = 0.5, probability = 0.01 }");
    browser.wait("[...document.querySelectorAll('#links .asked')].every((cell) => cell.textContent.includes('duplicate'))");
}

fn is_told_what_was_wrong(browser: &mut Browser) {
    browser.type_into("#other-key", "dlay");
    browser.press("Enter", 13);
    browser.wait("document.getElementById('answer').textContent.includes('did you mean \"delay\"?')");
    assert_eq!(browser.value("document.getElementById('other-key').value"), json!("dlay"), "to be mended");
    // The browser's message about the answer 422 is expected.
    browser.complaints.retain(|complaint| !complaint.contains("422"));
}

/// Reloads without the token in the address: the page takes the token from the tab's storage.
fn reloads(browser: &mut Browser) {
    browser.value("document.getElementById('links').replaceChildren()");
    browser.call("Page.reload", json!({}));
    browser.wait("document.querySelectorAll('#links tr').length === 6");
    assert!(!browser.value("location.href").to_string().contains("token"));
}

fn survives_the_server(mut browser: Browser, run: Run) {
    browser.wait("document.querySelector('#links tr .delivered').textContent.length > 0");
    browser.type_into("#other-value", "half a thou");
    let port = run.stop();
    browser.wait("document.getElementById('trouble').textContent.startsWith('The server does not answer')");
    browser.wait("document.getElementById('server').textContent === 'disconnected'");
    assert_eq!(browser.value("document.querySelectorAll('#links tr').length"), json!(6), "what was known is still shown");
    browser.picture("away");
    let _again = Run::moving(6, 3, 1, port);
    browser.wait("document.getElementById('trouble').hidden && document.getElementById('server').textContent === 'connected'");
    wait_moving(&mut browser, "copies");
    assert_eq!(browser.value("document.getElementById('other-value').value"), json!("half a thou"));
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_hundred_links_are_as_good_as_six() {
    let Some(mut browser) = Browser::start() else { return };
    let run = Run::moving(100, 4, 2, 0);
    in_dark(&mut browser, false);
    browser.open(&run.server().url());
    browser.wait("document.querySelectorAll('#links tr').length === 100");
    wait_painted(&mut browser, "copies", "--c3");
    wait_moving(&mut browser, "copies");
    browser.type_into("#filter", "robot → ");
    browser.wait("[...document.querySelectorAll('#links tr')].filter((row) => !row.hidden).length === 10");
    browser.click("#links tr:not([hidden])");
    browser.wait("document.getElementById('target').textContent === 'robot → left'");
    for canvas in ["delay-plot", "loss-plot", "rate-plot"] {
        wait_painted(&mut browser, canvas, "--accent");
    }
    browser.picture("hundred");
    assert_eq!(browser.complaints, [""; 0]);
}

/// Returns width and height of the drawing in the first peer's colour \[px\].
fn drawn(browser: &mut Browser) -> [f64; 2] {
    let script = "(() => {
        const canvas = document.getElementById('copies');
        const probe = document.createElement('canvas').getContext('2d');
        probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--c0').trim();
        probe.fillRect(0, 0, 1, 1);
        const wanted = probe.getImageData(0, 0, 1, 1).data;
        const { data, width } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const seen = [[], []];
        for (let i = 0; i < data.length; i += 4)
            if ([0, 1, 2, 3].every((k) => Math.abs(data[i + k] - wanted[k]) < 24)) [(i / 4) % width, Math.floor(i / 4 / width)].forEach((at, k) => seen[k].push(at));
        return seen.map((at) => at.reduce((most, value) => Math.max(most, value), 0) - at.reduce((least, value) => Math.min(least, value), 1e9) + 1);
    })()";
    let sides = browser.value(script);
    [0, 1].map(|side| sides[side].as_f64().unwrap())
}

/// Sets a slider to an angle by the keys for the slider.
fn look_from(browser: &mut Browser, slider: &str, degrees: i64) {
    browser.value(&format!("document.getElementById({slider:?}).focus()"));
    let now = browser.value(&format!("Number(document.getElementById({slider:?}).value)")).as_i64().unwrap();
    let (key, code) = if degrees < now { ("ArrowLeft", 37) } else { ("ArrowRight", 39) };
    while browser.value(&format!("document.getElementById({slider:?}).value")) != json!(degrees.to_string()) {
        browser.press(key, code);
    }
    // Waits for two frames: the first begins after the key, and the second ends the drawing of the first.
    browser.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))");
}

/// Draws a plate of 0.4 m × 0.3 m from above, from the front and from the side, before and after a quarter turn about z. Lines are 1.8 px wide and fade at
/// their edges. The depth of the plate, 3 % of its length, is needed to see the plate from the side, and changes the scale of the nearer face by 0.4 %.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn an_object_that_turns_is_drawn_in_depth() {
    let Some(mut browser) = Browser::start() else { return };
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let still = json!([{ "name": "prefers-color-scheme", "value": "light" }, { "name": "prefers-reduced-motion", "value": "reduce" }]);
    browser.call("Emulation.setEmulatedMedia", json!({ "features": still }));
    let as_it_is = (Run::turned([1.0, 0.0, 0.0, 0.0]), "0.0, 0.0, 0.0°", [0.4, 0.3]);
    let by_a_quarter = (Run::turned([half, 0.0, 0.0, half]), "0.0, 0.0, 90.0°", [0.3, 0.4]);
    for (run, told, [x, y]) in [&as_it_is, &by_a_quarter] {
        browser.open(&run.server().url());
        wait_painted(&mut browser, "copies", "--c0");
        assert_eq!(text(&mut browser, "#peers td:nth-of-type(3)"), *told);
        look_from(&mut browser, "around", 0);
        look_from(&mut browser, "above", 90);
        let [across, up] = drawn(&mut browser);
        let scale = across / x;
        assert!(across > 80.0 && (up / scale - y).abs() < 0.03 * y, "{across} x {up}");
        browser.picture("turned");
        look_from(&mut browser, "above", 0);
        let front = drawn(&mut browser);
        look_from(&mut browser, "around", 90);
        let side = drawn(&mut browser);
        // From the front the nearer edge is half a plate nearer than the middle, seen from a distance of five radii of 0.29 m: larger by up to 0.2 m in 1.4 m.
        assert!((front[0] / scale / x - 1.0).abs() < 0.2 && front[1] < 0.15 * front[0], "{front:?}");
        assert!((side[0] / scale / y - 1.0).abs() < 0.2 && side[1] < 0.15 * side[0], "{side:?}");
        assert!((side[0] > front[0]) == (y > x), "{front:?} {side:?}");
    }
    assert_eq!(browser.complaints, [""; 0]);
}

/// Opens the address without the token: the page asks for the token, and asks again after a wrong token.
fn enters_the_token(browser: &mut Browser, run: &Run) {
    browser.value("sessionStorage.clear()");
    browser.open(&format!("http://{}/", run.server().address()));
    for (token, then) in
        [("not the token", "document.getElementById('token').value === ''"), (TOKEN, "document.querySelectorAll('#links tr').length === 1")]
    {
        browser.wait("document.getElementById('token')");
        browser.picture("door");
        browser.type_into("#token", token);
        browser.press("Enter", 13);
        browser.wait(then);
    }
    browser.complaints.retain(|complaint| !complaint.contains("401"));
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn one_link_without_peers_is_enough() {
    let Some(mut browser) = Browser::start() else { return };
    let run = Run::moving(1, 0, 0, 0);
    browser.open(&run.server().url());
    wait_painted(&mut browser, "delay-plot", "--c0");
    assert_eq!(browser.value("document.getElementById('people').hidden"), json!(true));
    browser.picture("one");
    enters_the_token(&mut browser, &run);
    assert_eq!(browser.complaints, [""; 0]);
    // The page tells a run without new snapshots from a run in progress.
    let silent = Run::still(1, 0);
    browser.open(&silent.server().url());
    browser.wait("document.getElementById('trouble').textContent.startsWith('The run has reported nothing')");
    browser.wait("document.getElementById('server').textContent === 'connected'");
    assert_eq!(browser.complaints, [""; 0]);
}
