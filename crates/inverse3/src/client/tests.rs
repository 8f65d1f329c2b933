use cohaptic_device::{Limits, Moment};

use super::*;
use crate::protocol::{Flaw, Request};

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

/// Returns a client whose device is armed and gives 0.5 N along x. The reply to its latest message came at 205 ms.
fn active() -> Client {
    let mut client = connected(ClientConfig::DEFAULT, V35, &["04C3"], CENTRED);
    sent(&mut client, at(1));
    client.receive(at(2), &reply(&["04C3"], CENTRED));
    exchange(&mut client, 3, 206, [0.5, 0.0, 0.0]);
    assert_eq!((client.snapshot(at(205)).phase, client.snapshot(at(205)).force), (Phase::Active, [0.5, 0.0, 0.0]));
    client
}

#[test]
fn forces_stay_within_the_limit_and_rise_from_zero() {
    let mut client = active();
    client.receive_event(at(206), &Event::Stalled("04C3".to_owned()));
    sent(&mut client, at(206));
    client.receive(at(207), &reply(&["04C3"], ""));
    let forces: Vec<f64> = (208..420)
        .map(|ms| {
            exchange(&mut client, ms, ms + 1, [0.0, 8.0, 0.0]);
            client.snapshot(at(ms)).force[1]
        })
        .collect();
    let first = forces.iter().position(|force| *force != 0.0).unwrap();
    assert!(first >= 199 && forces[first..first + 3] == [1.0, 2.0, 2.0], "{first}: {forces:?}");
    assert_eq!(client.report().largest_force, 2.0);
}

#[test]
fn readings_are_along_the_axes_of_a_scene() {
    let mut client = connected(ClientConfig { origin: Some([0.01, 0.02, 0.03]), ..ClientConfig::DEFAULT }, V35, &["04C3"], CENTRED);
    sent(&mut client, at(1));
    client.receive(at(2), &reply(&["04C3"], CENTRED));
    client.hold(at(2), GatedForce::ZERO);
    let zero = r#"{"x":0,"y":0,"z":0}"#;
    let moved = reply(&["04C3"], "")
        .replace(&format!(r#""cursor_position":{zero}"#), r#""cursor_position":{"x":0.02,"y":0.04,"z":0.06}"#)
        .replace(&format!(r#""cursor_velocity":{zero}"#), r#""cursor_velocity":{"x":1,"y":2,"z":3}"#);
    // Later than a jump: a hand may move by 75 mm in 5 ms.
    client.receive(at(7), &moved);
    // To the right, up, and towards the user.
    let reading = client.snapshot(at(7)).reading.unwrap().0;
    assert!((0..3).all(|axis| (reading.position[axis] - [0.01, 0.03, -0.02][axis]).abs() < 1e-15), "{reading:?}");
    assert_eq!(reading.velocity, [1.0, 3.0, -2.0]);
}

/// After a zero that did not wait for the reply before, only the reply with the configuration counts, which is the reply to the zero.
#[test]
fn a_late_reply_is_not_taken_for_the_reply_to_the_zero() {
    let mut client = active();
    client.hold(at(206), force([0.5, 0.0, 0.0]));
    sent(&mut client, at(206));
    let due = at(216) + Duration::from_nanos(1);
    assert_eq!(client.poll_timeout(), Some(due));
    client.handle_timeout(due);
    let zero = request(&mut client, due, Format::V35);
    assert_eq!((zero.force, zero.full), (Some([0.0; 3]), true));
    assert_eq!((client.snapshot(due).force, client.snapshot(due).for_peer()), ([0.0; 3], None));
    // The late reply, twice: no reading, and no force.
    for ms in [217, 218] {
        client.hold(at(ms), force([0.5, 0.0, 0.0]));
        client.receive(at(ms), &reply(&["04C3"], ""));
        assert!(sent(&mut client, at(ms)).is_empty() && client.snapshot(at(ms)).for_peer().is_none(), "{ms}");
    }
    // The doubt goes on: the reply to the zero is still awaited.
    assert_eq!(client.poll_timeout(), Some(due + LOST));
    client.receive(at(219), &reply(&["04C3"], CENTRED));
    assert_eq!(client.snapshot(at(219)).reading.unwrap().1, due);
    // The force that waited for the reply goes out with it.
    let next = request(&mut client, at(219), Format::V35);
    assert_eq!((next.force, next.full), (Some([0.5, 0.0, 0.0]), false));
    assert_eq!((client.report().older, client.report().unasked), (1, 1));
    // The doubt is over: zero follows after the age of a reading again, and a plain reply counts.
    assert_eq!(client.poll_timeout(), Some(at(229) + Duration::from_nanos(1)));
    client.receive(at(220), &reply(&["04C3"], ""));
    assert_eq!(client.snapshot(at(220)).reading.unwrap().1, at(219));
}

/// After 100 ms without the reply to a zero, no reply is waited for any more, and the next one counts whatever its form.
#[test]
fn replies_that_never_come_are_given_up() {
    let mut client = active();
    client.hold(at(206), force([0.5, 0.0, 0.0]));
    sent(&mut client, at(206));
    let due = at(216) + Duration::from_nanos(1);
    client.handle_timeout(due);
    assert_eq!(sent(&mut client, due).len(), 1);
    let again = due + LOST;
    assert_eq!(client.poll_timeout(), Some(again));
    client.handle_timeout(again);
    let request = request(&mut client, again, Format::V35);
    assert_eq!((request.force, client.report().lost), (Some([0.0; 3]), 2));
    client.receive(again, &reply(&["04C3"], ""));
    assert_eq!(client.snapshot(again).reading.unwrap().1, again);
}

#[test]
fn a_list_without_the_device_gets_a_zero_for_its_id_at_once() {
    let mut client = active();
    client.hold(at(206), force([0.5, 0.0, 0.0]));
    sent(&mut client, at(206));
    client.receive(at(207), &reply(&[], ""));
    let request = request(&mut client, at(207), Format::V35);
    assert_eq!((request.device.as_deref(), request.force), (Some("04C3"), Some([0.0; 3])));
    assert_eq!((client.snapshot(at(207)).phase, client.report().losses), (Phase::NoDevice, 1));
}

/// The zero to a missing device passes no gate. A force after the zero grows from the zero's instant, not from the force before.
#[test]
fn a_device_that_is_back_at_once_gets_a_force_that_grows_from_the_zero() {
    let mut client = connected(ClientConfig { arming_time: Duration::ZERO, ..ClientConfig::DEFAULT }, V35, &["04C3"], CENTRED);
    sent(&mut client, at(1));
    client.receive(at(2), &reply(&["04C3"], CENTRED));
    exchange(&mut client, 3, 10, [0.5, 0.0, 0.0]);
    assert_eq!(client.snapshot(at(9)).force, [0.5, 0.0, 0.0]);
    client.receive(at(10), &reply(&[], ""));
    assert_eq!(request(&mut client, at(10), Format::V35).force, Some([0.0; 3]));
    client.hold(at(10), force([0.5, 0.0, 0.0]));
    client.receive(at(10), &reply(&["04C3"], ""));
    assert_eq!(request(&mut client, at(10), Format::V35).force, Some([0.0; 3]));
    client.hold(at(10), force([0.5, 0.0, 0.0]));
    let later = at(10) + Duration::from_micros(250);
    client.receive(later, &reply(&["04C3"], ""));
    assert_eq!(request(&mut client, later, Format::V35).force, Some([0.25, 0.0, 0.0]));
}

#[test]
fn another_mounting_than_at_the_start_disarms() {
    let mut client = active();
    client.hold(at(206), force([0.5, 0.0, 0.0]));
    sent(&mut client, at(206));
    client.receive(at(207), &reply(&["04C3"], &CENTRED.replace(r#""mount":{}"#, r#""mount":{"preset":"wall"}"#)));
    assert_eq!((client.snapshot(at(207)).phase, client.report().losses), (Phase::Turned, 1));
}

/// A new connection is a new session of the service: the preset is asked for again, and bad replies count from 0.
#[test]
fn a_new_connection_begins_anew() {
    let mut client = active();
    for ms in 206..215 {
        client.hold(at(ms), force([0.5, 0.0, 0.0]));
        sent(&mut client, at(ms));
        client.receive(at(ms), "no JSON");
    }
    client.closed(at(215));
    assert_eq!(client.poll_action(at(465)), Some(Action::Connect));
    client.connected(at(465), V35);
    client.receive(at(466), "no JSON");
    assert_eq!((client.poll_action(at(466)), client.report().connections), (None, 2));
    client.receive(at(467), &reply(&["04C3"], UNCENTRED));
    let first = request(&mut client, at(467), Format::V35);
    assert_eq!((first.centred, first.full, first.force), (true, true, Some([0.0; 3])));
}

#[test]
fn ten_bad_replies_in_a_row_close_the_connection() {
    let mut client = active();
    let bad = |client: &mut Client, ms: u64| {
        client.hold(at(ms), force([0.5, 0.0, 0.0]));
        assert_eq!(sent(client, at(ms)).len(), 1, "{ms}");
        client.receive(at(ms), "no JSON");
    };
    (206..215).for_each(|ms| bad(&mut client, ms));
    // A good reply begins the count anew.
    exchange(&mut client, 215, 216, [0.5, 0.0, 0.0]);
    (216..225).for_each(|ms| bad(&mut client, ms));
    assert_eq!((client.poll_action(at(224)), client.snapshot(at(224)).phase), (None, Phase::Active));
    bad(&mut client, 225);
    // Zero goes out before the close: else the device would keep the force until it idles.
    let Some(Action::Send(text)) = client.poll_action(at(225)) else { panic!("no zero") };
    assert_eq!(Request::read(&text, Format::V35).unwrap().force, Some([0.0; 3]));
    assert_eq!((client.poll_action(at(225)), client.poll_action(at(225))), (Some(Action::Close), None));
    assert_eq!((client.snapshot(at(225)).phase, client.poll_timeout()), (Phase::Connecting, Some(at(475))));
    assert_eq!((client.report().flaws[Flaw::NotJson.index()], client.report().losses), (19, 1));
}

#[test]
fn an_event_sends_zero_at_once_although_a_reply_is_outstanding() {
    let device = || "04C3".to_owned();
    for event in [Event::Braked(device()), Event::Stalled(device()), Event::Disconnected(device())] {
        let mut client = active();
        client.hold(at(206), force([0.5, 0.0, 0.0]));
        sent(&mut client, at(206));
        client.receive_event(at(206), &Event::Braked("1234".to_owned()));
        assert!(sent(&mut client, at(206)).is_empty() && client.snapshot(at(206)).phase == Phase::Active);
        client.receive_event(at(206), &event);
        assert_eq!(request(&mut client, at(206), Format::V35).force, Some([0.0; 3]), "{event:?}");
        assert_eq!((client.snapshot(at(206)).force, client.report().losses), ([0.0; 3], 1), "{event:?}");
        let is_lost = matches!(event, Event::Disconnected(_));
        assert_eq!(client.snapshot(at(206)).phase == Phase::NoDevice, is_lost, "{event:?}");
        // A brake holds until its release, and then the device must be armed anew.
        client.receive(at(207), &reply(&["04C3"], ""));
        client.receive(at(208), &reply(&["04C3"], ""));
        let phase = if matches!(event, Event::Braked(_)) { Phase::Braked } else { Phase::Disarmed };
        assert_eq!(client.snapshot(at(208)).phase, phase, "{event:?}");
        client.receive_event(at(209), &Event::Released(device()));
        assert_eq!(client.snapshot(at(209)).phase, Phase::Disarmed, "{event:?}");
    }
}

/// Nobody hears of the release of a brake once the events have ended: the device must be armed anew, and is not braked for ever.
#[test]
fn the_end_of_the_events_disarms() {
    let mut client = active();
    client.receive_event(at(206), &Event::Braked("04C3".to_owned()));
    sent(&mut client, at(206));
    client.receive(at(207), &reply(&["04C3"], ""));
    client.events_ended(at(207));
    assert_eq!(client.snapshot(at(207)).phase, Phase::Disarmed);
    let mut client = active();
    client.events_ended(at(206));
    assert_eq!(request(&mut client, at(206), Format::V35).force, Some([0.0; 3]));
    assert_eq!((client.snapshot(at(206)).phase, client.report().losses), (Phase::Disarmed, 1));
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
    // A force that waits for the reply does not follow the close.
    deaf.hold(at(1001), GatedForce::ZERO);
    deaf.receive(at(1001), &reply(&["04C3"], UNCENTRED));
    assert_eq!(deaf.refusal(), Some(Refusal::NoPreset(V35)));
    assert_eq!((deaf.poll_action(at(1001)), deaf.is_over()), (Some(Action::Close), true));
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
    // A service that has taken the preset ends the search: the next pause is short again.
    assert_eq!(client.poll_action(now), Some(Action::Connect));
    client.connected(now, V35);
    for _ in 0..2 {
        client.receive(now, &reply(&["04C3"], CENTRED));
    }
    client.closed(now);
    assert_eq!(client.poll_timeout(), Some(now + PAUSES[0]));
    now += PAUSES[0];
    // A silent service is left after a second.
    assert_eq!(client.poll_action(now), Some(Action::Connect));
    client.connected(now, V35);
    assert_eq!(client.poll_timeout(), Some(now + SILENCE));
    client.handle_timeout(now + SILENCE);
    assert_eq!(client.poll_action(now + SILENCE), Some(Action::Close));
}

#[test]
fn a_stop_sends_zero_waits_and_closes() {
    let stopped = || {
        let mut client = active();
        client.stop(at(206));
        assert_eq!(request(&mut client, at(206), Format::V35).force, Some([0.0; 3]));
        assert!(!client.is_over());
        client
    };
    let mut answered = stopped();
    answered.receive(at(207), &reply(&["04C3"], ""));
    assert_eq!((answered.poll_action(at(207)), answered.is_over()), (Some(Action::Close), true));
    // The reply to a message before the zero does not end the wait.
    let mut older = active();
    older.hold(at(206), force([0.5, 0.0, 0.0]));
    older.stop(at(206));
    assert_eq!(sent(&mut older, at(206)).len(), 2);
    older.receive(at(207), &reply(&["04C3"], ""));
    assert_eq!((older.poll_action(at(207)), older.is_over()), (None, false));
    older.receive(at(208), &reply(&["04C3"], ""));
    assert_eq!((older.poll_action(at(208)), older.is_over()), (Some(Action::Close), true));
    let mut silent = stopped();
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
