//! Tests of `[topology]`: defaults, gains and links of a topology, and refused topologies.

use std::path::Path;

use cohaptic_peer::Gains;

use super::{check, parse};
use crate::{Scene, TopologyKind};

/// Returns a scene of four peers. The keys of `[topology]` begin in line 6.
fn four(topology: &str) -> String {
    format!(
        "scene = {{ duration = \"1s\", count = 4 }}\nobject.mass = 1\n\
         coordination = {{ strategy = \"average-position\", stiffness = 8, damping = 1, update = \"8ms\" }}\n\
         peer = {{ device.mass = 0.1, coupling.stiffness = 100 }}\n[topology]\n{topology}\n"
    )
}

fn scene(topology: &str, overrides: &[&str]) -> Scene {
    parse(&four(topology), overrides).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_topology_is_read_with_its_defaults() {
    let kind = |topology| scene(topology, &[]).topology.map(|topology| topology.kind());
    assert_eq!(kind(""), None);
    assert_eq!(kind("kind = \"full\""), None);
    assert_eq!(kind("kind = \"ring\""), Some(TopologyKind::Ring { neighbours: 2 }));
    assert_eq!(kind("kind = \"star\""), Some(TopologyKind::Star { hub: 0 }));
    assert_eq!(kind("kind = \"star\"\nhub = \"peer3\"\nrole = \"peer\""), Some(TopologyKind::Star { hub: 2 }));
}

/// A sum counts the peers that are heard: three at the hub, and the hub alone elsewhere. Scaling counts all four peers: 4·3/16.
#[test]
fn sums_are_over_neighbours_and_scaling_is_by_all() {
    let gains = |overrides: &[&str]| {
        let scene = scene("kind = \"star\"", overrides);
        [0, 1].map(|peer| scene.coordination_gains(scene.coordination.gains, peer))
    };
    let times = |factors: [f64; 2]| factors.map(|factor| Gains { stiffness: 8.0 * factor, damping: factor });
    assert_eq!(gains(&[]), times([1.0, 1.0]));
    assert_eq!(gains(&["coordination.pull=sum"]), times([3.0, 1.0]));
    assert_eq!(gains(&["coordination.strategy=proportional-derivative", "coordination.scaling=inverse-n"]), times([2.25, 0.75]));
    let full = parse(&four(""), &["coordination.pull=sum"]).unwrap();
    assert_eq!(full.coordination_gains(full.coordination.gains, 2), Gains { stiffness: 24.0, damping: 3.0 });
}

#[test]
fn links_are_those_of_neighbours() {
    let entry = "kind = \"star\"\n[[links]]\nfrom = \"peer1\"\nto = \"peer2\"\ndelay = \"9ms\"";
    let star = scene(entry, &[]);
    assert_eq!((star.link_count(), star.linked_pairs().count()), (6, 6));
    let used: Vec<u64> = star.used_links().into_iter().map(|(_, count)| count).collect();
    assert_eq!(used, [1, 5]);
    assert_eq!(parse(&four(""), &[]).unwrap().link_count(), 12);
}

#[test]
fn what_is_no_topology_is_refused_at_its_place() {
    for (topology, expected) in [
        ("kind = \"mesh\"", "6:8: topology.kind: unknown name \"mesh\": expected one of full, star, ring, graph"),
        ("kind = \"ring\"\nneighbours = 3", "7:14: topology.neighbours: 3 neighbours cannot lie half on either side: expected an even number"),
        (
            "kind = \"ring\"\nneighbours = 4",
            "7:14: topology.neighbours: 4 peers on a ring with 4 neighbours each: expected an even number of neighbours, fewer",
        ),
        ("kind = \"ring\"\nneighbours = 0", "7:14: topology.neighbours: "),
        ("neighbours = 2", "6:14: topology.neighbours: only a topology of kind = \"ring\" has this key: expected that kind, or no such key"),
        ("kind = \"star\"\nhub = \"peer9\"", "7:7: topology.hub: there is no peer \"peer9\": expected"),
        (
            "kind = \"star\"\nhub = \"peer1\"\nrole = \"relay\"",
            "7:7: topology.hub: a relay passes on what it hears and is not a peer: expected no hub",
        ),
        ("kind = \"ring\"\nrole = \"relay\"", "7:8: topology.role: only a topology of kind = \"star\" has this key"),
        ("kind = \"graph\"", "6:1: topology.file: missing key"),
        ("kind = \"ring\"\nfile = \"x.csv\"", "7:8: topology.file: only a topology of kind = \"graph\" has this key"),
    ] {
        let expected = expected.replacen("6:1: topology.file", "5:1: topology.file", 1);
        check(&four(topology), &expected);
    }
}

#[test]
fn links_that_there_are_none_of_are_refused_wherever_they_are_named() {
    let why = "\"peer2\" does not send to \"peer3\" in this topology, so there is no such link: expected neighbours, or another [topology]";
    for (rest, place) in [
        ("[[links]]\nfrom = \"peer2\"\nto = \"peer3\"\ndelay = \"1ms\"", "9:6: links.peer2.peer3.to"),
        ("[[timeline]]\nat = \"1ms\"\nlink = { from = \"peer2\", to = \"peer3\" }\nset = { delay = \"1ms\" }", "9:31: timeline.0.link.to"),
        ("[expect]\nloss = [{ link = { from = \"peer2\", to = \"peer3\" }, max = 1 }]", "8:41: expect.loss.0.link.to"),
    ] {
        check(&four(&format!("kind = \"star\"\n{rest}")), &format!("{place}: {why}"));
    }
}

#[test]
fn strategies_that_need_all_others_are_refused() {
    for strategy in ["passivity-control", "set-position", "wave", "client-server"] {
        let error =
            Scene::parse(&four("kind = \"star\""), Path::new("x.toml"), &[format!("coordination.strategy={strategy}")]).unwrap_err().to_string();
        assert!(
            error.starts_with("x.toml:5:1: topology: ") && error.contains(&format!("the strategy {strategy} has every peer hear every other")),
            "{error}"
        );
    }
    let turning = ["scene.axes=3", "object.inertia=[1, 1, 1]", "object.position=0"].map(str::to_owned);
    let error = Scene::parse(&four("kind = \"ring\""), Path::new("x.toml"), &turning).unwrap_err().to_string();
    assert!(error.contains("an object that turns is followed only where all peers send to all"), "{error}");
}

/// With a relay every peer still hears every other peer, and gains do not change.
#[test]
fn a_relay_is_no_peer() {
    let star = scene("kind = \"star\"\nrole = \"relay\"", &[]);
    assert_eq!((star.relay, star.topology.as_ref(), star.link_count()), (true, None, 12));
    let full = parse(&four(""), &[]).unwrap();
    assert!(!full.relay && !scene("kind = \"star\"\nrole = \"peer\"", &[]).relay);
    assert_eq!(star.coordination_gains(star.coordination.gains, 1), full.coordination_gains(full.coordination.gains, 1));
    // Fingerprints are made of this text, so that a scene without a relay must not print the field.
    assert!(format!("{star:?}").contains("relay: true") && !format!("{full:?}").contains("relay"));
    for strategy in ["wave", "client-server"] {
        let overrides = [format!("coordination.strategy={strategy}"), "coordination.wave.impedance=1".to_owned()];
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).take(if strategy == "wave" { 2 } else { 1 }).collect();
        let error = parse(&four("kind = \"star\"\nrole = \"relay\""), &overrides).unwrap_err().to_string();
        assert!(error.contains("a relay hands one on to all"), "{error}");
    }
}
