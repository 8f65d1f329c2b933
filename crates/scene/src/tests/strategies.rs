//! Tests of strategies and of their parameters: refused combinations, and parameters that depend on the links.

use std::path::Path;
use std::time::Duration;

use cohaptic_peer::coordination::Law;
use cohaptic_peer::{Coordination, Gains};

use super::{SCENE, check, check_replaced, parse};
use crate::{Change, ChangeKind, Scene};

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
        ("client-server.returns", "\"nothing\"", "coordination.client-server.returns: unknown name \"nothing\": expected one of force, object, none"),
        ("client-server.sends", "\"motions\"", "coordination.client-server.sends: unknown name \"motions\": expected one of states, increments"),
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
        // Parameters of a strategy that is not in use have no conditions.
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
    // ⌈24 ms/1 ms⌉ + ⌊(8 − 1)/2⌋ = 27; a delay that ends between two ticks, rounded up; a sample at every tick.
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
        // Parameters of a strategy that is not in use have no conditions.
        parse(&format!("{lagging}{added}"), &["coordination.strategy=\"average-position\""]).unwrap();
    }
    check(&lagging.replace("[[peers]]\nname = \"right\"", "[[peers]]\ntick = \"2ms\"\nname = \"right\""), refused);
    check(&lagging.replace("[[peers]]\nname = \"right\"", "[[peers]]\nuplink = { delay = \"1ms\" }\nname = \"right\""), refused);
    // New gains do not change the lag.
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
