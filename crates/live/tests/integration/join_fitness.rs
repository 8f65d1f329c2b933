//! Scenes and sessions that do not allow joining, each refused with its sentence.

use std::time::Duration;

use cohaptic_live::join::{JoinedPeer, Unfit};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Place, Seat};
use cohaptic_peer::wire::SampleKind;

use crate::join::{at, config, pass, peer, scene};
use crate::support::{Counting, address, key};

/// Keys of a scene whose object turns, in three axes.
const TURNING: [&str; 3] = ["scene.axes=3", "object.inertia=[0.01, 0.02, 0.02]", "peers.left.hand.force=[1.5, 0.0, 0.0]"];

fn timeline(change: &str) -> String {
    format!("timeline=[{{ at = \"1s\", {change} }}]")
}

/// Joins the peer `left` of a scene with these overrides.
fn join(overrides: &[&str]) -> Result<JoinedPeer, Unfit> {
    JoinedPeer::new(scene(overrides), 0, config(None), None)
}

#[test]
fn scenes_that_need_one_clock_or_one_place_are_refused_by_name() {
    let operator = ["task={ kind = \"reach\", targets = [0.1], radius = 0.01 }", "peers.left.hand={ operator = {} }"];
    let server = |sends: &str| format!("coordination.client-server={{ server = \"left\", sends = \"{sends}\" }}");
    let (increments, states) = (server("increments"), server("states"));
    let cases: [(&[&str], &str); 4] = [
        (
            &["coordination.strategy=extrapolated"],
            "the coordination extrapolates samples by their age, and one-way times between two computers do not tell the offset of their clocks: \
             expected another strategy, such as average-position",
        ),
        (
            &["topology={ kind = \"star\", hub = \"left\" }"],
            "in a live session every peer sends to every other: expected a scene without [topology], or kind = \"full\"",
        ),
        (
            &operator,
            "a modelled person sees the whole scene, which only the session has: expected another hand, or kind = \"simulated\" in the session",
        ),
        (
            &["coordination.strategy=client-server", &increments],
            "this peer sums the displacements of its clients, of which none may be left out: expected sends = \"states\", or the server in the session",
        ),
    ];
    for (overrides, expected) in cases {
        assert_eq!(join(overrides).unwrap_err().to_string(), expected);
    }
    // A full topology, the server of clients with states, and a client of the same server are no hindrance.
    join(&["topology={ kind = \"full\" }"]).unwrap();
    join(&["coordination.strategy=client-server", &states]).unwrap();
    JoinedPeer::new(scene(&["coordination.strategy=client-server", &increments]), 1, config(None), None).unwrap();
}

#[test]
fn a_timeline_that_changes_this_peer_or_the_coordination_is_refused_by_what_it_changes() {
    let cases: [(&str, &[&str], &str); 6] = [
        ("peer = \"left\", set = { contact = \"none\" }", &[], "the contact of this peer"),
        ("peer = \"left\", set = { hand = { force = 1.0 } }", &[], "the hand of this peer"),
        ("coordination = { stiffness = 100.0 }", &[], "the gains of the coordination"),
        ("coordination = { rotational-stiffness = 2.0 }", &TURNING, "the gains of the coordination"),
        ("coordination = { smoothed-average-position = { lag = \"1ms\" } }", &[], "the parameters of the coordination"),
        ("coordination = { send-when = { position = 0.001 } }", &[], "the dead bands"),
    ];
    for (change, overrides, what) in cases {
        let change = timeline(change);
        let overrides: Vec<&str> = overrides.iter().copied().chain([&*change]).collect();
        let expected = format!(
            "the timeline changes {what} during the session, and a computer that joins does not know the session's time: expected changes of links \
             only, or none"
        );
        assert_eq!(join(&overrides).unwrap_err().to_string(), expected, "{change}");
    }
    // Links, and hands and contacts of another peer, are the session's.
    for change in [
        "peer = \"right\", set = { hand = { force = 1.0 } }",
        "peer = \"right\", set = { contact = \"none\" }",
        "link = \"all\", set = { loss = 0.5 }",
        "link = { from = \"left\", to = \"right\" }, set = { loss = 0.5 }",
    ] {
        join(&[&timeline(change)]).unwrap();
    }
}

#[test]
fn a_welcome_that_does_not_fit_names_what_differs() {
    let found = |overrides: &[&str], other: AdmissionConfig| {
        let mut door = AdmissionControl::new(other.with_key(Some(key())), &mut Counting::default()).unwrap();
        let mut left = peer(overrides, Some(key()), None);
        for hello in pass(&mut left, at(0), &mut |_| ()) {
            let Admission::Reply { bytes, .. } = door.handle_datagram(at(0), address(1), &hello) else { panic!("no welcome") };
            left.handle_datagram(at(0), &bytes);
        }
        left.mismatch().map(ToString::to_string)
    };
    let seats = |millis: u64| vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(millis) }];
    assert_eq!(
        found(&[], AdmissionConfig::new(7, 3, 4, Duration::from_millis(10), seats(2))).unwrap(),
        "the session is another one: it has 4 peers, this scene 2; it has 3 axes, this scene 1; its tick for this peer is 2ms, here 1ms; \
         its coordination.update is 10ms, here 8ms"
    );
    let session = |axes: usize, kind: SampleKind| AdmissionConfig { kind, ..AdmissionConfig::new(7, axes, 2, Duration::from_millis(8), seats(1)) };
    assert_eq!(found(&[], session(1, SampleKind::State)), None);
    assert_eq!(found(&TURNING, session(3, SampleKind::Attitude)), None);
    assert_eq!(
        found(&TURNING, session(3, SampleKind::State)).unwrap(),
        "the session is another one: its object does not turn, that of this scene turns"
    );
}
