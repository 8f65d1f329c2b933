use cohaptic_device::{Limits, Moment};

use super::*;
use crate::protocol::Request;

fn at(milliseconds: u64) -> Instant {
    Instant::from_nanos(1_000_000 * milliseconds)
}

/// A reply with these devices at rest at the origin, each with this configuration.
fn reply(ids: &[&str], config: &str) -> String {
    let zero = r#"{"x":0,"y":0,"z":0}"#;
    let status = r#"{"calibrated":true,"ready":true,"power_supply":true}"#;
    let device = |id: &&str| {
        format!(
            r#"{{"device_id":"{id}",{config}"state":{{"cursor_position":{zero},"cursor_velocity":{zero},"current_cursor_force":{zero}}},"status":{status}}}"#
        )
    };
    format!(r#"{{"session_id":1,"inverse3":[{}]}}"#, ids.iter().map(device).collect::<Vec<_>>().join(","))
}

const CENTRED: &str = r#""config":{"preset":"arm_front_centered","basis":{"permutation":"XYZ"},"mount":{}},"#;
const UNCENTRED: &str = r#""config":{"preset":"arm_front","basis":{"permutation":"XYZ"},"mount":{}},"#;
const V35: Option<Version> = Some(Version { major: 3, minor: 5 });
const V31: Option<Version> = Some(Version { major: 3, minor: 1 });

fn client(config: ClientConfig) -> Client {
    Client::new(config, Stopper::default()).unwrap()
}

/// Returns a connected client that has received the inventory.
fn connected(config: ClientConfig, version: Option<Version>, ids: &[&str], config_of_device: &str) -> Client {
    let mut client = client(config);
    assert_eq!(client.poll_action(at(0)), Some(Action::Connect));
    client.connected(at(0), version);
    client.receive(at(1), &reply(ids, config_of_device));
    client
}

/// Returns the texts that the client sends.
fn sent(client: &mut Client, now: Instant) -> Vec<String> {
    core::iter::from_fn(|| client.poll_action(now)).filter_map(|action| if let Action::Send(text) = action { Some(text) } else { None }).collect()
}

fn request(client: &mut Client, now: Instant, format: Format) -> Request {
    let texts = sent(client, now);
    assert_eq!(texts.len(), 1, "{texts:?}");
    Request::read(&texts[0], format).unwrap()
}

/// A force of a gate that lets everything pass.
fn force(force: Triple) -> GatedForce {
    let mut gate = Gate::new(Limits { force: 20.0, slew: 1e6, ..Limits::DEFAULT }, Stopper::default()).unwrap();
    let moment = |ms| Moment { now: at(ms), ready: true, armed: true, reading_at: Some(at(ms)), setpoint_at: Some(at(ms)) };
    gate.admit([0.0; 3], &moment(0));
    gate.admit(force, &moment(1)).force
}

/// Answers each message at once, for a message each millisecond from `from` to before `until`.
fn exchange(client: &mut Client, from: u64, until: u64, wanted: Triple) {
    for ms in from..until {
        client.hold(at(ms), force(wanted));
        assert_eq!(sent(client, at(ms)).len(), 1, "{ms}");
        client.receive(at(ms), &reply(&["04C3"], ""));
    }
}

#[test]
fn the_first_message_asks_for_the_middle_and_for_the_configuration() {
    let mut client = connected(ClientConfig::DEFAULT, V35, &["04C3"], UNCENTRED);
    let first = request(&mut client, at(1), Format::V35);
    assert_eq!(first, Request { device: Some("04C3".to_owned()), force: Some([0.0; 3]), centred: true, full: true });
    // The origin is not known before the preset is read back.
    client.receive(at(2), &reply(&["04C3"], ""));
    assert_eq!(client.snapshot(at(2)).reading, None);
    client.hold(at(2), GatedForce::ZERO);
    assert!(request(&mut client, at(2), Format::V35).centred);
    client.receive(at(3), &reply(&["04C3"], CENTRED));
    client.hold(at(3), GatedForce::ZERO);
    assert!(!request(&mut client, at(3), Format::V35).full);
    client.receive(at(4), &reply(&["04C3"], ""));
    assert!(client.snapshot(at(4)).reading.is_some());
    assert_eq!(client.snapshot(at(4)).phase, Phase::Disarmed);
}

#[test]
fn forces_go_out_after_arming_and_wait_for_the_reply() {
    let mut client = connected(ClientConfig::DEFAULT, V35, &["04C3"], CENTRED);
    sent(&mut client, at(1));
    client.receive(at(2), &reply(&["04C3"], CENTRED));
    exchange(&mut client, 3, 202, [0.0, 0.0, 1.0]);
    assert_eq!((client.snapshot(at(201)).phase, client.snapshot(at(201)).force), (Phase::Disarmed, [0.0; 3]));
    exchange(&mut client, 202, 206, [0.0, 0.0, 1.0]);
    assert_eq!((client.snapshot(at(205)).phase, client.snapshot(at(205)).force), (Phase::Active, [0.0, 0.0, 1.0]));
    // A second force waits for the reply to the first, and the newest force goes out then. A scene's z is Haply's −Y.
    client.hold(at(206), force([0.0, 0.0, 1.0]));
    assert_eq!(request(&mut client, at(206), Format::V35).force, Some([0.0, -1.0, 0.0]));
    client.hold(at(207), force([0.0, 0.0, 1.1]));
    client.hold(at(208), force([0.0, 0.0, 1.2]));
    assert!(sent(&mut client, at(208)).is_empty());
    client.receive(at(209), &reply(&["04C3"], ""));
    assert_eq!(request(&mut client, at(209), Format::V35).force, Some([0.0, -1.2, 0.0]));
    // Without a force of the session for 50 ms, zero goes out; a message each 5 ms keeps the readings young.
    let mut last = at(209);
    client.receive(last, &reply(&["04C3"], ""));
    while last < at(262) {
        last = client.poll_timeout().unwrap();
        client.handle_timeout(last);
        assert_eq!(sent(&mut client, last).len(), 1);
        client.receive(last, &reply(&["04C3"], ""));
    }
    assert_eq!((client.snapshot(last).phase, client.snapshot(last).force), (Phase::Active, [0.0; 3]));
}

#[test]
fn without_a_middle_an_origin_is_needed() {
    let refused = |client: &Client| (client.snapshot(at(2000)).phase, client.is_over());
    // A service of 3.1 has no preset.
    let mut old = connected(ClientConfig::DEFAULT, V31, &["04C3"], "");
    assert_eq!(old.refusal(), Some(Refusal::NoPreset(V31)));
    assert!(old.refusal().unwrap().to_string().contains("version 3.1") && old.refusal().unwrap().to_string().contains("inverse3.origin"));
    assert!(request(&mut old, at(1), Format::V31).force.is_some());
    assert_eq!(refused(&old), (Phase::Refused(Refusal::NoPreset(V31)), true));
    // A service of 3.5 gets a second to apply the preset.
    let mut deaf = connected(ClientConfig::DEFAULT, V35, &["04C3"], UNCENTRED);
    sent(&mut deaf, at(1));
    deaf.receive(at(900), &reply(&["04C3"], UNCENTRED));
    assert_eq!(deaf.refusal(), None);
    deaf.hold(at(1001), GatedForce::ZERO);
    sent(&mut deaf, at(1001));
    deaf.receive(at(1001), &reply(&["04C3"], UNCENTRED));
    assert_eq!(deaf.refusal(), Some(Refusal::NoPreset(V35)));
    // With an origin, positions count from there: in Haply's axes 10 mm forward are −10 mm along z.
    let origin = ClientConfig { origin: Some([0.0, -0.01, 0.0]), ..ClientConfig::DEFAULT };
    let mut old = connected(origin, V31, &["04C3"], "");
    assert_eq!(request(&mut old, at(1), Format::V31).force, Some([0.0; 3]));
    old.receive(at(2), &reply(&["04C3"], ""));
    assert_eq!(old.snapshot(at(2)).reading.unwrap().0.position, [0.0, 0.0, -0.01]);
}

#[test]
fn a_chosen_device_is_kept() {
    let second = ClientConfig { which: Which::Place { place: 1, besides: vec!["A".to_owned()] }, ..ClientConfig::DEFAULT };
    let mut client = connected(second, V35, &["A", "B"], CENTRED);
    assert_eq!((client.device(), client.snapshot(at(1)).phase), (None, Phase::NoDevice));
    // A list is asked for again until the device comes.
    assert_eq!(client.poll_timeout(), Some(at(101)));
    client.handle_timeout(at(101));
    assert_eq!(sent(&mut client, at(101)), [Request::INVENTORY.write(Format::V35)]);
    client.receive(at(102), &reply(&["A", "B", "C"], CENTRED));
    assert_eq!(client.device(), Some("C"));
    // The message that waits belongs to the connection.
    client.closed(at(103));
    assert_eq!(client.poll_action(at(352)), None);
    assert_eq!(client.poll_action(at(353)), Some(Action::Connect));
    client.connected(at(353), V35);
    client.receive(at(354), &reply(&["A", "B", "D"], CENTRED));
    assert_eq!(client.snapshot(at(354)).phase, Phase::NoDevice);
    let mut named = connected(ClientConfig { which: Which::Id("B".to_owned()), ..ClientConfig::DEFAULT }, V35, &["A", "B"], CENTRED);
    assert_eq!(request(&mut named, at(1), Format::V35).device.as_deref(), Some("B"));
}

#[test]
fn pauses_before_a_new_connection_double_up_to_four_seconds() {
    let mut client = client(ClientConfig::DEFAULT);
    let mut now = at(0);
    for pause in [250, 500, 1000, 2000, 4000, 4000] {
        assert_eq!(client.poll_action(now), Some(Action::Connect));
        client.closed(now);
        assert_eq!(client.poll_timeout(), Some(now + Duration::from_millis(pause)));
        assert_eq!(client.poll_action(now + Duration::from_millis(pause - 1)), None);
        now += Duration::from_millis(pause);
    }
    // A silent service is left after a second.
    assert_eq!(client.poll_action(now), Some(Action::Connect));
    client.connected(now, V35);
    assert_eq!(client.poll_timeout(), Some(now + SILENCE));
    client.handle_timeout(now + SILENCE);
    assert_eq!(client.poll_action(now + SILENCE), Some(Action::Close));
}

#[test]
fn a_stop_sends_zero_waits_and_closes() {
    let active = || {
        let mut client = connected(ClientConfig::DEFAULT, V35, &["04C3"], CENTRED);
        sent(&mut client, at(1));
        client.receive(at(2), &reply(&["04C3"], CENTRED));
        exchange(&mut client, 3, 206, [0.5, 0.0, 0.0]);
        assert_eq!(client.snapshot(at(205)).force, [0.5, 0.0, 0.0]);
        client.stop(at(206));
        assert_eq!(request(&mut client, at(206), Format::V35).force, Some([0.0; 3]));
        assert!(!client.is_over());
        client
    };
    let mut answered = active();
    answered.receive(at(207), &reply(&["04C3"], ""));
    assert_eq!((answered.poll_action(at(207)), answered.is_over()), (Some(Action::Close), true));
    let mut silent = active();
    assert_eq!(silent.poll_timeout(), Some(at(256)));
    silent.handle_timeout(at(256));
    assert_eq!((silent.poll_action(at(256)), silent.is_over()), (Some(Action::Close), true));
    assert_eq!(silent.snapshot(at(256)).phase, Phase::Stopped);
    // Later calls do nothing.
    silent.hold(at(257), force([1.0; 3]));
    silent.stop(at(257));
    assert_eq!(silent.poll_action(at(10_000)), None);
}

#[test]
fn numbers_out_of_range_are_refused() {
    let refused = |config: ClientConfig| Client::new(config, Stopper::default()).is_err();
    assert!(!refused(ClientConfig { limits: Limits { force: 10.0, ..Limits::DEFAULT }, ..ClientConfig::DEFAULT }));
    assert!(refused(ClientConfig { limits: Limits { force: 10.1, ..Limits::DEFAULT }, ..ClientConfig::DEFAULT }));
    assert!(refused(ClientConfig { origin: Some([0.0, f64::NAN, 0.0]), ..ClientConfig::DEFAULT }));
    assert!(refused(ClientConfig { arming_distance: 1.1, ..ClientConfig::DEFAULT }));
    let slow = ClientConfig::DEFAULT.exchanging(Duration::from_millis(11), None).limits;
    assert_eq!((slow.reading_age, slow.gap), (Duration::from_millis(33), Duration::from_millis(33)));
    let fast = ClientConfig::DEFAULT.exchanging(Duration::from_millis(1), None).limits;
    assert_eq!((fast.reading_age, fast.gap), (Limits::DEFAULT.reading_age, Limits::DEFAULT.gap));
    assert_eq!(
        ClientConfig::DEFAULT.exchanging(Duration::from_millis(1), Some(Duration::from_millis(5))).limits.reading_age,
        Duration::from_millis(5)
    );
}
