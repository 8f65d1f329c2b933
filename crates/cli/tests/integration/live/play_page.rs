//! The page of `cohaptic play` in a real browser: somebody drags, the copies follow through the links, and a lost connection comes back.

use serde_json::{Value, json};

use super::browser::chromium::Browser;
use super::http::Control;
use super::records::trajectory;
use super::session::Session;
use crate::integration::desk::Desk;

/// The middle of the own room, where the cube is.
pub(super) fn cube(browser: &mut Browser) -> [f64; 2] {
    let at = browser.value(
        "(() => { const r = document.getElementById('rooms').getBoundingClientRect(); return [r.x + 0.31 * r.width, r.y + r.height / 2]; })()",
    );
    [at[0].as_f64().unwrap(), at[1].as_f64().unwrap()]
}

pub(super) fn open(browser: &mut Browser, session: &mut Session) -> Control {
    let url = session.told("open ");
    browser.open(&url);
    browser.wait("document.getElementById('server').textContent === 'connected'");
    browser.wait("document.getElementById('law-now').textContent === 'AP, 3 peers'");
    // The numbers as text come four times a second.
    browser.wait("document.querySelectorAll('#peers tr').length === 3");
    Control::at(&url)
}

pub(super) fn end(session: Session) {
    session.interrupt();
    assert_eq!(session.outcome().status, Some(130));
}

pub(super) fn release(browser: &mut Browser) {
    browser.call("Input.dispatchMouseEvent", json!({ "type": "mouseReleased", "x": 5, "y": 5, "button": "left", "clickCount": 1 }));
}

pub(super) fn millimetres(browser: &mut Browser, peer: usize) -> f64 {
    let text = browser.value(&format!("document.querySelectorAll('#peers tr')[{peer}].cells[2].textContent"));
    text.as_str().unwrap().replace('\u{2212}', "-").split(',').next().unwrap().parse().unwrap()
}

/// The first minute of somebody who has read nothing: drags, raises the delay, changes to PD, and compares.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn somebody_drags_takes_three_steps_and_compares() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    open(&mut browser, &mut session);
    browser.value("document.querySelector('details').open = true");
    for step in 1..=3 {
        let shown = format!("document.querySelectorAll('#steps li')[{}].getAttribute('aria-current') === 'step'", step - 1);
        browser.wait(&shown);
        if step > 1 {
            browser.click(&format!("#steps li:nth-child({step}) button"));
        }
        browser.wait_for(&format!("step {step} is done"), |browser| {
            let from = cube(browser);
            browser.drag(from, [90.0, -20.0], 12);
            let from = [from[0] + 90.0, from[1] - 20.0];
            browser.drag(from, [-90.0, 20.0], 12);
            release(browser);
            assert_eq!(browser.value("document.getElementById('grasp').textContent"), json!("Take hold"), "the end of a press lets go");
            if step > 1 {
                // The copies are left to themselves for a while.
                std::thread::sleep(std::time::Duration::from_secs(4));
            }
            browser.value(&format!("!({shown})")) == json!(true)
        });
        browser.picture(&format!("play-step-{step}"));
    }
    browser.wait("!document.getElementById('answered').hidden && document.getElementById('why').textContent.includes('100 ms ago')");
    browser.wait("document.getElementById('law-now').textContent === 'PD, 3 peers'");
    browser.wait("document.querySelector('input[name=law]:checked').value === 'proportional-derivative'");
    browser.click("#compare");
    browser.wait("document.querySelectorAll('#runs tr').length === 3 && !document.getElementById('curves').hidden");
    browser.wait("document.getElementById('runs').textContent.includes('without network')");
    browser.picture("play-compared");
    browser.click("#more");
    browser.wait("document.getElementById('law-now').textContent === 'PD, 4 peers'");
    // What has swung up under PD comes to rest under AP.
    browser.click("#back");
    browser.wait("document.getElementById('law-now').textContent === 'AP, 4 peers'");
    browser.value("document.querySelector('details').open = true");
    browser.wait("[...document.querySelectorAll('#peers tr')].every((row) => parseFloat(row.cells[3].textContent) < 0.1)");
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// On a phone one step is shown at a time, with its own number, and a session that is late says so in a sentence on the page.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_phone_shows_the_number_of_the_step_and_why_a_session_is_not_valid() {
    let Some(mut browser) = Browser::start() else { return };
    browser.call("Emulation.setDeviceMetricsOverride", json!({ "width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": true }));
    let desk = Desk::new();
    // A tick within a nanosecond of its instant is a rare chance, on any machine.
    let mut session = Session::play(&desk, "--tolerance 1ns");
    open(&mut browser, &mut session);
    browser.wait("document.getElementById('valid').textContent === 'not valid' && !document.getElementById('late').hidden");
    let why = browser.value("document.getElementById('late').textContent").to_string();
    for part in ["ticks of the simulation", " were more than 1ns late", "Close other programs"] {
        assert!(why.contains(part), "no {part:?} in {why}");
    }
    let visible = "[...document.querySelectorAll('#steps li')].filter((item) => item.offsetHeight > 0).map((item) => item.value)";
    assert_eq!(browser.value(visible), json!([1]));
    browser.click("#sway");
    browser.wait(&format!("JSON.stringify({visible}) === '[2]'"));
    assert_eq!(browser.value("document.documentElement.scrollWidth"), json!(390), "nothing is scrolled sideways");
    browser.picture("play-phone");
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}

/// The other copies begin to move when the first sample with a motion in it has arrived: one delay after the own copy, and at most a period of sending and a
/// tick later.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn the_copies_follow_with_the_delay_that_was_set() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "--out played");
    let control = open(&mut browser, &mut session);
    browser.value("document.getElementById('slider-delay').focus()");
    browser.wait_for("the slider stands at 70 ms", |browser| {
        browser.press("ArrowRight", 39);
        browser.value("document.getElementById('slider-delay').getAttribute('aria-valuetext') === '70ms'") == json!(true)
    });
    browser.wait("document.getElementById('answer').textContent.includes('delay 70ms on every link')");
    browser.click("#record");
    browser.wait_for("part 2", |_| control.get("/api/play")["part"] == 2);
    browser.value("document.querySelector('details').open = true");
    let from = cube(&mut browser);
    browser.drag(from, [120.0, 0.0], 15);
    browser.wait_for("all copies come along", |browser| (0..3).all(|peer| millimetres(browser, peer) > 5.0));
    release(&mut browser);
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
    desk.text("run played/part-2/scene.toml --inputs played/part-2/inputs.csv --out again");
    let ticks = trajectory(&desk, "again");
    let first = |peer: &str| ticks[peer].iter().find(|tick| tick.xo.abs() > 1e-9).unwrap().at;
    let (own, second, third) = (first("you"), first("second"), first("third"));
    for other in [second, third] {
        let later = other - own;
        assert!((70_000_000..=80_000_000).contains(&later), "{later} ns later");
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_lost_connection_is_shown_and_comes_back() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    desk.write("token", "a-token-of-our-own-0123456789\n");
    desk.set_mode("token", 0o600);
    let mut session = Session::play(&desk, "--control 127.0.0.1:0 --token-file token");
    let control = open(&mut browser, &mut session);
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
    browser.wait("document.getElementById('server').textContent === 'disconnected'");
    browser.wait("document.getElementById('trouble').textContent.includes('does not answer')");
    let again = Session::play(&desk, &format!("--control {} --token-file token", control.host));
    browser.wait("document.getElementById('server').textContent === 'connected' && document.getElementById('trouble').hidden");
    let from = cube(&mut browser);
    browser.drag(from, [60.0, 0.0], 8);
    browser.wait_for("it is held", |_| control.get("/api/state")["peers"][0]["status"] == "present");
    end(again);
}

/// A measurement, not a test: ten peers and ninety links, the hand in motion. Prints pictures a second, and what the page takes of a core.
#[test]
#[expect(clippy::print_stdout, reason = "a measurement prints")]
#[ignore = "a measurement of half a minute: cargo test -p cohaptic-cli --test integration play_page -- --ignored --nocapture"]
fn measure_pictures_a_second_with_ten_peers() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let mut session = Session::play(&desk, "");
    let control = open(&mut browser, &mut session);
    assert_eq!(control.ask("POST", "/api/play", r#"{"peers": 10}"#).0, 200);
    browser.wait("document.getElementById('law-now').textContent === 'AP, 10 peers'");
    browser.click("#sway");
    std::thread::sleep(std::time::Duration::from_secs(3));
    browser.call("Performance.enable", json!({ "timeDomain": "threadTicks" }));
    let measure = "new Promise((resolve) => { const at = []; requestAnimationFrame(function next(now) { at.push(now); if (now < at[0] + 10000) requestAnimationFrame(next); else resolve(at); }); })";
    let metric = |metrics: &Value, name: &str| {
        metrics["metrics"].as_array().unwrap().iter().find(|metric| metric["name"] == name).unwrap()["value"].as_f64().unwrap()
    };
    let before = browser.call("Performance.getMetrics", json!({}));
    let times: Vec<f64> = browser.value(measure).as_array().unwrap().iter().map(|at| at.as_f64().unwrap()).collect();
    let after = browser.call("Performance.getMetrics", json!({}));
    let mut gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let seconds = (times[times.len() - 1] - times[0]) / 1e3;
    let busy = metric(&after, "TaskDuration") - metric(&before, "TaskDuration");
    let script = metric(&after, "ScriptDuration") - metric(&before, "ScriptDuration");
    #[expect(clippy::cast_precision_loss, reason = "some hundred pictures")]
    let rate = gaps.len() as f64 / seconds;
    println!("{rate:.1} pictures a second; the longest {:.1} ms, p99 {:.1} ms", gaps[gaps.len() - 1], gaps[gaps.len() * 99 / 100]);
    println!("the page's thread takes {:.1} % of a core, {:.1} % in scripts", 100.0 * busy / seconds, 100.0 * script / seconds);
    let state = control.state();
    println!(
        "links {}, valid {}, {}; ticks {}",
        state["links"].as_array().unwrap().len(),
        state["valid"],
        state["invalid"],
        state["clocks"][0]["lateness"]
    );
    browser.picture("play-ten");
    end(session);
}

/// The page says what to do, how much time is left, and how it ended, and draws the target where the second one lies.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_task_is_asked_for_shown_and_judged() {
    let Some(mut browser) = Browser::start() else { return };
    let desk = Desk::new();
    let task = "\n[task]\nkind = \"reach\"\ntargets = [[0.0, 0.0], [0.1, 0.08]]\nradius = 0.02\nstart = \"6s\"\ndwell = \"2s\"\ntimeout = \"5s\"\n";
    desk.write(
        "task.toml",
        format!("{}{task}", include_str!("../../../scenarios/live/play.toml").replace("duration = \"3s\"", "duration = \"30s\"")),
    );
    let mut session = Session::play(&desk, "task.toml");
    open(&mut browser, &mut session);
    let says = |text: &str| format!("document.getElementById('task-what').textContent === '{text}'");
    browser.wait(&says("Soon: Move the cube to target 1 of 2"));
    browser.wait("document.getElementById('task-left').textContent.startsWith('begins in ')");
    browser.wait(&says("Move the cube to target 1 of 2"));
    browser.wait("document.getElementById('task-left').textContent.endsWith(' s left')");
    browser.wait(&says("Move the cube to target 2 of 2"));
    browser.picture("play-task");
    browser.wait(&says("The time is over, 1 of 2 targets reached"));
    assert_eq!(browser.value("document.getElementById('task-left').textContent"), json!(""));
    assert_eq!(browser.complaints, [""; 0]);
    end(session);
}
