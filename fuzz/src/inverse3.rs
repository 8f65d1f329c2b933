//! Messages of Haply's service: a client that is told anything sends only JSON, and only forces that its gate admits.

use std::time::Duration;

use cohaptic_device::{Gate, Limits, Moment, Stopper};
use cohaptic_inverse3::client::{Action, Client, ClientConfig, Phase};
use cohaptic_inverse3::protocol::{Event, Format, Reply, Request, Version};
use cohaptic_units::Instant;

use crate::Input;

/// Largest force of the client \[N\].
const LIMIT: f64 = 2.0;
/// Greatest change of a force \[N/s\].
const SLEW: f64 = 1000.0;

/// A client and the time.
struct Desk {
    client: Client,
    gate: Gate,
    now: Instant,
    /// Latest force along the axes of a scene \[N\], and its instant.
    sent: ([f64; 3], Instant),
}

impl Desk {
    fn pass(&mut self, until: Instant) {
        while let Some(at) = self.client.poll_timeout().filter(|at| *at <= until) {
            self.now = self.now.max(at);
            self.client.handle_timeout(self.now);
            self.act();
        }
        self.now = until;
    }

    /// Carries out the actions of the client. A connection is opened at once.
    fn act(&mut self) {
        while let Some(action) = self.client.poll_action(self.now) {
            match action {
                Action::Connect => self.client.connected(self.now, Some(Version { major: 3, minor: 5 })),
                Action::Close => self.sent.0 = [0.0; 3],
                Action::Send(text) => self.check(&text),
            }
        }
    }

    fn check(&mut self, text: &str) {
        serde_json::from_str::<serde_json::Value>(text).expect("JSON");
        let request = Request::read(text, Format::V35).expect("a message");
        // A question for the list of devices has no force, and no gate.
        let Some(force) = request.force.map(cohaptic_inverse3::to_scene) else { return };
        let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        assert!(length(force) <= LIMIT * (1.0 + 1e-9), "{text}");
        if force == [0.0; 3] {
            self.sent = (force, self.now);
            return;
        }
        assert_eq!(self.client.snapshot(self.now).phase, Phase::Active, "{text}");
        let passed = self.now.saturating_duration_since(self.sent.1).as_secs_f64();
        let change = length([0, 1, 2].map(|axis| force[axis] - self.sent.0[axis]));
        assert!(change <= SLEW * passed + 1e-9, "{change} N in {passed} s: {text}");
        self.sent = (force, self.now);
    }
}

/// The bytes are lines. The first byte of a line says what happens: `t` lets time pass, `h` is a force of the session, `e` an event, `x` the end of the
/// connection. Any other line is a text of the service.
pub fn run(data: &[u8]) {
    let config = ClientConfig { arming_time: Duration::ZERO, limits: Limits { force: LIMIT, slew: SLEW, ..Limits::DEFAULT }, ..ClientConfig::DEFAULT };
    let stopper = Stopper::default();
    let client = Client::new(config, stopper.clone()).expect("a configuration");
    let gate = Gate::new(Limits { force: 20.0, slew: 1e6, ..Limits::DEFAULT }, Stopper::default()).expect("limits");
    let mut desk = Desk { client, gate, now: Instant::ZERO, sent: ([0.0; 3], Instant::ZERO) };
    desk.act();
    for line in data.split(|byte| *byte == b'\n') {
        let mut input = Input::new(line);
        match input.byte() {
            b't' => desk.pass(desk.now + Duration::from_micros(u64::from(input.word()))),
            b'h' => {
                let wanted = [0; 3].map(|_| f64::from(input.byte().cast_signed()) * 0.1);
                let now = desk.now;
                let moment = Moment { now, ready: true, armed: true, reading_at: Some(now), setpoint_at: Some(now) };
                let admitted = desk.gate.admit(wanted, &moment);
                desk.client.hold(now, admitted.force);
            }
            b'e' => {
                if let Some(event) = Event::read(&String::from_utf8_lossy(input.rest())) {
                    assert_eq!(Event::read(&event.write()), Some(event.clone()));
                    desk.client.receive_event(desk.now, &event);
                }
            }
            b'x' => desk.client.closed(desk.now),
            _ => {
                let text = String::from_utf8_lossy(line);
                let _ = (Reply::read(&text), Request::read(&text, Format::V31), Version::of_response(&text));
                desk.client.receive(desk.now, &text);
            }
        }
        desk.act();
    }
    // A stop sends zero force after any input.
    desk.client.stop(desk.now);
    desk.act();
    desk.pass(desk.now + Duration::from_millis(60));
    assert!(desk.client.is_over());
    assert_eq!(desk.client.snapshot(desk.now).force, [0.0; 3]);
}
