//! What is refused, and what is said about it.

use std::path::Path;
use std::time::Duration;

use cohaptic_peer::coordination::Law;
use cohaptic_peer::{Contact, Coordination, Gains};

use crate::{Change, ChangeKind, Scene, SceneError};

/// A scene to which faults are done. Its lines are numbered so that the tables below can be read.
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

/// Checks place, key and the beginning of the message, and that the right line is shown.
fn check(text: &str, expected: &str) {
    let error = refused(text, &[]);
    let shown = error.to_string();
    assert!(shown.starts_with(&format!("x.toml:{expected}")), "\nexpected x.toml:{expected}\nfound    {shown}\nwith\n{text}");
    let place = error.diagnostic().unwrap();
    assert_eq!(place.shown_line(), text.lines().nth(place.line() - 1).unwrap_or(""), "{shown}");
}

/// Checks scenes in which one text is replaced by another.
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
fn the_display_form_shows_the_line_with_carets_below_the_place() {
    let error = refused(&SCENE.replace("delay = \"24ms\"", "delay     = \"8 parsecs\""), &[]);
    let expected = r#"x.toml:17:13: link.delay: unknown unit "parsecs" in "8 parsecs": expected a duration such as "8ms", "1.5s" or "250us" (units: ns, us, ms, s, min, h)
   |
17 | delay     = "8 parsecs"
   |             ^^^^^^^^^^^"#;
    assert_eq!(error.to_string(), expected);
    assert!(!error.is_io());
}

#[test]
fn the_display_form_of_an_override_shows_the_override() {
    let error = refused(SCENE, &["link.dlay=\"8ms\""]);
    let keys = cohaptic_linkfile::link::LINK_KEYS.join(", ");
    assert!(keys.starts_with("delay, jitter, order, loss, mark-instead-of-loss, duplicate, corrupt, reorder, rate, queue"), "{keys}");
    let expected = format!(
        "--set link.dlay=\"8ms\": link.dlay: unknown key: expected one of {keys}; did you mean \"delay\"?\n |\n | link.dlay=\"8ms\"\n |      ^^^^"
    );
    assert_eq!(error.to_string(), expected);
}

#[test]
fn an_unknown_key_is_refused_wherever_it_stands() {
    check_replaced(&[
        (
            "[object]",
            "[objekt]",
            "3:2: objekt: unknown key: expected one of scene, object, coordination, simulation, peer, peers, modulators, link, links, timeline, measure, expect; did you mean \"object\"?",
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
            "14:1: peers.left.colour: unknown key: expected one of name, kind, silence, falcon, tick, compute-delay, phase, contact",
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
        ("[[timeline]]\nat = \"1s\"\nset = {}", "18:1: timeline.0: nothing is given: expected link, peer or coordination"),
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
            "18:15: link.queue.limit: \"100\" is no limit of a queue: expected a limit such as \"100 packets\"",
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
        ("[peer]", "[peer]\nclock.drift = \"20\"", "10:15: peer.clock.drift: \"20\" is no drift: expected a drift such as \"20ppm\""),
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
            "10:21: peer.hand.sine: \"force\" is given already: expected only one of",
        ),
        ("[peer]", "[peer]\nhand = { force = 1, follows = { position = 1 } }", "10:21: peer.hand.follows: only an arm follows"),
        ("[peer]", "[peer]\nhand = {}", "10:8: peer.hand: nothing is given: expected \"none\""),
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
fn a_strategy_that_cannot_work_in_a_scene_is_refused() {
    let of = |strategy: &str| SCENE.replace("average-position", strategy);
    let refused = |strategy: &str, changes: &[&str], why: &str| {
        let changes: Vec<String> = changes.iter().copied().map(str::to_owned).collect();
        let error = Scene::parse(&of(strategy), Path::new("scene.toml"), &changes).unwrap_err().to_string();
        assert!(error.contains(&format!("the strategy {strategy} {why}")), "{error}");
    };
    for strategy in ["passivity-control", "set-position", "wave", "client-server"] {
        parse(&of(strategy), &[]).unwrap();
    }
    for strategy in ["passivity-control", "set-position", "wave"] {
        refused(strategy, &["peer.compute-delay=1"], "counts the energy of forces that act at once");
    }
    for strategy in ["set-position", "wave"] {
        refused(strategy, &["simulation.integrator=\"rk4\""], "damps each copy by just as much");
    }
    refused("wave", &["peer.clock.drift=\"5ppm\""], "sends waves for as long as it takes");
    refused("set-position", &["coordination.stiffness=0"], "has no set-position without a spring");
    refused("set-position", &["timeline=[{at=\"1ms\",coordination={stiffness=5}}]"], "keeps energy in its springs");
    refused("wave", &["timeline=[{at=\"1ms\",coordination={send-when={position=1}}}]"], "needs every sample");
    for strategy in ["wave", "client-server"] {
        refused(strategy, &["coordination.send-when.velocity=\"10%\""], "needs every sample");
    }
}

#[test]
fn parameters_change_with_the_timeline_as_far_as_the_strategy_can_follow() {
    let change = |parameters: &str| format!("[[timeline]]\nat = \"1s\"\ncoordination = {{ {parameters} }}\n");
    let text = |strategy: &str, parameters: &str| format!("{}{}", SCENE.replace("average-position", strategy), change(parameters));
    let scene = parse(&text("extrapolated", "stiffness = 5, extrapolated = { horizon = \"20ms\" }"), &[]).unwrap();
    let [Change { what: ChangeKind::Coordination(gains), .. }, Change { what: ChangeKind::Parameters(settings), .. }] = &*scene.timeline else {
        panic!("{:?}", scene.timeline)
    };
    assert_eq!(*gains, Gains { stiffness: 5.0, damping: 0.0 });
    assert_eq!(settings.of(Coordination::Extrapolated).duration(0), Duration::from_millis(20));
    let started = "18:1: timeline: send times of samples are kept from the beginning or not at all";
    check(&text("extrapolated", "extrapolated = { horizon = \"0s\" }"), started);
    check(&text("local-lag", "local-lag = { lag = \"11s\" }"), "18:1: timeline: the lag is more than 10000 ticks of a peer");
}

#[test]
fn parameters_that_a_strategy_cannot_have_are_refused_at_their_place() {
    for (key, value, message) in [
        ("wave.impedance", "0", "coordination.wave.impedance: "),
        ("wave.on-loss", "\"keep\"", "coordination.wave.on-loss: unknown name \"keep\": expected one of zero, hold"),
        ("passivity-control.reserve", "-1", "coordination.passivity-control.reserve: "),
        ("set-position.ceiling", "\"much\"", "coordination.set-position.ceiling: "),
        ("client-server.server", "\"nobody\"", "coordination.client-server.server: there is no peer \"nobody\""),
        ("client-server.returns", "\"nothing\"", "coordination.client-server.returns: unknown name \"nothing\""),
        ("send-when.velocity", "1.0", "coordination.send-when.velocity: with a dead band of 100%"),
        ("send-when.heartbeat", "\"1s\"", "coordination.send-when: nothing says when a sample is worth sending"),
        ("send-when.position", "0", "coordination.send-when.position: "),
    ] {
        let error = Scene::parse(SCENE, Path::new("scene.toml"), &[format!("coordination.{key}={value}")]).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn a_damping_that_no_link_bounds_is_refused() {
    let local = SCENE.replace("average-position", "local-damping");
    parse(&local, &[]).unwrap();
    let unbounded = "5:1: coordination: a damping of \"auto\" needs the age of the oldest sample in use, which the links of this scene do not bound: expected an age, or a damping in N·s/m";
    for added in
        ["loss = \"1%\"\n", "jitter = \"1ms\"\n", "rate = \"1Mbit\"\n", "[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { delay = \"30ms\" }\n"]
    {
        check(&format!("{local}{added}"), unbounded);
        parse(&format!("{local}{added}"), &["coordination.local-damping.age=\"50ms\""]).unwrap();
        parse(&format!("{local}{added}"), &["coordination.local-damping.damping=60"]).unwrap();
        // Of a strategy that is not in use nothing is asked.
        parse(&format!("{local}{added}"), &["coordination.strategy=\"average-position\""]).unwrap();
    }
    let gains = "[[timeline]]\nat = \"1s\"\ncoordination = { stiffness = 100.0 }\n";
    check(
        &format!("{local}{gains}"),
        "5:1: coordination: the timeline changes the gains, and a damping of \"auto\" does not follow them: expected a damping in N·s/m",
    );
    parse(&format!("{local}{gains}"), &["coordination.local-damping.damping=60"]).unwrap();
    check_replaced(&[(
        "update = \"8ms\"",
        "update = \"8ms\"\nlocal-damping = { damping = \"automatic\" }",
        "9:29: coordination.local-damping.damping: unknown name \"automatic\": expected auto, or a number of at least zero [N·s/m]",
    )]);
}

#[test]
fn a_lag_that_no_links_give_is_refused() {
    let lagging = SCENE.replace("average-position", "local-lag");
    let ticks = |text: &str, changes: &[&str]| Law::<f64>::lag(&parse(text, changes).unwrap().law(0).unwrap());
    // ⌈24 ms/1 ms⌉ + ⌊(8 − 1)/2⌋, and a delay that ends between two ticks.
    assert_eq!([ticks(&lagging, &[]), ticks(&lagging, &["link.delay=\"24.2ms\""]), ticks(&lagging, &["coordination.update=\"1ms\""])], [27, 28, 24]);
    let refused = "5:1: coordination: a lag of \"auto\" needs links that all have one constant delay and do nothing else, and peers whose clocks are alike: expected a lag such as \"16ms\"";
    for added in [
        "loss = { packets = [3], every = 4 }\n",
        "jitter = \"1ms\"\n",
        "rate = \"1Mbit\"\n",
        "[[links]]\nfrom = \"left\"\nto = \"right\"\ndelay = \"1ms\"\n",
        "[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { delay = \"30ms\" }\n",
    ] {
        check(&format!("{lagging}{added}"), refused);
        assert_eq!(ticks(&format!("{lagging}{added}"), &["coordination.local-lag.lag=\"30.1ms\""]), 31);
        // Of a strategy that is not in use nothing is asked.
        parse(&format!("{lagging}{added}"), &["coordination.strategy=\"average-position\""]).unwrap();
    }
    check(&lagging.replace("[[peers]]\nname = \"right\"", "[[peers]]\ntick = \"2ms\"\nname = \"right\""), refused);
    check(&lagging.replace("[[peers]]\nname = \"right\"", "[[peers]]\nuplink = { delay = \"1ms\" }\nname = \"right\""), refused);
    // New gains do not touch it.
    parse(&format!("{lagging}[[timeline]]\nat = \"1s\"\ncoordination = {{ stiffness = 100.0 }}\n"), &[]).unwrap();
    let long = "the lag is more than 10000 ticks of a peer, which it does not remember: expected at most 10000 ticks";
    for changes in [["coordination.local-lag.lag=\"10001ms\""], ["link.delay=\"1h\""]] {
        assert!(parse(&lagging, &changes).unwrap_err().to_string().contains(long), "{changes:?}");
    }
    assert_eq!(ticks(&lagging, &["coordination.local-lag.lag=\"10s\""]), 10_000);
    check_replaced(&[(
        "update = \"8ms\"",
        "update = \"8ms\"\nlocal-lag = { lag = 3 }",
        "9:21: coordination.local-lag.lag: found the integer 3: expected",
    )]);
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
        ("[[timeline]]\nat = \"1s\"\nlink = \"all\"\npeer = \"left\"\nset = { loss = 0 }", "21:1: timeline.0.peer: \"link\" is given already"),
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

#[test]
fn a_probe_pushes_with_one_sine_all_the_time() {
    let scene = |frequency: &str, more: &str| {
        let hand = format!("name = \"left\"\nhand = {{ sine = {{ amplitude = 1, frequency = {frequency} }} }}");
        format!("{}[measure]\nprobe = {{ peer = \"left\" }}\n{more}", SCENE.replacen("name = \"left\"", &hand, 1))
    };
    let measured = parse(&scene("2", ""), &[]).unwrap().measure.unwrap();
    assert_eq!((measured.settings.probe, measured.names.len()), (Some(0), crate::MeasureName::all(2).len()));
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
            "19:28: expect.loss.0.cause: unknown name \"bad-luck\": expected one of filter, mtu, outage, loss, limit, queue-full, red, codel, checksum, end-of-log",
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
fn what_is_no_toml_is_refused_in_the_same_form() {
    check_replaced(&[
        ("\"24ms\"", "24ms", "17:9: link.delay: not TOML: "),
        ("delay =", "delay", "17:7: link: not TOML: "),
        ("mass = 0.45", "mass = 0.45\nmass = 0.5", "5:1: object.mass: this key or table is there already: expected it once"),
        ("[link]", "[link]\n[link]", "17:2: link: this key or table is there already"),
        ("[link]", "[link", "16:6: link: not TOML: "),
        ("\"7s\"", "\"7s", "2:15: scene.duration: not TOML: "),
    ]);
    check("", "1:1: scene: missing key");
}

#[test]
fn of_several_faults_the_first_in_the_file_is_said() {
    let text = SCENE.replace("0.45", "-1").replace("\"24ms\"", "\"x\"").replace("\"7s\"", "\"7x\"");
    check(&text, "2:12: scene.duration: ");
    // Parts are not read in the order of the file: [scene] first, wherever it stands.
    let late = "[link]\ndelay = \"x\"\n".to_owned() + &SCENE.replace("[link]\ndelay = \"24ms\"\n", "").replace("\"7s\"", "7");
    check(&late, "2:9: link.delay: ");
    // Faults in overrides come last.
    assert!(refused(&SCENE.replace("0.45", "-1"), &["link.dlay=1"]).to_string().starts_with("x.toml:4:8: object.mass"));
}

#[test]
fn a_default_is_checked_even_where_every_peer_replaces_it() {
    let text = SCENE.replace("[peer]", "[peer]\ntick = \"fast\"").replace("name", "tick = \"1ms\"\nname");
    check(&text, "10:8: peer.tick: \"fast\" does not begin with a plain decimal number");
    let text = SCENE.replace("device = { mass = 0.1, damping = 5.0 }", "device = { damping = 5.0 }").replace("name", "device.mass = 0.1\nname");
    assert!(parse(&text, &[]).is_ok());
}

#[test]
fn an_override_that_leads_nowhere_is_refused() {
    for (given, expected) in [
        ("link.delay", "--set link.delay: no = in the override: expected KEY=VALUE"),
        ("=1", "--set =1: the key is no dotted path"),
        ("link..delay=1ms", "--set link..delay=1ms: link..delay: the key is no dotted path"),
        (
            "peers.lefft.tick=1ms",
            "--set peers.lefft.tick=1ms: peers.lefft: there is no peer \"lefft\": expected one of left, right; did you mean \"left\"?",
        ),
        ("links.left=1", "--set links.left=1: links.left: one end of a link"),
        ("links.left.nobody.delay=1ms", "--set links.left.nobody.delay=1ms: links.left.nobody.to: there is no peer \"nobody\""),
        ("timeline.3.at=1s", "--set timeline.3.at=1s: timeline.3: there is no entry \"3\": expected the place of one of its 0 entries, from 0"),
        ("link.delay.mean=1ms", "--set link.delay.mean=1ms: link.delay.mean: link.delay is the text \"24ms\" here and holds no keys"),
        ("link.delay=8 parsecs", "--set link.delay=8 parsecs: link.delay: unknown unit \"parsecs\""),
        ("object.mass=nan", "--set object.mass=nan: object.mass: nan is not finite"),
        ("object.mass=-1", "--set object.mass=-1: object.mass: -1 is out of range"),
        ("objects.mass=1", "--set objects.mass=1: objects: unknown key"),
        ("peers.left=3", "--set peers.left=3: peers.left"),
        ("scene.duration=", "--set scene.duration=: scene.duration: \"\" does not begin"),
    ] {
        let shown = refused(SCENE, &[given]).to_string();
        assert!(shown.starts_with(expected), "\nexpected {expected}\nfound    {shown}");
    }
}

#[test]
fn what_a_text_holds_does_not_reach_the_terminal_raw() {
    let shown = refused(&SCENE.replace("\"24ms\"", "\"\\u001b[31m\\u202e\""), &["x\u{1b}=1"]).to_string();
    assert!(shown.contains("\\u{1b}[31m\\u{202e}"), "{shown}");
    assert!(shown.chars().all(|c| c == '\n' || !c.is_control()));
}

#[test]
fn a_line_of_any_length_is_cut_around_the_place() {
    let text = SCENE.replace("delay = \"24ms\"", &format!("outage = [{}{{ from = 1 }}]", "{ from = \"1s\", to = \"2s\" }, ".repeat(1000)));
    let error = refused(&text, &[]);
    let place = error.diagnostic().unwrap();
    assert_eq!(place.line(), 17);
    assert!(place.shown_line().chars().count() <= 202);
    let shown = error.to_string();
    let lines: Vec<&str> = shown.lines().collect();
    let caret = lines[3].chars().position(|c| c == '^').unwrap();
    assert_eq!(lines[2].chars().nth(caret), Some('{'), "{shown}");
}

/// A process elsewhere can be simulated only from the model of a device; a live session does without.
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
    // With device and coupling it is simulated as any other.
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
