//! Cases computed by hand, and random networks compared with the emulator itself.

use std::time::Duration;

use cohaptic_scene::Scene;

use super::{LinkTiming, NominalNetwork};
use crate::AnalysisError;

fn scene(rest: &str, overrides: &[&str]) -> Scene {
    let text = format!(
        "scene = {{ duration = \"1s\", count = 2 }}\nobject.mass = 1\npeer = {{ contact = \"none\", device.mass = 1 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n{rest}"
    );
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(&text, "network.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn network(rest: &str, overrides: &[&str]) -> NominalNetwork {
    NominalNetwork::of(&scene(rest, overrides)).unwrap_or_else(|error| panic!("{error}"))
}

fn constant(micros: u64) -> LinkTiming {
    LinkTiming::Constant(Duration::from_micros(micros))
}

fn pattern(micros: &[Option<u64>]) -> LinkTiming {
    LinkTiming::Pattern(micros.iter().map(|micros| micros.map(Duration::from_micros)).collect())
}

#[test]
fn what_only_delays_is_known_at_once_for_any_number_of_peers() {
    let many = network("link.delay = \"24ms\"", &["scene.count=100000"]);
    assert!(many.is_uniform() && many.notes.is_empty());
    assert_eq!(*many.timing(99_999, 0), constant(24_000));
    // With a rate, two peers are probed for all: 64 bytes at 64 kbit/s take 8 ms.
    let rated = network("link = { delay = \"1ms\", rate = \"128kbit\", queue = { limit = \"unlimited\" } }", &["scene.count=100000"]);
    assert!(rated.is_uniform());
    assert_eq!(*rated.timing(0, 99_999), constant(5_000));
}

#[test]
fn chance_is_replaced_by_its_mean_and_said() {
    let network = network("link = { delay = \"24ms\", jitter = { sd = \"2ms\" }, loss = 0.1, duplicate = 0.1 }", &[]);
    assert_eq!(*network.timing(0, 1), constant(24_000));
    assert_eq!(
        network.notes,
        ["every link: jitter is replaced by the mean delay, 24ms", "every link: random loss is left out", "every link: duplication is left out"]
    );
}

#[test]
fn losses_that_are_chosen_make_a_pattern_by_the_number_of_the_sample() {
    let third = network("link = { delay = \"2ms\", loss = { packets = [2], every = 3 } }", &[]);
    assert_eq!(*third.timing(0, 1), pattern(&[Some(2_000), Some(2_000), None]));
    let never = network("link = { delay = \"2ms\", mtu = \"63B\" }", &[]);
    assert_eq!(*never.timing(0, 1), pattern(&[None]));
}

/// A sample that finds no slot waits 10 ms for the slot that it opens. The next sample, 8 ms later, waits 2 ms for the same slot. The sample after that opens
/// the next slot.
#[test]
fn slots_take_every_other_sample_along() {
    let slots = network("link = { slots = { min = \"10ms\", max = \"10ms\" } }", &[]);
    assert_eq!(*slots.timing(0, 1), pattern(&[Some(10_000), Some(2_000)]));
}

/// Two senders share a downlink of 128 kbit/s, 4 ms per sample: of two samples that arrive together the second waits for the first.
#[test]
fn samples_that_share_a_line_wait_for_each_other() {
    let shared = network(
        "link.delay = \"1ms\"\n[[peers]]\nname = \"peer3\"\ndownlink = { rate = \"128kbit\", queue = { limit = \"unlimited\" } }",
        &["scene.count=3"],
    );
    assert_eq!((shared.timing(0, 2), shared.timing(1, 2)), (&constant(5_000), &constant(9_000)));
    assert_eq!((shared.timing(2, 0), shared.timing(0, 1)), (&constant(1_000), &constant(1_000)));
    assert!(!shared.is_uniform());
}

/// Before a relay a sample is one packet for three receivers: 4 ms at 128 kbit/s. Three packets every 8 ms would be too many.
#[test]
fn before_a_relay_a_sample_is_one_packet() {
    let rest = "link.delay = \"1ms\"\n[[peers]]\nname = \"peer1\"\nuplink = { rate = \"128kbit\", queue = { limit = \"unlimited\" } }";
    let overrides = ["scene.count=4", "topology={ kind = \"star\", role = \"relay\" }", "peers.peer1.uplink.rate=63kbit"];
    let relayed = network(rest, &overrides[..2]);
    assert!((1..4).all(|to| *relayed.timing(0, to) == constant(5_000) && *relayed.timing(to, 0) == constant(1_000)));
    let refused = |overrides| match NominalNetwork::of(&scene(rest, overrides)) {
        Err(AnalysisError::Overloaded { line, load, rate }) => (line, load, rate),
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("it carries all"),
    };
    assert_eq!(refused(&overrides[..1]), ("the uplink of peer1".to_owned(), 192_000.0, 128_000.0));
    assert_eq!(refused(&overrides), ("the uplink of peer1".to_owned(), 64_000.0, 63_000.0));
}

/// 64 bytes every 8 ms are 64 kbit/s.
#[test]
fn what_no_line_carries_is_refused_unless_its_queue_is_short() {
    let over = scene("link = { rate = \"63kbit\", queue = { limit = \"unlimited\" } }", &[]);
    let error = NominalNetwork::of(&over).unwrap_err();
    assert_eq!(error, AnalysisError::Overloaded { line: "the link from peer1 to peer2".to_owned(), load: 64_000.0, rate: 63_000.0 });
    // At 32 kbit/s a sample takes 16 ms, so that every other sample finds the line busy.
    let half = network("link = { rate = \"32kbit\", queue = { limit = \"0 packets\" } }", &[]);
    assert_eq!(*half.timing(0, 1), pattern(&[Some(16_000), None]));
}

/// Movements are wanted motions, as of an arm. Tracking belongs to the loop, and is followed but where the object turns.
#[test]
fn of_an_operator_who_makes_movements_the_arm_counts() {
    let hand = |rest: &[&str]| {
        let touching = ["peer.coupling.stiffness=3500", "peer.contact=grasp", "task={ kind = \"reach\", targets = [0.1], radius = 0.01 }"];
        crate::analyse(&scene("link.delay = \"24ms\"", &[&touching[..], rest].concat()), crate::Method::Reduced).unwrap()
    };
    let of_moves = hand(&["peers.peer2.hand.operator={}"]);
    let of_arm = hand(&["peers.peer2.hand.arm={ mass = 0.5, damping = 20, stiffness = 300 }"]);
    assert_eq!(of_moves.radius, of_arm.radius);
    assert_eq!((of_moves.notes.as_slice(), of_arm.notes.is_empty()), ([crate::ARMS_ALONE.to_owned()].as_slice(), true));
}
