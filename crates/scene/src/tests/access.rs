//! Tests of access lines from the library of links.

use cohaptic_wan::LinkModel;

use super::{SCENE, check_replaced, parse};

/// Returns the name of the modulator of a line.
fn modulator(line: Option<&LinkModel>) -> &str {
    let Some(LinkModel::Modulated(modulated)) = line else { panic!("a line without a modulator: {line:?}") };
    modulated.modulator().name()
}

/// The uplink and the downlink of a peer change state together, those of two peers apart, also where both have the keys of `[peer]`.
#[test]
fn each_peer_has_a_line_of_its_own() {
    let scene = parse(SCENE, &["peer.access=starlink"]).unwrap();
    let lines: Vec<[&str; 2]> = scene.peers.iter().map(|peer| [&peer.uplink, &peer.downlink].map(|line| modulator(line.as_deref()))).collect();
    assert!(lines.iter().all(|[up, down]| up == down), "{lines:?}");
    assert_ne!(lines[0][0], lines[1][0]);
    assert_eq!(scene.peers[0].uplink, parse(SCENE, &["peer.uplink.profile=starlink/up"]).unwrap().peers[0].uplink);
}

#[test]
fn keys_are_laid_over_the_access_line() {
    let scene = parse(SCENE, &["peer.access=cable", "peer.downlink.rate=1Mbit"]).unwrap();
    let alone = parse(SCENE, &["peer.uplink.profile=cable/up", "peer.downlink.profile=cable/down", "peer.downlink.rate=1Mbit"]).unwrap();
    assert_eq!(scene.peers, alone.peers);
    assert_eq!(parse(SCENE, &["peer.access=none"]).unwrap().peers, parse(SCENE, &[]).unwrap().peers);
    // A profile under `downlink` stands in place of the one of `access`.
    let other = parse(SCENE, &["peer.access=cable", "peer.downlink.profile=dsl/down"]).unwrap();
    assert_eq!(other.peers[0].downlink, parse(SCENE, &["peer.access=dsl"]).unwrap().peers[0].downlink);
}

#[test]
fn a_wrong_name_is_refused_where_it_stands() {
    check_replaced(&[
        ("[peer]", "[peer]\naccess = \"starlnk\"", "10:10: peer.access: no link of the library is called \"starlnk\": expected one of"),
        ("[peer]", "[peer]\naccess = \"starlink/up\"", "10:10: peer.access: an access line has both directions: expected \"starlink@1\""),
        ("[peer]", "[peer]\naccess = 3", "10:10: peer.access: found the integer 3: expected the name of a link of the library"),
    ]);
}

/// Keys of one table are laid over the profile in any order, and a whole description cannot stand beside a profile but over one.
#[test]
fn a_profile_of_links_lies_below_the_keys_of_its_table() {
    let links = |text: &str| SCENE.replace("delay = \"24ms\"", text);
    let between = |text: &str| parse(&links(text), &[]).unwrap_or_else(|error| panic!("{error}")).links.between(0, 1).clone();
    let slow = between("delay = \"7ms\"\nprofile = \"cable/up\"");
    assert_eq!(slow, between("profile = \"cable/up\"\ndelay = \"7ms\""));
    assert_eq!(slow, between("delay = \"7ms\"\norder = \"in-order\""));
    let over = "profile = \"cable/up\"\n[[links]]\nfrom = \"left\"\nto = \"right\"\nnetem = \"delay 5ms\"";
    assert_eq!(between(over), between("netem = \"delay 5ms\""));
    let below = "netem = \"delay 5ms\"\n[[links]]\nfrom = \"left\"\nto = \"right\"\nprofile = \"cable/up\"";
    assert_eq!(between(below), between("profile = \"cable/up\""));
    check_replaced(&[(
        "delay = \"24ms\"",
        "netem = \"delay 5ms\"\nprofile = \"cable/up\"",
        "18:1: link.profile: profile and netem exclude each other: expected only one of them, or netem = \"none\"",
    )]);
}
