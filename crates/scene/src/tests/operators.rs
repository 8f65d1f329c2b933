//! Tests of `hand.operator`.

use std::time::Duration;

use cohaptic_peer::operator::{MovesConfig, OperatorConfig, OperatorLaw, Seen};
use cohaptic_peer::{ArmConfig, Hand};

use super::{SCENE, parse, refused};

const REACH: &str = "[task]\nkind = \"reach\"\ntargets = [0.1]\nradius = 0.01\n";
const TRACK: &str = "[task]\nkind = \"track\"\nsines = [{ amplitude = 0.02, frequency = 0.25 }]\n";

/// Returns [`SCENE`] with a task and an operator of the peer `left`.
fn with(operator: &str, task: &str) -> String {
    SCENE.replace("name = \"left\"", &format!("name = \"left\"\nhand = {{ operator = {operator} }}")) + task
}

#[test]
fn an_operator_has_defaults_by_the_task() {
    let hand =
        |operator: &str, task: &str| parse(&with(operator, task), &[]).unwrap_or_else(|error| panic!("{error}")).peers[0].hand.clone().unwrap();
    let arm = ArmConfig { mass: 0.5, damping: 20.0, stiffness: 300.0 };
    let [long, short] = [250, 200].map(Duration::from_millis);
    let moves = MovesConfig { reaction: long, duration: long, speed: None, step: None, noise: 0.1, learns: 0.2, expects: None };
    let operator = |law| Box::new(OperatorConfig { sees: Seen::Own, visual_delay: short, law });
    assert_eq!(hand("{}", REACH), Hand::Operator { arm, operator: operator(OperatorLaw::Moves(moves.clone())) });
    assert_eq!(hand("{}", TRACK), Hand::Operator { arm, operator: operator(OperatorLaw::Crossover { frequency: 3.0 }) });
    let written = "{ law = \"moves\", arm = { mass = 0.4 }, sees = \"right\", visual-delay = \"150ms\", reaction = \"0s\", move = \"300ms\", \
                   speed = 0.5, step = 0.02, noise = 0, learns = \"10%\", expects = \"24ms\" }";
    let expected = MovesConfig {
        reaction: Duration::ZERO,
        duration: Duration::from_millis(300),
        speed: Some(0.5),
        step: Some(0.02),
        noise: 0.0,
        learns: 0.1,
        expects: Some(Duration::from_millis(24)),
    };
    let operator = OperatorConfig { sees: Seen::Peer(1), visual_delay: Duration::from_millis(150), law: OperatorLaw::Moves(expected) };
    assert_eq!(hand(written, REACH), Hand::Operator { arm: ArmConfig { mass: 0.4, ..arm }, operator: Box::new(operator) });
}

#[test]
fn an_operator_may_look_back_by_ten_thousand_ticks() {
    let scene = parse(&with("{ visual-delay = \"10s\" }", REACH), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.operator(0).unwrap().visual_ticks(Duration::from_millis(1)), 10_000);
}

/// A person who sees another peer expects the delays of both ways, and access lines are parts of a way. A person who sees the own copy expects no delay.
#[test]
fn an_operator_expects_the_delays_of_the_scene() {
    let expected = |operator: &str, overrides: &[&str]| {
        let scene = parse(&with(operator, REACH), overrides).unwrap_or_else(|error| panic!("{error}"));
        (scene.expected_delay(0), scene.expected_delay(1))
    };
    let millis = Duration::from_millis;
    let other = "{ sees = \"right\" }";
    assert_eq!(expected("{}", &[]), (Duration::ZERO, Duration::ZERO));
    assert_eq!(expected(other, &[]), (millis(48), Duration::ZERO));
    let lines = ["links.right.left.delay=30ms", "peers.left.uplink.delay=1ms", "peers.right.downlink.delay=2ms", "peers.right.uplink.delay=4ms"];
    assert_eq!(expected(other, &lines), (millis(24 + 30 + 1 + 2 + 4), Duration::ZERO));
    assert_eq!(expected("{ sees = \"right\", expects = \"7ms\" }", &[]), (millis(7), Duration::ZERO));
    // Peers that share the keys of [peer]: for the peer of that name this is the own copy.
    let text = SCENE.replace("[peer]\n", "[peer]\nhand = { operator = { sees = \"right\" } }\n") + REACH;
    let scene = parse(&text, &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!([0, 1].map(|peer| scene.operator(peer).unwrap().sees), [Seen::Peer(1), Seen::Own]);
    assert_eq!([0, 1].map(|peer| scene.expected_delay(peer)), [millis(48), Duration::ZERO]);
}

#[test]
fn a_wrong_operator_is_refused_where_it_stands() {
    let beginning = |message: &str| message.split_once(": ").map(|(_, rest)| rest.to_owned()).unwrap_or_default();
    for (operator, task, expected) in [
        ("{}", "", "peers.left.hand.operator: an operator does the task of the scene, and the scene has none: expected a table [task] too"),
        ("{ law = \"crossover\" }", REACH, "peers.left.hand.operator.law: crossover follows a moving target, and the target of reach rests"),
        ("{ law = \"moves\" }", TRACK, "peers.left.hand.operator.law: moves leads to a target at rest, and the target of track moves"),
        ("{ crossover = 2 }", REACH, "peers.left.hand.operator.crossover: only an operator of the law crossover takes this key"),
        ("{ noise = 0.2 }", TRACK, "peers.left.hand.operator.noise: only an operator of the law moves takes this key"),
        ("{ sees = \"nobody\" }", REACH, "peers.left.hand.operator.sees: there is no peer \"nobody\": expected one of left, right"),
        ("{ learns = 1.5 }", REACH, "peers.left.hand.operator.learns: 1.5"),
        ("{ move = \"0s\" }", REACH, "peers.left.hand.operator.move: "),
        ("{ expects = \"automatic\" }", REACH, "peers.left.hand.operator.expects: unknown word \"automatic\": expected auto, or a duration"),
        ("{ visual-delay = \"11s\" }", REACH, "peers.left.hand.operator.visual-delay: 11s are 11000 ticks: expected at most 10000, 10s"),
        ("{ arm = { mass = -1 } }", REACH, "peers.left.hand.operator.arm.mass: -1 is out of range"),
        ("{ reach = 1 }", REACH, "peers.left.hand.operator.reach: unknown key"),
    ] {
        let message = refused(&with(operator, task), &[]).to_string();
        assert!(beginning(&message).starts_with(expected), "{operator}: {message}");
    }
    for (operator, overrides, expected) in [
        ("{}", &["peers.left.hand.force=1"][..], "peers.left.hand.force: \"operator\" was given before"),
        ("{}", &["peers.left.kind=falcon"], "peers: peer \"left\": an operator moves a device that is simulated here"),
    ] {
        let message = refused(&with(operator, REACH), overrides).to_string();
        assert!(beginning(&message).starts_with(expected), "{operator}: {message}");
    }
}

/// The ends of a line of peers do not hear each other, nor do two clients of a server.
#[test]
fn an_operator_sees_only_what_its_peer_hears() {
    let three = with("{ sees = \"third\" }", REACH).replace("[link]", "[[peers]]\nname = \"third\"\n[link]");
    parse(&three, &[]).unwrap_or_else(|error| panic!("{error}"));
    for unheard in [
        "topology={ kind = \"star\", hub = \"right\" }",
        "coordination={ strategy = \"client-server\", stiffness = 1, update = \"8ms\", client-server.server = \"right\" }",
    ] {
        let message = refused(&three, &[unheard]).to_string();
        assert!(message.contains("peer \"left\": an operator cannot see peer \"third\", of which this peer gets no samples"), "{message}");
        parse(&three.replace("sees = \"third\"", "sees = \"right\""), &[unheard]).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn an_operator_stays_for_the_whole_scene() {
    for (begins, changes) in
        [("{ force = 1 }", "{ operator = {} }"), ("{ operator = {} }", "\"none\""), ("{ operator = {} }", "{ operator = { noise = 0 } }")]
    {
        let change = format!("[[timeline]]\nat = \"1s\"\npeer = \"left\"\nset = {{ hand = {changes} }}\n");
        let text = SCENE.replace("name = \"left\"", &format!("name = \"left\"\nhand = {begins}")) + REACH + &change;
        let message = refused(&text, &[]).to_string();
        assert!(message.contains("timeline.0.set.hand: an operator cannot appear, vanish or change while the scene runs"), "{message}");
    }
}
