//! The page of a real session in a real browser.

#[path = "../../../../control/tests/integration/browser/chromium.rs"]
#[allow(dead_code, reason = "the tests of the page alone do more with it")]
pub(super) mod chromium;

use chromium::Browser;
use serde_json::json;

use super::peer::Peer;
use super::peer_elsewhere::{SCENE, keyless};
use super::session::Session;
use crate::integration::desk::Desk;

/// Waits until the picture of the copies changes, again and again: they move.
fn wait_moving(browser: &mut Browser) {
    for _ in 0..3 {
        let picture = "document.getElementById('copies').toDataURL()";
        let before = browser.value(picture);
        browser.wait_for("the copies move", |browser| browser.value(picture) != before);
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_person_moves_the_slider_of_a_session_and_sees_the_delay_change() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = SCENE.replace("duration = \"1h\"", "title = \"Lifting a box together\", duration = \"1h\"");
    let desk = Desk::with("scene.toml", &scene);
    let mut session = Session::begin(&desk, "scene.toml --json --listen 127.0.0.1:0 --control");
    let peer = Peer::begin(keyless(3), session.address(), 0.0);
    let (url, control) = (session.url(), session.control());
    control.wait_status(1, "present");
    browser.open(&url);
    browser.wait("document.querySelectorAll('#links tr').length === 6 && document.querySelectorAll('#peers tr').length === 3");
    browser.wait("document.querySelector('#links tr .asked').textContent.includes('delay 12ms')");
    assert_eq!(browser.value("document.querySelector('h1').innerText"), json!("cohaptic live Lifting a box together"));
    wait_moving(&mut browser);
    // A scene of one axis is shown along one.
    assert_eq!(control.state()["peers"][0]["position"].as_array().map(Vec::len), Some(1));
    assert_eq!(control.state()["peers"][0]["force"].as_array().map(Vec::len), Some(1));
    let mean = |control: &super::http::Control| control.state()["links"][0]["mean_delay_s"].as_f64().unwrap();
    let median = |control: &super::http::Control| control.state()["links"][0]["recent_delay"]["p50_s"].as_f64().unwrap();
    control.wait("packets", |state| state["links"][0]["delivered"].as_u64() > Some(60));
    let before = mean(&control);
    // Jitter of 6 ms around 12 ms: the mean of more than 60 is within 5 standard errors, 4 ms.
    assert!((before - 0.012).abs() < 0.004, "{before}");
    browser.wait("document.getElementById('field-delay').value === '12ms'");
    browser.value("document.getElementById('slider-delay').focus()");
    // The person holds the key down; the slider goes on in steps of its own.
    browser.wait_for("the slider stands beyond 40 ms", |browser| {
        browser.press("ArrowRight", 39);
        browser.value("parseFloat(document.getElementById('field-delay').value) > 40") == json!(true)
    });
    browser.wait("parseFloat(document.querySelector('#links tr .asked').textContent.split('delay ')[1]) > 40");
    browser.wait_for("the delay has changed", |_| mean(&control) > before + 0.005 && median(&control) > 0.03);
    browser.wait("parseFloat(document.querySelector('#links tr .delay').textContent) > 30");
    assert_eq!(browser.complaints, [""; 0]);
    let position = |t: f64| 0.03 * (3.0 * t).sin();
    let begin = std::time::Instant::now();
    browser.wait_for("a program that moves is seen to move", |_| {
        peer.move_to(position(begin.elapsed().as_secs_f64()));
        control.state()["peers"][1]["position"][0].as_f64().is_some_and(|x| x.abs() > 0.01)
    });
    picture(&mut browser, &peer);
    session.end();
}

/// A picture of it, for the manual, after everything has moved for a while.
fn picture(browser: &mut Browser, peer: &Peer) {
    if std::env::var_os("COHAPTIC_SCREENSHOTS").is_none() {
        return;
    }
    let begin = std::time::Instant::now();
    while begin.elapsed().as_secs_f64() < 20.0 {
        peer.move_to(0.012 * (4.0 * begin.elapsed().as_secs_f64()).sin());
        std::thread::sleep(std::time::Duration::from_millis(4));
    }
    browser.picture("live-control");
}
