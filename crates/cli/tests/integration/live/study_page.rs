//! The pages of `cohaptic study` in real browsers of a phone's size: two people go through a whole study by the keyboard alone, over a crash of the server.

use serde_json::json;

use super::browser::chromium::Browser;
use super::http::Control;
use super::play_access::{CONTRAST, emulate, every_control_has_a_name, key, tab_to};
use super::session::Session;
use super::study::{COMMAND, SCENE, desk, with_fault};
use super::wait_for;

const WIDTH: u32 = 360;

/// A person at a browser.
struct Person {
    browser: Browser,
    name: &'static str,
    /// Pages on which the look of the page was checked.
    seen: Vec<String>,
    /// `true` if the page is to be hidden for a moment in the next trial.
    hides: bool,
    is_pulling: bool,
}

impl Person {
    fn at(url: &str, name: &'static str, hides: bool) -> Option<Self> {
        let mut browser = Browser::start()?;
        browser.call("Emulation.setDeviceMetricsOverride", json!({ "width": WIDTH, "height": 740, "deviceScaleFactor": 1, "mobile": true }));
        browser.open(url);
        Some(Self { browser, name, seen: Vec::new(), hides, is_pulling: false })
    }

    /// Returns the heading of the page, without numbers of trials.
    fn page(&mut self) -> String {
        let heading =
            "document.getElementById('trial').hidden ? document.getElementById('words-title').textContent.replace(/ \\d.*/, '') : 'under way'";
        self.browser.value(heading).as_str().unwrap().to_owned()
    }

    /// Does by keys what the page asks for, if anything. Returns whether the study is over.
    fn go_on(&mut self) -> bool {
        let page = self.page();
        if self.is_pulling && page != "under way" {
            key(&mut self.browser, "keyUp", "ArrowRight", 39);
            self.is_pulling = false;
        }
        if !self.seen.contains(&page) {
            self.look(&page);
            self.seen.push(page.clone());
        }
        match page.as_str() {
            "under way" => self.pull(),
            "Questions" => self.answer(),
            "Thank you" => return true,
            _ => self.press_first(),
        }
        false
    }

    /// Asserts that the page needs no scrolling sideways, every text can be read on light and on dark ground, and every control has a name.
    fn look(&mut self, page: &str) {
        assert_eq!(self.browser.value("document.documentElement.scrollWidth"), json!(WIDTH), "{page}");
        for scheme in ["dark", "light"] {
            emulate(&mut self.browser, "prefers-color-scheme", scheme);
            let found = self.browser.value(CONTRAST);
            assert!(found.as_array().is_some_and(|found| found.len() == 1 && found[0].as_u64() > Some(4)), "{page}, {scheme}: {found:#?}");
        }
        every_control_has_a_name(&mut self.browser);
        self.browser.picture(&format!("study-{}-{}", self.name, page.replace(' ', "-").to_lowercase()));
    }

    /// Presses the first button of the page.
    fn press_first(&mut self) {
        const FIRST: &str = "#buttons button:first-child";
        if self.browser.value(&format!("document.querySelector('{FIRST}:enabled') !== null")) != json!(true) {
            return;
        }
        if self.browser.value(&format!("document.activeElement.matches('{FIRST}')")) != json!(true) {
            tab_to(&mut self.browser, FIRST);
        }
        self.browser.press("Enter", 13);
    }

    fn pull(&mut self) {
        if self.is_pulling {
            return;
        }
        // The trial may be over already: a page of the other person was hidden.
        self.browser.wait("document.activeElement.id === 'rooms' || document.getElementById('trial').hidden");
        if std::mem::take(&mut self.hides) {
            // A page in a browser of this kind cannot be covered, so that the page is told.
            let tell = "document.dispatchEvent(new Event('visibilitychange'))";
            self.browser.value(&format!("Object.defineProperty(document, 'hidden', {{ value: true, configurable: true }}); {tell}"));
            self.browser.value(&format!("delete document.hidden; {tell}"));
        }
        // The object appears with the first picture. Keys before are for nothing.
        self.browser.wait("!document.getElementById('task').hidden || document.getElementById('trial').hidden");
        key(&mut self.browser, "rawKeyDown", "ArrowRight", 39);
        self.is_pulling = true;
    }

    /// Sends the answers too early, is shown what is missing, and answers all.
    fn answer(&mut self) {
        // A page with further questions may follow at once.
        const ASKED: &str = "((input) => input && input.id + input.name)(document.querySelector('#questions input'))";
        let asked = self.browser.value(ASKED);
        let open = self.browser.value("document.querySelectorAll('#questions input[type=range]').length").as_u64().unwrap();
        self.press_first();
        self.browser.wait("document.getElementById('note').textContent.startsWith('Please answer this too') || document.querySelectorAll('#questions input').length === 0");
        assert_eq!(
            self.browser.value("document.activeElement.type"),
            json!(if open > 0 { "range" } else { "radio" }),
            "the first that is missing has the focus"
        );
        for scale in 0..open {
            if scale > 0 {
                self.browser.press("Tab", 9);
            }
            // One step to the right on every scale but the second, whose middle is the answer.
            if scale == 1 { self.browser.press("Enter", 13) } else { self.browser.press("ArrowRight", 39) }
        }
        if open == 0 {
            self.browser.press("ArrowRight", 39);
        }
        let missing = "document.querySelectorAll('#questions .missing').length === 0";
        self.browser.wait(missing);
        tab_to(&mut self.browser, "#buttons button");
        self.browser.press("Enter", 13);
        self.browser.wait(&format!("{ASKED} !== {asked}"));
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn two_people_go_through_a_study_on_phones_by_keys_alone() {
    let desk = desk();
    // Keys move the hand at 120 mm/s, and the object has to stay for 100 ms.
    desk.write("scene.toml", SCENE.replace("radius = 0.01", "radius = 0.02"));
    let mut session = Session::study(&desk, COMMAND);
    let url = session.told("experimenter: ");
    let Some(mut first) = Person::at(&session.told("P01: "), "first", true) else { return };
    let Some(mut second) = Person::at(&session.told("P02: "), "second", false) else { return };
    let Some(mut experimenter) = Browser::start() else { return };
    experimenter.call("Emulation.setDeviceMetricsOverride", json!({ "width": WIDTH, "height": 740, "deviceScaleFactor": 1, "mobile": true }));
    experimenter.open(&url);
    experimenter.wait("document.querySelectorAll('#people tr').length === 2 && document.getElementById('group').textContent === 'G01'");
    let kept = |desk: &crate::integration::desk::Desk, trial: &str| desk.path(&format!("data/trials/{trial}/trial.json")).exists();
    while !kept(&desk, "G01-001") {
        first.go_on();
        // The trial must not be over before a page was hidden in it.
        if !(first.hides && second.page() == "under way") {
            second.go_on();
        }
    }
    experimenter.wait("document.getElementById('last').textContent.includes('not valid: a page was hidden')");
    assert_eq!(experimenter.value("document.documentElement.scrollWidth"), json!(WIDTH));
    experimenter.picture("study-experimenter");
    let found = experimenter.value(CONTRAST);
    assert!(found.as_array().is_some_and(|found| found.len() == 1), "{found:#?}");
    every_control_has_a_name(&mut experimenter);
    session.kill();
    let lost = "!document.getElementById('trouble').hidden && document.getElementById('server').textContent === 'disconnected'";
    first.browser.wait(lost);
    experimenter.wait(lost);
    let session = Session::study(&desk, COMMAND);
    first.browser.wait("document.getElementById('trouble').hidden && document.getElementById('server').textContent === 'connected'");
    let mut are_done = [false, false];
    wait_for("the end of the study", || {
        are_done = [first.go_on(), second.go_on()];
        (are_done == [true, true]).then_some(())
    });
    with_fault(&desk, "hidden-page");
    for person in [&first, &second] {
        for page in ["Your code", "Consent", "What to do", "Trial", "under way", "Questions", "Thank you"] {
            assert!(person.seen.iter().any(|seen| seen == page), "{page}: {:?}", person.seen);
        }
        // Messages of the browser about the server that was gone are expected.
        let complaints: Vec<&String> = person.browser.complaints.iter().filter(|complaint| !complaint.contains("ERR_CONNECTION_REFUSED")).collect();
        assert_eq!(complaints, [""; 0]);
    }
    // The experimenter ends the study by keys.
    experimenter.wait("document.getElementById('next').textContent === 'End the study' && !document.getElementById('next').disabled");
    tab_to(&mut experimenter, "#next");
    experimenter.press("Enter", 13);
    assert_eq!(session.outcome().status, Some(0));
    desk.text("study verify data");
    let host = Control::at(&url);
    assert!(std::net::TcpStream::connect(&host.host).is_err(), "the server has ended");
}
