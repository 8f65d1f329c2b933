//! Tests of peers with an Inverse3: the keys, and the exchanges of the kind.

use std::time::Duration;

use cohaptic_peer::Exchange;

use super::{SCENE, parse, refused};
use crate::{Inverse3Device, Inverse3Spec, PeerKind, Scene, Silence};

/// The scene with peers of the kind.
fn scene() -> String {
    SCENE.replace("[peer]\n", "[peer]\nkind = \"inverse3\"\n")
}

fn spec(overrides: &[&str]) -> Inverse3Spec {
    let scene = parse(&scene(), overrides).unwrap();
    let found = scene.peers.iter().find_map(|peer| if let PeerKind::Inverse3(_, spec) = &peer.kind { Some(spec.clone()) } else { None });
    found.unwrap_or_else(|| panic!("{scene:?}"))
}

#[test]
fn an_inverse3_has_usable_defaults_and_its_keys_are_read() {
    let usual = spec(&[]);
    assert_eq!(usual, Inverse3Spec::default());
    assert_eq!((usual.service.to_string(), usual.device, usual.force_limit), ("127.0.0.1:10001".to_owned(), Inverse3Device::First, 2.0));
    assert_eq!((usual.origin, usual.reading_age), (None, None));
    let keys = [
        "peer.inverse3={ service = 'ws://[::1]:9000', device = '04C3', origin = [0, 0.1, 0.2] }",
        "peer.inverse3.force-limit=10",
        "peer.inverse3.reading-age=20ms",
    ];
    let read = spec(&keys);
    assert_eq!((read.service.to_string(), read.device), ("[::1]:9000".to_owned(), Inverse3Device::Id("04C3".to_owned())));
    assert_eq!((read.origin, read.force_limit, read.reading_age), (Some([0.0, 0.1, 0.2]), 10.0, Some(Duration::from_millis(20))));
    assert_eq!(spec(&["peer.inverse3.service=ws://localhost:10001/"]).service, usual.service);
    assert_eq!(spec(&["peer.inverse3.device=simulated"]).device, Inverse3Device::Simulated);
}

#[test]
fn keys_that_make_no_sense_are_refused() {
    for (keys, expected) in [
        (
            "peer.inverse3.service=ws://192.0.2.1:10001/",
            "192.0.2.1 is not an address of this machine: expected a service here, or a peer of kind \"udp\"",
        ),
        ("peer.inverse3.service=http://127.0.0.1:10001/", "is not the address of a service: expected an address of this machine"),
        ("peer.inverse3.service=ws://127.0.0.1/", "is not the address of a service"),
        ("peer.inverse3.service=ws://127.0.0.1:0/", "is not the address of a service"),
        ("peer.inverse3.device=''", "is not an id"),
        ("peer.inverse3.device='a b'", "is not an id"),
        ("peer.inverse3.origin=[0, 0]", "found a list of 2 numbers"),
        ("peer.inverse3.force-limit=0", "out of range"),
        ("peer.inverse3.force-limit=10.1", "10.1 N is more than the device is known to bear: expected at most 10 N"),
        ("peer.inverse3.reading-age=0ms", "zero is out of range"),
        ("peer.inverse3.reading-age=2s", "expected at most \"1s\""),
        ("peer.inverse3.speed=1", "unknown key"),
    ] {
        let error = refused(&scene(), &[keys]).to_string();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

fn exchanges(text: &str, overrides: &[&str]) -> Vec<Exchange> {
    parse(text, overrides).unwrap().peers.iter().map(|peer| peer.exchange).collect()
}

/// A reading of a service is an exchange old: 1 is the default of the kind, and 0 remains possible.
#[test]
fn readings_are_an_exchange_old_unless_the_scene_says_otherwise() {
    let late = |every| Exchange { every, late: true };
    assert_eq!(exchanges(&scene(), &["peer.kind=inverse3"]), [late(1), late(1)]);
    assert_eq!(exchanges(&scene(), &["peer.kind=inverse3", "peer.device.exchange-every=4"]), [late(4), late(4)]);
    assert_eq!(exchanges(&scene(), &["peer.kind=inverse3", "peer.device.exchange-age=0"]), [Exchange::EACH_TICK; 2]);
    let turns = ["scene.axes=3", "object.inertia=0.001"];
    for overrides in [&["peer.compute-delay=1"][..], &turns, &["coordination.strategy=client-server"]] {
        let all = [&["peer.kind=inverse3"][..], overrides].concat();
        refused(&scene(), &all);
        parse(&scene(), &[&all[..], &["peer.device.exchange-age=0"]].concat()).unwrap();
    }
}

/// No mass of the device is published, so that virtual time needs one from the scene; a session has the device itself.
#[test]
fn virtual_time_needs_a_device() {
    let bare = scene().replace("device = { mass = 0.1, damping = 5.0 }\n", "");
    let overrides = ["peer.kind=inverse3"];
    let error = refused(&bare, &overrides).to_string();
    assert!(error.contains("peers.left.device: missing key") && error.contains("no mass of the device is published"), "{error}");
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let live = Scene::parse_live(&bare, std::path::Path::new("scene.toml"), &overrides).unwrap();
    assert_eq!(live.peers[0].exchange, Exchange { every: 1, late: true });
    assert_eq!((live.peers[0].kind.name(), live.peers[0].kind.silence()), ("inverse3", Some(Silence::default())));
}

#[test]
fn an_inverse3_has_a_person_and_no_torque() {
    let turning = ["peer.kind=inverse3", "peer.device.exchange-age=0", "scene.axes=3", "object.inertia=0.001", "peer.device.inertia=0.001"];
    let all = [&turning[..], &["peer.coupling.rotational-stiffness=1"]].concat();
    let error = refused(&scene(), &all).to_string();
    assert!(error.contains("an Inverse3 turns nothing"), "{error}");
}
