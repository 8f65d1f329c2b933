//! Tests of refused scenes: the place of each fault, its key and its message.

mod access;
mod form;
mod inverse3;
mod operators;
mod slow_devices;
mod strategies;
mod task;
mod topologies;

use std::path::Path;
use std::time::Duration;

use cohaptic_peer::Contact;

use crate::{Scene, SceneError};

/// A valid scene, into which the tests put faults. The places in the tables below count lines from `[scene]`, line 1.
const SCENE: &str = r#"[scene]
duration = "7s"
[object]
mass = 0.45
[coordination]
strategy = "average-position"
stiffness = 2100.0
update = "8ms"
[peer]
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }
[[peers]]
name = "left"
[[peers]]
name = "right"
[link]
delay = "24ms"
"#;

fn parse(text: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(text, Path::new("x.toml"), &overrides)
}

fn refused(text: &str, overrides: &[&str]) -> SceneError {
    match parse(text, overrides) {
        Ok(_) => panic!("{overrides:?} is taken, with\n{text}"),
        Err(error) => error,
    }
}

/// Checks that a scene is refused: place, key and beginning of the message are `expected`, and the message shows the line of the fault.
fn check(text: &str, expected: &str) {
    let error = refused(text, &[]);
    let shown = error.to_string();
    assert!(shown.starts_with(&format!("x.toml:{expected}")), "\nexpected x.toml:{expected}\nfound    {shown}\nwith\n{text}");
    let place = error.diagnostic().unwrap();
    assert_eq!(place.shown_line(), text.lines().nth(place.line() - 1).unwrap_or(""), "{shown}");
}

/// Checks that [`SCENE`] is refused after a replacement. Each entry is the old text, the new text and the expected message.
fn check_replaced(faults: &[(&str, &str, &str)]) {
    for (old, new, expected) in faults {
        assert!(SCENE.contains(old), "{old}");
        check(&SCENE.replacen(old, new, 1), expected);
    }
}

/// Checks scenes to which lines are added, from line 18 on.
fn check_added(faults: &[(&str, &str)]) {
    for (added, expected) in faults {
        check(&format!("{SCENE}{added}"), expected);
    }
}

#[test]
fn the_scene_without_faults_is_taken() {
    parse(SCENE, &[]).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn an_unknown_key_is_refused_wherever_it_stands() {
    check_replaced(&[
        (
            "[object]",
            "[objekt]",
            "3:2: objekt: unknown key: expected one of scene, object, coordination, simulation, peer, peers, topology, modulators, link, links, timeline, task, measure, expect; did you mean \"object\"?",
        ),
        ("duration = \"7s\"", "duration = \"7s\"\nspeed = 1", "3:1: scene.speed: unknown key: expected one of title, duration, seed, axes, count"),
        ("mass = 0.45", "mass = 0.45\nmas = 1", "5:1: object.mas: unknown key"),
        (
            "update =",
            "updat =",
            "8:1: coordination.updat: unknown key: expected one of strategy, scaling, pull, stiffness, damping, update, send-when, rotational-stiffness, rotational-damping, smoothed-average-position, extrapolated, local-damping, local-lag, passivity-control, set-position, wave, client-server; did you mean \"update\"?",
        ),
        ("damping = 5.0 }\ncoupling", "dampening = 5.0 }\ncoupling", "10:24: peer.device.dampening: unknown key: expected one of mass, damping"),
        (
            "name = \"left\"",
            "name = \"left\"\ncolour = 1",
            "14:1: peers.left.colour: unknown key: expected one of name, kind, silence, falcon, inverse3, pointer, tick, compute-delay, phase, contact",
        ),
        ("[peer]", "[peer]\nname = \"x\"", "10:1: peer.name: unknown key"),
        ("[link]", "[link]\nduplicat = 0.1", "17:1: link.duplicat: unknown key: expected one of delay, jitter"),
        ("[link]", "[link]\nfrom = \"left\"", "17:1: link.from: unknown key"),
    ]);
    check_added(&[
        ("[expect]\nstabel = true", "19:1: expect.stabel: unknown key: expected one of stable, discrepancy"),
        ("[simulation]\nstep = 1", "19:1: simulation.step: unknown key: expected one of integrator, substeps"),
        (
            "[[links]]\nfrom = \"left\"\nto = \"right\"\ncorrupted = 1",
            "21:1: links.left.right.corrupted: unknown key: expected one of from, to, delay",
        ),
        ("[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { dealy = \"1ms\" }", "21:9: timeline.0.set.dealy: unknown key"),
        (
            "[[timeline]]\nat = \"1s\"\npeer = \"left\"\nset = { device = { mass = 1 } }",
            "21:9: timeline.0.set.device: unknown key: expected one of contact, hand",
        ),
    ]);
}

#[test]
fn a_missing_key_is_said_at_the_head_of_its_table() {
    check_replaced(&[
        ("duration = \"7s\"", "", "1:1: scene.duration: missing key: expected a duration above zero such as \"7s\""),
        ("[scene]\nduration = \"7s\"\n", "", "1:1: scene: missing key: expected a table [scene]"),
        ("mass = 0.45", "damping = 1", "3:1: object.mass: missing key: expected a number above zero [kg]"),
        ("strategy = \"average-position\"", "", "5:1: coordination.strategy: missing key: expected one of average-position, proportional-derivative"),
        ("update = \"8ms\"", "", "5:1: coordination.update: missing key"),
        ("device = { mass = 0.1, damping = 5.0 }", "", "12:1: peers.left.device: missing key"),
        ("mass = 0.1, ", "", "10:10: peer.device.mass: missing key"),
        ("coupling = { stiffness = 3500.0, damping = 5.0 }", "", "12:1: peers.left.coupling: missing key"),
        ("name = \"left\"", "", "12:1: peers.0.name: missing key"),
        ("[[peers]]\nname = \"left\"\n", "", "12:1: peers: a scene with 1 peer: expected at least two entries [[peers]], or scene.count"),
    ]);
    check_added(&[
        ("[[links]]\nto = \"right\"", "18:1: links.0.from: missing key: expected the name of the peer that sends"),
        ("[[timeline]]\nat = \"1s\"\nlink = \"all\"", "18:1: timeline.0.set: missing key"),
        ("[[timeline]]\nlink = \"all\"\nset = { delay = \"1ms\" }", "18:1: timeline.0.at: missing key"),
        ("[[timeline]]\nat = \"1s\"", "18:1: timeline.0.set: missing key"),
        ("[[timeline]]\nat = \"1s\"\nset = {}", "18:1: timeline.0: no key is given: expected link, peer or coordination"),
    ]);
}

#[test]
fn a_wrong_unit_or_type_is_refused() {
    check_replaced(&[
        ("\"7s\"", "7", "2:12: scene.duration: found the integer 7: expected a duration such as \"8ms\""),
        ("\"7s\"", "\"7\"", "2:12: scene.duration: no unit in \"7\": expected a duration"),
        ("\"7s\"", "\"-7s\"", "2:12: scene.duration: \"-7s\" does not begin with a plain decimal number"),
        ("\"7s\"", "\"0s\"", "2:12: scene.duration: zero is out of range: expected a duration above zero"),
        ("0.45", "\"0.45kg\"", "4:8: object.mass: found the text \"0.45kg\": expected a number above zero [kg]"),
        ("0.45", "true", "4:8: object.mass: found true: expected a number"),
        ("0.45", "1979-05-27", "4:8: object.mass: found a date or time: expected a number"),
        ("\"24ms\"", "{ mean = 1 }", "17:9: link.delay: found a table: expected a duration"),
        ("delay = \"24ms\"", "rate = \"10Mb\"", "17:8: link.rate: unknown unit \"Mb\" in \"10Mb\": expected a rate above zero"),
        ("delay = \"24ms\"", "rate = \"1Mbit\"\noverhead = \"28\"", "18:12: link.overhead: no unit in \"28\": expected a size"),
        (
            "delay = \"24ms\"",
            "rate = \"1Mbit\"\nqueue.limit = \"100\"",
            "18:15: link.queue.limit: \"100\" is not a limit of a queue: expected a limit such as \"100 packets\"",
        ),
        ("delay = \"24ms\"", "order = \"fifo\"", "17:9: link.order: unknown name \"fifo\": expected one of allow-reordering, in-order"),
        ("[link]\n", "[[link]]\n", "16:1: link: found a list: expected a table of link keys"),
        ("[[peers]]\nname = \"left\"\n[[peers]]\nname = \"right\"\n", "[peers]\n", "12:1: peers: found a table: expected entries [[peers]]"),
        (
            "average-position",
            "average-positoin",
            "6:12: coordination.strategy: unknown name \"average-positoin\": expected one of average-position, proportional-derivative, smoothed-average-position, extrapolated, local-damping, local-lag, passivity-control, set-position, wave, client-server; did you mean \"average-position\"?",
        ),
        ("[peer]", "[peer]\nhand = \"soft\"", "10:8: peer.hand: unknown hand \"soft\": expected \"none\""),
        ("[peer]", "[peer]\ncontact = { pull = 1 }", "10:13: peer.contact.pull: unknown key: expected push"),
        ("[peer]", "[peer]\nclock.drift = \"20\"", "10:15: peer.clock.drift: \"20\" is not a drift: expected a drift such as \"20ppm\""),
        ("[peer]", "[peer]\nclock.drift = 0.2", "10:15: peer.clock.drift: a clock drift of 0.2 is out of range: expected at most 0.1"),
        ("[peer]", "[peer]\ncompute-delay = true", "10:17: peer.compute-delay: found true: expected a number of ticks, 0 or 1"),
    ]);
}

#[test]
fn what_is_no_finite_number_in_range_is_refused() {
    check_replaced(&[
        ("0.45", "nan", "4:8: object.mass: nan is not finite: expected a number above zero [kg]"),
        ("0.45", "-inf", "4:8: object.mass: -inf is not finite"),
        ("0.45", "1e999", "4:8: object.mass: 1e999 is not finite"),
        ("0.45", "-0.45", "4:8: object.mass: -0.45 is out of range: expected a number above zero [kg]"),
        ("0.45", "-0.0", "4:8: object.mass: -0.0 is out of range"),
        ("0.45", "0", "4:8: object.mass: 0 is out of range"),
        ("0.45", "9007199254740993", "4:8: object.mass: the integer 9007199254740993 has no exact 64-bit floating-point value"),
        ("0.45", "999999999999999999999999999999999999999999", "4:8: object.mass: an integer beyond 128 bits has no exact"),
        ("2100.0", "-1", "7:13: coordination.stiffness: -1 is out of range: expected a number of at least zero [N/m]"),
        ("mass = 0.1, damping = 5.0", "mass = 0.1, damping = -5.0", "10:34: peer.device.damping: -5.0 is out of range"),
        ("stiffness = 3500.0", "stiffness = -3500.0", "11:26: peer.coupling.stiffness: -3500.0 is out of range"),
        (
            "duration = \"7s\"",
            "duration = \"7s\"\nseed = -1",
            "3:8: scene.seed: -1 is out of range: expected an integer from 0 to 9223372036854775807",
        ),
        ("duration = \"7s\"", "duration = \"7s\"\nseed = 9223372036854775808", "3:8: scene.seed: 9223372036854775808 is out of range"),
        ("duration = \"7s\"", "duration = \"7s\"\nseed = 1.5", "3:8: scene.seed: found the number 1.5: expected an integer"),
        ("duration = \"7s\"", "duration = \"7s\"\naxes = 4", "3:8: scene.axes: 4 is out of range: expected a number of axes: 1, 2 or 3"),
        ("duration = \"7s\"", "duration = \"7s\"\ncount = 1", "3:9: scene.count: 1 is out of range: expected a number of peers"),
        ("duration = \"7s\"", "duration = \"7s\"\ncount = 1000000000000", "3:9: scene.count: 1000000000000 is out of range"),
        ("[peer]", "[peer]\ncompute-delay = 2", "10:17: peer.compute-delay: 2 is out of range: expected a number of ticks, 0 or 1"),
        ("delay = \"24ms\"", "loss = 1.5", "17:8: link.loss: 1.5 is out of range: expected a probability"),
        ("delay = \"24ms\"", "loss = -0.1", "17:8: link.loss: -0.1 is out of range"),
        ("delay = \"24ms\"", "loss = nan", "17:8: link.loss: nan is not finite: expected a probability"),
        ("delay = \"24ms\"", "loss = \"101%\"", "17:8: link.loss: \"101%\" is out of range"),
        (
            "delay = \"24ms\"",
            "loss.gilbert-elliott = { p = 0.1, r = 2 }",
            "17:39: link.loss.gilbert-elliott.r: 2 is out of range: expected a probability",
        ),
        ("delay = \"24ms\"", "rate = \"0bit\"", "17:8: link.rate: \"0bit\" is out of range: expected a rate above zero"),
        ("[peer]", "[peer]\nhand = { sine = { amplitude = 1, frequency = -1 } }", "10:46: peer.hand.sine.frequency: -1 is out of range"),
        ("[peer]", "[peer]\nhand = { force = inf }", "10:18: peer.hand.force: inf is not finite: expected a number [N]"),
        ("[peer]", "[peer]\nhand = { arm = { mass = -1, damping = 0, stiffness = 0 } }", "10:25: peer.hand.arm.mass: -1 is out of range"),
    ]);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    check_replaced(&[
        ("\"8ms\"", "\"8.5ms\"", "8:10: coordination.update: coordination.update, 8.5ms, is not a whole multiple of the tick, 1ms"),
        (
            "name = \"left\"",
            "name = \"left\"\ntick = \"3ms\"",
            "14:8: peers.left.tick: coordination.update, 8ms, is not a whole multiple of the tick, 3ms",
        ),
        ("name = \"left\"", "name = \"left\"\ntick = \"16ms\"", "14:8: peers.left.tick: coordination.update, 8ms, is not a whole multiple"),
        (
            "name = \"left\"",
            "name = \"left\"\nphase = 8",
            "14:9: peers.left.phase: 8 is out of range: expected a number of ticks below coordination.update / tick, which is 8",
        ),
        (
            "delay = \"24ms\"",
            "delay = \"1ms\"\njitter = { sd = \"1ms\", distribution = \"uniform\" }",
            "18:10: link.jitter: uniform jitter with a standard deviation of 1ms around 1ms does not stay above the least delay of 0s: expected a deviation of at most 577.35us",
        ),
        ("delay = \"24ms\"", "queue.limit = \"3 packets\"", "17:1: link.queue: queue means nothing on a link without a rate: expected a key rate"),
        ("delay = \"24ms\"", "overhead = \"28B\"", "17:1: link.overhead: overhead means nothing"),
        (
            "delay = \"24ms\"",
            "outage = [{ from = \"2s\", to = \"3s\" }, { from = \"1s\", to = \"4s\" }]",
            "17:39: link.outage.1: outage 1 begins at 1s, before the one listed before it has ended",
        ),
        ("delay = \"24ms\"", "outage = [{ from = \"2s\", to = \"2s\" }]", "17:11: link.outage.0: outage 0 ends at 2s, which is not after 2s"),
        (
            "mass = 0.45",
            "mass = 0.45\nenclosure = { min = 1, max = 1, stiffness = 1, damping = 0 }",
            "5:30: object.enclosure.max: the end at 1 on axis x is not above min, 1",
        ),
        (
            "mass = 0.45",
            "mass = 0.45\nposition = [1, 2]",
            "5:12: object.position: found a list of 2 numbers: expected as many as the scene has axes, 1",
        ),
        (
            "[peer]",
            "[peer]\ncontact = { push = \"+y\" }",
            "10:20: peer.contact.push: the text \"+y\" is beyond the axes of this scene: expected x, or",
        ),
        (
            "[peer]",
            "[peer]\nhand = { force = 1, sine = { amplitude = 1, frequency = 1 } }",
            "10:21: peer.hand.sine: \"force\" was given before: expected only one of",
        ),
        ("[peer]", "[peer]\nhand = { force = 1, follows = { position = 1 } }", "10:21: peer.hand.follows: only an arm follows"),
        ("[peer]", "[peer]\nhand = {}", "10:8: peer.hand: no key is given: expected \"none\""),
        (
            "duration = \"7s\"",
            "duration = \"7s\"\naxes = 2\n[simulation]\nsubsteps = 2",
            "5:12: simulation.substeps: the integrator \"exact\" takes no substeps",
        ),
    ]);
    let two_axes = SCENE.replace("[object]", "axes = 2\n[object]");
    check(
        &two_axes.replace("[peer]", "[peer]\nhand = { force = 1.5 }"),
        "11:18: peer.hand.force: 1.5 has one component: expected a list of 2 numbers [N]",
    );
}

#[test]
fn a_peer_that_is_not_there_or_there_twice_is_refused() {
    check_replaced(&[
        ("name = \"right\"", "name = \"left\"", "15:8: peers.left.name: there is a peer \"left\" already: expected another name"),
        ("name = \"right\"", "name = \"all\"", "15:8: peers.all.name: \"all\" cannot be the name of a peer"),
        ("name = \"right\"", "name = \"\"", "15:8: peers..name: \"\" cannot be the name of a peer"),
        ("name = \"right\"", "name = \"a b\"", "15:8: peers.a b.name: \"a b\" cannot be the name of a peer"),
        ("name = \"right\"", "name = 3", "15:8: peers.1.name: found the integer 3: expected a name"),
        (
            "duration = \"7s\"",
            "duration = \"7s\"\ncount = 2",
            "14:8: peers.left.name: \"left\" is none of the peers that scene.count makes: expected one of peer1, peer2",
        ),
    ]);
    check_added(&[
        (
            "[[links]]\nfrom = \"left\"\nto = \"rihgt\"",
            "20:6: links.left.rihgt.to: there is no peer \"rihgt\": expected one of left, right; did you mean \"right\"?",
        ),
        ("[[links]]\nfrom = \"left\"\nto = \"left\"", "20:6: links.left.left.to: a peer has no link to itself"),
        (
            "[[links]]\nfrom = \"left\"\nto = \"right\"\n[[links]]\nfrom = \"left\"\nto = \"right\"",
            "23:6: links.left.right.to: there is an entry for this link already",
        ),
        ("[[timeline]]\nat = \"1s\"\npeer = \"nobody\"\nset = { contact = \"none\" }", "20:8: timeline.0.peer: there is no peer \"nobody\""),
        (
            "[[timeline]]\nat = \"1s\"\nlink = { from = \"left\", to = \"x\" }\nset = { loss = 0 }",
            "20:30: timeline.0.link.to: there is no peer \"x\"",
        ),
        ("[expect]\nposition = [{ peer = \"nobody\", at = \"1s\", min = 0 }]", "19:22: expect.position.0.peer: there is no peer \"nobody\""),
        ("[expect]\nloss = [{ link = { uplink = \"left\" }, max = 1 }]", "19:18: expect.loss.0.link: peer \"left\" has no uplink"),
    ]);
}

#[test]
fn a_change_that_cannot_happen_is_refused() {
    let arm = "{ arm = { mass = 1, damping = 1, stiffness = 1 } }";
    let change = "[[timeline]]\nat = \"1s\"\npeer = \"left\"\nset = { hand = ";
    check_added(&[
        (
            "[[timeline]]\nat = \"8s\"\ncoordination = { stiffness = 1 }",
            "19:6: timeline.0.at: 8s is after the end of the scene: expected at most scene.duration, 7s",
        ),
        (
            "[[timeline]]\nat = \"1s\"\ncoordination = {}",
            "20:16: timeline.0.coordination: nothing changes: expected stiffness, damping, send-when, or a table",
        ),
        (
            "[[timeline]]\nat = \"1s\"\ncoordination = { local-lag = { lag = \"auto\" } }",
            "20:38: timeline.0.coordination.local-lag.lag: \"auto\" is computed once",
        ),
        (
            "[[timeline]]\nat = \"1s\"\ncoordination = { set-position = { tank = 1 } }",
            "20:35: timeline.0.coordination.set-position.tank: unknown key: expected one of damping, ceiling",
        ),
        ("[[timeline]]\nat = \"1s\"\ncoordination = { wave = { impedance = 1 } }", "20:18: timeline.0.coordination.wave: unknown key"),
        ("[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = {}", "21:7: timeline.0.set: nothing changes"),
        ("[[timeline]]\nat = \"1s\"\nlink = \"some\"\nset = { loss = 0 }", "20:8: timeline.0.link: unknown links \"some\": expected \"all\" or"),
        ("[[timeline]]\nat = \"1s\"\nlink = \"all\"\npeer = \"left\"\nset = { loss = 0 }", "21:1: timeline.0.peer: \"link\" was given before"),
        (
            "[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { queue = { limit = \"1 packet\" } }",
            "21:9: timeline.0.set.queue: queue means nothing on a link without a rate",
        ),
        (
            &format!("{change}{arm} }}"),
            "21:16: timeline.0.set.hand: an arm cannot appear, vanish or change while the scene runs: expected a hand without an arm",
        ),
    ]);
    let with_arm = SCENE.replace("[peer]", &format!("[peer]\nhand = {arm}"));
    check(&format!("{with_arm}{change}\"none\" }}"), "22:16: timeline.0.set.hand: an arm cannot appear, vanish or change");
    parse(&format!("{with_arm}{change}{} }}", arm.replace("1 } }", "1 }, follows = { position = 0.1 } }")), &[])
        .unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_measure_of_what_does_not_exist_is_refused() {
    check_added(&[
        ("[measure]\nnames = [\"energy\"]", "19:10: measure.names.0: unknown measure \"energy\": expected one of discrepancy_rms_m, "),
        ("[measure]\nnames = \"most\"", "19:9: measure.names: found \"most\": expected \"all\" or a list of names"),
        ("[measure]\nnames = []", "19:9: measure.names: no name is given: expected \"all\" or a list of names"),
        ("[measure]\nnames = [1]", "19:10: measure.names.0: found the integer 1: expected the name of a measure such as \"energy_j\""),
        ("[measure]\nnames = [\"peers.nobody.energy_j\"]", "19:10: measure.names.0: there is no peer \"nobody\": expected one of left, right"),
        ("[measure]\nnames = [\"peers.left.travel_s\"]", "19:10: measure.names.0: unknown measure \"peers.left.travel_s\": expected one of"),
        (
            "[measure]\nnames = [\"viscosity_n_s_m\"]",
            "19:10: measure.names.0: viscosity_n_s_m is that of a probe, and there is none: expected measure.probe = { peer",
        ),
        ("[measure]\ntravel = { peer = \"nobody\" }", "19:19: measure.travel.peer: there is no peer \"nobody\": expected one of left, right"),
        ("[measure]\ntravel = { axis = \"y\" }", "19:19: measure.travel.axis: the text \"y\" is beyond the axes of this scene: expected x"),
        ("[measure]\ntravel = { distance = 0 }", "19:23: measure.travel.distance: 0 is out of range: expected a number above zero [m]"),
        ("[measure]\nband = 0", "19:8: measure.band: 0 is out of range: expected a number above zero [m]"),
        (
            "[measure]\nprobe = { peer = \"left\" }",
            "19:18: measure.probe.peer: the hand of peer \"left\" is not a sine: expected a peer with hand = { sine",
        ),
        ("[expect]\nmeasures = [{ name = \"energy\", max = 1 }]", "19:22: expect.measures.0.name: unknown measure \"energy\": expected one of"),
        ("[expect]\nmeasures = [{ name = \"energy_j\" }]", "19:13: expect.measures.0: neither min nor max is given"),
        (
            "[expect]\nmeasures = [{ name = \"effective_mass_kg\", max = 1 }]",
            "19:22: expect.measures.0.name: effective_mass_kg is that of a probe, and there is none",
        ),
    ]);
}

/// With a tick of 1 ms, a sine of 500 Hz has the value zero at every tick, and a sine of 998 Hz has the values of a sine of 2 Hz.
#[test]
fn a_sine_is_slower_than_half_the_rate_of_ticks() {
    let hand = |frequency: &str| SCENE.replacen("[peer]", &format!("[peer]\nhand = {{ sine = {{ amplitude = 1, frequency = {frequency} }} }}"), 1);
    assert!(parse(&hand("499.9"), &[]).is_ok());
    for frequency in ["500", "998", "1000", "1500"] {
        check(
            &hand(frequency),
            &format!(
                "10:46: peer.hand.sine.frequency: {frequency} is too fast for a hand that is computed once a tick of 1ms: expected below 500 Hz"
            ),
        );
    }
    check(
        &hand("300").replacen("[peer]", "[peer]\ntick = \"2ms\"", 1),
        "11:46: peer.hand.sine.frequency: 300 is too fast for a hand that is computed once a tick of 2ms",
    );
    let arm = "hand = { arm = { mass = 0.3, damping = 10, stiffness = 100 }, follows = { sine = { amplitude = 0.1, frequency = 600 } } }";
    check(&SCENE.replacen("[peer]", &format!("[peer]\n{arm}"), 1), "10:113: peer.hand.follows.sine.frequency: 600 is too fast");
    let change = "[[timeline]]\nat = \"1s\"\npeer = \"left\"\nset = { hand = { sine = { amplitude = 1, frequency = 700 } } }\n";
    check(&format!("{SCENE}{change}"), "21:54: timeline.0.set.hand.sine.frequency: 700 is too fast");
}

#[test]
fn a_probe_pushes_with_one_sine_all_the_time() {
    let scene = |frequency: &str, more: &str| {
        let hand = format!("name = \"left\"\nhand = {{ sine = {{ amplitude = 1, frequency = {frequency} }} }}");
        format!("{}[measure]\nprobe = {{ peer = \"left\" }}\n{more}", SCENE.replacen("name = \"left\"", &hand, 1))
    };
    let measured = parse(&scene("2", ""), &[]).unwrap().measure.unwrap();
    assert_eq!((measured.settings.probe, measured.names.len()), (Some(0), crate::MeasureName::all(2, false).len()));
    check(&scene("0", ""), "20:18: measure.probe.peer: the hand of peer \"left\" is a sine that does not sway");
    let change = "[[timeline]]\nat = \"1s\"\npeer = \"left\"\nset = { hand = \"none\" }\n";
    check(&scene("2", change), "20:18: measure.probe.peer: the hand of peer \"left\" changes in the timeline");
    let live = Scene::parse_live(
        &scene("2", "").replacen("amplitude = 1, frequency = 2 } }", "amplitude = 1, frequency = 2 } }\nkind = \"falcon\"", 1),
        Path::new("x.toml"),
        &[],
    );
    assert!(live.unwrap_err().to_string().contains("peer \"left\" is of kind falcon, whose hand is not simulated in a session"));
}

#[test]
fn what_is_measured_has_no_part_in_the_fingerprint_of_a_scene_without_it() {
    let text = format!("{:?}", parse(SCENE, &[]).unwrap());
    assert!(!text.contains("measure"), "{text}");
    assert!(text.starts_with("Scene { file: \"x.toml\", title: ") && text.ends_with(", timeline: [], expect: None }"), "{text}");
}

#[test]
fn an_expectation_that_says_nothing_is_refused() {
    check_added(&[
        ("[expect]\ndiscrepancy = {}", "19:15: expect.discrepancy: neither min nor max is given"),
        ("[expect]\ndiscrepancy = { min = 2, max = 1 }", "19:32: expect.discrepancy.max: max is below min"),
        ("[expect]\ndelay = { max = \"1ms\" }", "19:9: expect.delay: found a table: expected a list of tables"),
        ("[expect]\ndelay = [{ max = 0.1 }]", "19:18: expect.delay.0.max: found the number 0.1: expected a duration"),
        (
            "[expect]\nloss = [{ max = 1, cause = \"bad-luck\" }]",
            "19:28: expect.loss.0.cause: unknown name \"bad-luck\": expected one of filter, mtu, outage, loss, limit, queue-full, red, codel, pie, dualpi2, checksum, end-of-log",
        ),
        (
            "[expect]\ntravel = [{ peer = \"left\", distance = 0, max = \"1s\" }]",
            "19:39: expect.travel.0.distance: 0 is out of range: expected a number above zero [m]",
        ),
        ("[expect]\nposition = [{ peer = \"left\", at = \"9s\", min = 0 }]", "19:35: expect.position.0.at: 9s is after the end"),
        (
            "[expect]\nposition = [{ peer = \"left\", at = \"1s\", axis = \"y\", min = 0 }]",
            "19:48: expect.position.0.axis: the text \"y\" is beyond the axes",
        ),
        ("[expect]\nstable = \"yes\"", "19:10: expect.stable: found the text \"yes\": expected true or false"),
    ]);
}

#[test]
fn a_default_is_checked_even_where_every_peer_replaces_it() {
    let text = SCENE.replace("[peer]", "[peer]\ntick = \"fast\"").replace("name", "tick = \"1ms\"\nname");
    check(&text, "10:8: peer.tick: \"fast\" does not begin with a plain decimal number");
    let text = SCENE.replace("device = { mass = 0.1, damping = 5.0 }", "device = { damping = 5.0 }").replace("name", "device.mass = 0.1\nname");
    assert!(parse(&text, &[]).is_ok());
}

/// In virtual time another process is simulated, which needs the model of a device. A live session does not need one.
#[test]
fn a_peer_of_another_process_needs_a_device_only_in_virtual_time() {
    let udp = SCENE
        .replace("device = { mass = 0.1, damping = 5.0 }\n", "")
        .replace("coupling = { stiffness = 3500.0, damping = 5.0 }\n", "silence = { fade = \"1s\" }\n")
        .replace("name = \"right\"", "name = \"right\"\ncontact = \"none\"\ndevice = { mass = 0.2 }")
        .replace("name = \"left\"", "name = \"left\"\nkind = \"udp\"\nsilence.after = \"50ms\"");
    check(&udp, "11:1: peers.left.device: missing key: expected a table such as { mass = 0.1, damping = 5.0 }, from which this peer of kind \"udp\"");
    let scene = Scene::parse_live(&udp, Path::new("x.toml"), &[]).unwrap();
    let silence = crate::Silence { after: Duration::from_millis(50), fade: Duration::from_secs(1) };
    assert_eq!(scene.peers[0].kind, crate::PeerKind::Udp(silence));
    assert_eq!((scene.peers[0].contact, scene.peers[1].kind.silence()), (Contact::None, None));
    // With device and coupling, the peer is simulated as every other peer.
    let modelled = SCENE.replace("name = \"left\"", "name = \"left\"\nkind = \"udp\"");
    let (virtual_time, live) = (parse(&modelled, &[]).unwrap(), Scene::parse_live(&modelled, Path::new("x.toml"), &[]).unwrap());
    assert_eq!(virtual_time, live);
    assert_eq!(virtual_time.peers[0].device, parse(SCENE, &[]).unwrap().peers[0].device);
    let live_without_device = SCENE.replace("device = { mass = 0.1, damping = 5.0 }\n", "");
    assert!(Scene::parse_live(&live_without_device, Path::new("x.toml"), &[]).is_err());
}

#[test]
fn a_falcon_has_usable_defaults_and_its_keys_are_checked() {
    let falcon = SCENE.replace("device = { mass = 0.1, damping = 5.0 }", "kind = \"falcon\"");
    let scene = parse(&falcon, &[]).unwrap();
    assert_eq!(scene.peers[0].kind, crate::PeerKind::Falcon(crate::Silence::default(), crate::FalconSpec::default()));
    let overrides = ["peers.left.falcon={ device = \"A7001\", origin = [0, 0, 0.13] }", "peers.left.falcon.force-limit=4"];
    let crate::PeerKind::Falcon(_, spec) = &parse(&falcon, &overrides).unwrap().peers[0].kind else { panic!("{scene:?}") };
    assert_eq!(spec.device, crate::FalconDevice::Serial("A7001".to_owned()));
    assert_eq!((spec.origin, spec.force_limit, spec.counts_per_newton_metre), ([0.0, 0.0, 0.13], 4.0, 10_000.0));
    for fault in [
        "peer.kind=tcp",
        "peer.silence.after=0ms",
        "peer.silence.fade=0ms",
        "peer.silence.fad=1ms",
        "peer.falcon.origin=[0, 0]",
        "peer.falcon.origin=0",
        "peer.falcon.force-limit=0",
        "peer.falcon.counts-per-newton-metre=-1",
        "peer.falcon.device=''",
        "peer.falcon.device='a b'",
    ] {
        let error = refused(SCENE, &[fault]);
        assert!(error.diagnostic().unwrap().message().contains("expected"), "{error}");
    }
}

/// The short names are AP and PD, as in Rakhsha & Constantinescu (2015).
#[test]
fn the_two_laws_of_the_paper_have_short_names() {
    let strategy = |name: &str| parse(SCENE, &[&format!("coordination.strategy={name}")]).unwrap().coordination.strategy;
    assert_eq!(["AP", "PD"].map(strategy), ["average-position", "proportional-derivative"].map(strategy));
    refused(SCENE, &["coordination.strategy=ap"]);
}

/// A file may have a wrong key and lack a table. The wrong key is reported.
#[test]
fn a_wrong_key_is_told_before_a_missing_table() {
    check("scene.duration=\"1s\"\nscene.count=2\n[object]\nmas = 0.45\n", "4:1: object.mas: unknown key");
    check("scene = { duration = \"1s\", count = 2 }\n[object]\nmass = 0.45\n", "1:1: coordination: missing key");
}
