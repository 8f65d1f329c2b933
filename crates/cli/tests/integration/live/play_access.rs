//! Accessibility of the page of `cohaptic play`: for people with low vision, without a mouse, disturbed by motion, with a gamepad or on a phone.

use std::thread::sleep;
use std::time::Duration;

use serde_json::json;

use super::browser::chromium::Browser;
use super::play_page::{cube, end, millimetres, open, release};
use super::session::Session;
use crate::integration::desk::Desk;

pub(super) fn key(browser: &mut Browser, kind: &str, key: &str, code: u32) {
    browser.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code }));
}

pub(super) fn emulate(browser: &mut Browser, feature: &str, value: &str) {
    browser.call("Emulation.setEmulatedMedia", json!({ "features": [{ "name": feature, "value": value }] }));
}

/// Goes on with the Tab key until what is chosen has the focus. What has the focus on the way is seen to have it.
pub(super) fn tab_to(browser: &mut Browser, selector: &str) {
    for _ in 0..60 {
        browser.press("Tab", 9);
        let outlined = "(() => { const style = getComputedStyle(document.activeElement); return document.activeElement === document.body || \
                        (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2); })()";
        assert_eq!(browser.value(outlined), json!(true), "{}", browser.value("document.activeElement.outerHTML"));
        if browser.value(&format!("document.activeElement.matches({selector:?})")) == json!(true) {
            return;
        }
    }
    panic!("{selector} is not reached by Tab");
}

/// Moves the hand to one side by keys until it has gone far enough for a step, and lets go.
fn swing(browser: &mut Browser, arrow: &str, code: u32) {
    tab_to(browser, "#rooms");
    key(browser, "rawKeyDown", arrow, code);
    sleep(Duration::from_secs(2));
    key(browser, "keyUp", arrow, code);
    assert_eq!(browser.value("document.getElementById('grasp').textContent"), json!("Let go"));
    browser.press("Escape", 27);
    assert_eq!(browser.value("document.getElementById('grasp').textContent"), json!("Take hold"));
}

/// The first minute of somebody who has no mouse: the three steps, and a comparison.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn three_steps_and_a_comparison_by_keys_alone() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    open(&mut browser, &mut session);
    let step = |number: usize| format!("document.querySelectorAll('#steps li')[{}].getAttribute('aria-current') === 'step'", number - 1);
    browser.wait_for("step 1 is done", |browser| {
        swing(browser, "ArrowRight", 39);
        browser.value(&step(2)) == json!(true)
    });
    tab_to(&mut browser, "#steps li.now button");
    browser.press("Enter", 13);
    browser.wait("document.getElementById('answer').textContent.includes('delay 100ms on every link')");
    for (number, arrow, code) in [(2, "ArrowLeft", 37), (3, "ArrowRight", 39)] {
        if number == 3 {
            tab_to(&mut browser, "#steps li.now button");
            browser.press("Enter", 13);
            browser.wait("document.getElementById('law-now').textContent === 'PD, 3 peers'");
        }
        let shown = step(number);
        browser.wait_for(&format!("step {number} is done"), |browser| {
            swing(browser, arrow, code);
            sleep(Duration::from_secs(4));
            browser.value(&format!("!({shown})")) == json!(true)
        });
    }
    browser.wait("!document.getElementById('answered').hidden");
    tab_to(&mut browser, "#compare");
    browser.press("Enter", 13);
    browser.wait("document.querySelectorAll('#runs tr').length === 3 && !document.getElementById('curves').hidden");
    for selector in ["#law-other", "#fewer", "#more", "#slider-delay", "#slider-jitter", "#slider-loss", "#slider-rate", "#get-scene", "#copy"] {
        tab_to(&mut browser, selector);
    }
    tab_to(&mut browser, "input[name=law]");
    browser.press("ArrowUp", 38);
    browser.wait("document.getElementById('law-now').textContent === 'AP, 3 peers'");
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_finger_on_a_phone_will_do_and_every_control_has_a_name() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    open(&mut browser, &mut session);
    browser.value("document.querySelector('details').open = true");
    assert!(every_control_has_a_name(&mut browser) > 15);
    let phone = json!({ "width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": true });
    browser.call("Emulation.setDeviceMetricsOverride", phone);
    browser.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": true }));
    browser.wait("document.documentElement.scrollWidth <= innerWidth");
    browser.picture("play-phone");
    // The step that is next and the whole of the picture are on the screen at first.
    let seen = "['#steps li.now', '#rooms'].every((selector) => { const r = document.querySelector(selector).getBoundingClientRect(); return r.top >= 0 && r.bottom <= innerHeight; })";
    assert_eq!(browser.value(seen), json!(true));
    let middle = browser
        .value("(() => { const r = document.getElementById('rooms').getBoundingClientRect(); return [r.x + r.width / 2, r.y + 0.3 * r.height]; })()");
    let (x, y) = (middle[0].as_f64().unwrap(), middle[1].as_f64().unwrap());
    let before = millimetres(&mut browser, 0);
    browser.call("Input.dispatchTouchEvent", json!({ "type": "touchStart", "touchPoints": [{ "x": x, "y": y }] }));
    for step in 1..=10 {
        browser.call("Input.dispatchTouchEvent", json!({ "type": "touchMove", "touchPoints": [{ "x": x - 8.0 * f64::from(step), "y": y }] }));
    }
    browser.wait_for("the own copy goes to the left", |browser| millimetres(browser, 0) < before - 5.0);
    browser.call("Input.dispatchTouchEvent", json!({ "type": "touchEnd", "touchPoints": [] }));
    browser.wait("document.getElementById('grasp').textContent === 'Take hold'");
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// Checks that every control has a name for screen readers, and returns the number of controls.
pub(super) fn every_control_has_a_name(browser: &mut Browser) -> usize {
    browser.call("Accessibility.enable", json!({}));
    let tree = browser.call("Accessibility.getFullAXTree", json!({}));
    let operated = ["button", "slider", "radio", "combobox", "textbox", "checkbox", "link", "application", "DisclosureTriangle"];
    let (mut named, mut nameless) = (0, Vec::new());
    for node in tree["nodes"].as_array().unwrap() {
        let role = node["role"]["value"].as_str().unwrap_or_default();
        if node["ignored"] == json!(true) || !operated.contains(&role) {
            continue;
        }
        if node["name"]["value"].as_str().unwrap_or_default().trim().is_empty() {
            nameless.push(node.to_string());
        }
        named += 1;
    }
    assert!(nameless.is_empty(), "{named}, without a name {nameless:#?}");
    named
}

/// The texts that have too little contrast with their ground, by computed styles; 4.5:1 is asked for. First how many were looked at.
pub(super) const CONTRAST: &str = "(() => {
    const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
    const opaque = (colour) => colour.length < 4 || colour[3] === 1;
    const groundOf = (node) => {
        for (let at = node; at; at = at.parentElement) {
            const colour = numbers(getComputedStyle(at).backgroundColor);
            if (opaque(colour)) return colour;
        }
        return [255, 255, 255];
    };
    const linear = (channel) => (channel <= 0.04045 ? channel / 12.92 : ((channel + 0.055) / 1.055) ** 2.4);
    const luminance = ([red, green, blue]) => 0.2126 * linear(red / 255) + 0.7152 * linear(green / 255) + 0.0722 * linear(blue / 255);
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const found = [0];
    while (texts.nextNode()) {
        const node = texts.currentNode.parentElement;
        if (!texts.currentNode.data.trim() || !node.checkVisibility() || node.closest(':disabled, option')) continue;
        found[0] += 1;
        const [one, other] = [numbers(getComputedStyle(node).color), groundOf(node)].map(luminance).sort((a, b) => b - a);
        const ratio = (one + 0.05) / (other + 0.05);
        if (ratio < 4.5) found.push(texts.currentNode.data.trim() + ' has ' + ratio.toFixed(2));
    }
    return found;
})()";

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn texts_have_contrast_on_light_and_on_dark_ground() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    open(&mut browser, &mut session);
    browser.value("document.querySelector('details').open = true");
    let from = cube(&mut browser);
    browser.drag(from, [60.0, 0.0], 8);
    release(&mut browser);
    browser.click("#compare");
    browser.wait("!document.getElementById('curves').hidden");
    let mut seen = Vec::new();
    for scheme in ["light", "dark"] {
        emulate(&mut browser, "prefers-color-scheme", scheme);
        for held in [false, true] {
            browser.click("#grasp");
            let found = browser.value(CONTRAST);
            let found = found.as_array().unwrap();
            assert!(found[0].as_u64() > Some(50) && found.len() == 1, "{scheme}, held {held}: {found:#?}");
        }
        seen.push(browser.value("getComputedStyle(document.body).backgroundColor"));
        browser.picture(&format!("play-{scheme}"));
    }
    assert_ne!(seen[0], seen[1], "two schemes were seen");
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// Returns whether the picture of the rooms changes in half a second.
fn moves(browser: &mut Browser) -> bool {
    let picture = "document.getElementById('rooms').toDataURL()";
    let before = browser.value(picture);
    sleep(Duration::from_millis(500));
    browser.value(picture) != before
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn with_reduced_motion_nothing_flies_and_the_hand_still_moves() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    open(&mut browser, &mut session);
    browser.value("document.querySelector('details').open = true");
    browser.wait_for("dots fly", moves);
    emulate(&mut browser, "prefers-reduced-motion", "reduce");
    browser.wait_for("nothing flies", |browser| !moves(browser));
    let from = cube(&mut browser);
    browser.drag(from, [90.0, 0.0], 10);
    browser.wait_for("the own copy goes to the right", |browser| millimetres(browser, 0) > 5.0);
    release(&mut browser);
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// Script that replaces the gamepad and the vibration motor of the browser by ones that record the calls of the page.
const FAKED: &str = "
    window.pulses = [];
    window.vibrations = [];
    const playEffect = (kind, how) => { window.pulses.push({ kind, ...how }); return Promise.resolve('complete'); };
    window.pad = { connected: true, axes: [0, 0, 0, 0], buttons: [], vibrationActuator: { playEffect } };
    Object.defineProperty(navigator, 'getGamepads', { value: () => [null, window.pad] });
    Object.defineProperty(navigator, 'vibrate', { value: (ms) => { window.vibrations.push(ms); return true; } });
";

/// The gamepad is simulated, because the test machines have none. The page reads it and drives its motors by the Gamepad API.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_stick_moves_the_hand_and_motors_give_its_force() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    browser.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": FAKED }));
    open(&mut browser, &mut session);
    browser.value("document.querySelector('details').open = true");
    let count = |browser: &mut Browser, what: &str| browser.value(&format!("{what}.length")).as_u64().unwrap();
    // A stick that nobody touches rests anywhere near its middle.
    browser.value("pad.axes = [0.1, -0.1, 1, 1]");
    sleep(Duration::from_millis(300));
    assert_eq!(browser.value("document.getElementById('grasp').textContent"), json!("Take hold"));
    browser.value("pad.axes = [1, 0]");
    browser.wait_for("the own copy goes to the right", |browser| millimetres(browser, 0) > 10.0);
    assert_eq!(browser.value("document.getElementById('grasp').textContent"), json!("Let go"));
    browser.wait("pulses.length > 3");
    browser.value("pad.axes = [0, -1]");
    let up = "parseFloat(document.querySelector('#peers tr').cells[2].textContent.split(',')[1].replace('\\u2212', '-')) > 10";
    browser.wait(up);
    let strengths = browser.value("pulses.map(({ kind, strongMagnitude, weakMagnitude, duration }) => kind === 'dual-rumble' && strongMagnitude >= 0.05 && strongMagnitude <= 1 && weakMagnitude <= strongMagnitude && duration > 0 && duration <= 200)");
    assert!(strengths.as_array().unwrap().iter().all(|valid| *valid == json!(true)), "{}", browser.value("pulses"));
    assert_eq!(count(&mut browser, "vibrations"), 0, "no phone was touched");
    browser.value("pad.axes = [0, 0]");
    browser.click("#grasp");
    let after = count(&mut browser, "pulses");
    sleep(Duration::from_millis(300));
    assert_eq!(count(&mut browser, "pulses"), after, "nobody holds it");
    browser.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": true }));
    let [x, y] = cube(&mut browser);
    browser.call("Input.dispatchTouchEvent", json!({ "type": "touchStart", "touchPoints": [{ "x": x, "y": y }] }));
    browser.wait_for("the phone vibrates", |browser| {
        for side in [60.0, -60.0] {
            browser.call("Input.dispatchTouchEvent", json!({ "type": "touchMove", "touchPoints": [{ "x": x + side, "y": y }] }));
            sleep(Duration::from_millis(100));
        }
        count(browser, "vibrations") > 2
    });
    assert_eq!(browser.value("vibrations.every((ms) => Number.isInteger(ms) && ms > 0 && ms <= 60)"), json!(true), "{}", browser.value("vibrations"));
    emulate(&mut browser, "prefers-reduced-motion", "reduce");
    sleep(Duration::from_millis(100));
    let still = (count(&mut browser, "pulses"), count(&mut browser, "vibrations"));
    browser.call("Input.dispatchTouchEvent", json!({ "type": "touchMove", "touchPoints": [{ "x": x + 90.0, "y": y }] }));
    sleep(Duration::from_millis(300));
    assert_eq!((count(&mut browser, "pulses"), count(&mut browser, "vibrations")), still, "with reduced motion nothing pulses");
    browser.call("Input.dispatchTouchEvent", json!({ "type": "touchEnd", "touchPoints": [] }));
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// A tray that turns, from a scene without a pointer: the visitor gets the hand of the first peer, and lifts a corner.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn an_object_that_turns_is_held_by_its_corner() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, &crate::integration::desk::shipped("rigid/tray.toml").display().to_string());
    let url = session.told("open ");
    assert!(session.told("the pointer of the page ").contains("hand of north-east"));
    let control = super::http::Control::at(&url);
    browser.open(&url);
    browser.wait("document.getElementById('law-now').textContent === 'AP, 4 peers' && document.querySelectorAll('#peers tr').length === 4");
    assert_eq!(browser.value("document.getElementById('guide').hidden"), json!(true), "the three steps speak of another scene");
    let turned = |peer: usize| {
        let state = control.state();
        let q: Vec<f64> = state["peers"][peer]["orientation"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        (2.0 * (q[1] * q[2] + q[0] * q[3])).atan2(1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]))
    };
    let from = cube(&mut browser);
    browser.wait_for("every copy turns about z", |browser| {
        browser.drag(from, [0.0, -160.0], 15);
        sleep(Duration::from_millis(500));
        let all = (0..4).all(|peer| turned(peer) > 0.02);
        if all {
            browser.picture("play-tray");
        }
        release(browser);
        all
    });
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}
