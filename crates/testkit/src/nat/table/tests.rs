//! Mappings, filters and ports.

use super::*;
use crate::nat::parse_words;

const OUTER: u32 = 4;

fn endpoint(address: u32, port: u16) -> Endpoint {
    Endpoint { address, port }
}

fn flow(source: Endpoint, destination: Endpoint) -> Flow {
    Flow { protocol: Protocol::Udp, is_six: false, source, destination, signs: Signs::default() }
}

fn at(seconds: u64) -> Instant {
    Instant::from_nanos(seconds * 1_000_000_000)
}

fn table(words: &str) -> Table {
    Table::new(parse_words(words, Behaviour::default(), true).unwrap(), true, 7, "nat")
}

#[test]
fn a_filter_lets_in_the_endpoints_of_its_dependence() {
    let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
    for (words, expected) in [
        ("filter endpoint-independent", [true, true, true]),
        ("filter address-dependent", [true, true, false]),
        ("filter address-and-port-dependent", [true, false, false]),
    ] {
        let mut table = table(words);
        let external = table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
        assert_eq!(external, endpoint(OUTER, 5000));
        let passes = [remote, endpoint(1, 8), endpoint(2, 7)].map(|from| table.inbound(at(1), &flow(from, external)) == Ok(inside));
        assert_eq!(passes, expected, "{words}");
        assert_eq!(table.inbound(at(1), &flow(remote, endpoint(OUTER, 5001))), Err(Lost::NoMapping));
        assert_eq!(table.filtered, 1 + expected.iter().filter(|passes| !**passes).count() as u64);
    }
}

#[test]
fn a_mapping_is_shared_by_the_endpoints_of_its_dependence() {
    let inside = endpoint(100, 5000);
    for (words, expected) in [
        ("mapping endpoint-independent", [true, true, true]),
        ("mapping address-dependent", [true, true, false]),
        ("mapping address-and-port-dependent", [true, false, false]),
    ] {
        for ports in ["kept", "random"] {
            let mut table = table(&format!("{words} ports {ports}"));
            let mut to = |remote| table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
            let first = to(endpoint(1, 7));
            assert_eq!(first == endpoint(OUTER, 5000), ports == "kept");
            let same = [endpoint(1, 7), endpoint(1, 8), endpoint(2, 7)].map(|remote| to(remote) == first);
            assert_eq!(same, expected, "{words}");
        }
    }
}

#[test]
fn a_port_is_free_again_when_its_mapping_has_ended() {
    let mut table = table("home");
    let remote = endpoint(1, 7);
    let kept = table.outbound(at(0), &flow(endpoint(100, 5000), remote), OUTER).unwrap();
    let other = table.outbound(at(1), &flow(endpoint(101, 5000), remote), OUTER).unwrap();
    assert_eq!((kept.port, table.has_drawn()), (5000, true));
    assert!(other.port >= FIRST && other.port != 5000);
    // Thirty seconds without an answer end a mapping.
    assert_eq!(table.inbound(at(30), &flow(remote, kept)), Err(Lost::NoMapping));
    assert_eq!(table.inbound(at(30), &flow(remote, other)), Ok(endpoint(101, 5000)));
    let later = table.outbound(at(30), &flow(endpoint(102, 5000), remote), OUTER).unwrap();
    assert_eq!(later.port, 5000);
    assert_eq!(table.listed(at(30)).len(), 2);
    table.forget();
    assert!(table.listed(at(30)).is_empty());
    assert_eq!(table.inbound(at(30), &flow(remote, other)), Err(Lost::NoMapping));
}

#[test]
fn all_ports_can_be_given_and_no_more() {
    let mut table = table("home");
    let remote = endpoint(1, 7);
    let ports = (FIRST..=u16::MAX - 1).map(|port| table.outbound(at(0), &flow(endpoint(100, port), remote), OUTER).unwrap().port);
    assert!(ports.eq(FIRST..=u16::MAX - 1));
    // The first drawing finds the last free port, and the second finds no port.
    let drawn = table.outbound(at(0), &flow(endpoint(101, FIRST), remote), OUTER).unwrap();
    assert_eq!((drawn.port, table.has_drawn()), (u16::MAX, true));
    assert_eq!(table.outbound(at(0), &flow(endpoint(102, FIRST), remote), OUTER), Err(Lost::NoMapping));
    table.outbound(at(30), &flow(endpoint(70_000, 1), remote), OUTER).unwrap();
    assert_eq!(table.listed(at(30)).len(), 1);
}

#[test]
fn memory_follows_the_mappings_that_are_alive() {
    let mut table = table("home udp-unanswered-timeout 1s");
    // Each host has another port, so that no mapping takes over the port of an ended mapping.
    for host in 0..1000_u16 {
        table.outbound(at(host.into()), &flow(endpoint(host.into(), 1 + host), endpoint(1, 7)), OUTER).unwrap();
    }
    assert!(table.mappings.len() <= FEW + 1 && table.externals.len() == table.mappings.len());
    // The sessions of a mapping as well.
    for port in 0..1000 {
        table.outbound(at((1000 + port).into()), &flow(endpoint(1, 1), endpoint(1, port)), OUTER).unwrap();
    }
    let most = table.mappings.values().map(|mapping| mapping.sessions.len()).max().unwrap();
    assert!(most <= FEW + 1, "{most}");
}

#[test]
fn a_firewall_and_version_6_translate_nothing() {
    let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
    let mut nat = table("strict");
    let six = Flow { is_six: true, ..flow(inside, remote) };
    assert_eq!(nat.outbound(at(0), &six, OUTER), Ok(inside));
    assert_eq!(nat.inbound(at(1), &Flow { is_six: true, ..flow(remote, inside) }), Ok(inside));
    assert_eq!(nat.inbound(at(1), &Flow { is_six: true, ..flow(endpoint(1, 8), inside) }), Err(Lost::Filtered));
    let mut wall = Table::new(Behaviour::default(), false, 7, "wall");
    assert_eq!(wall.outbound(at(0), &flow(inside, remote), OUTER), Ok(inside));
    assert_eq!(wall.inbound(at(1), &flow(remote, inside)), Ok(inside));
    assert_eq!(wall.inbound(at(1), &flow(remote, endpoint(101, 5000))), Err(Lost::NoMapping));
}

#[test]
fn an_error_message_refreshes_nothing() {
    let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
    let mut table = table("udp-timeout 10s");
    let external = table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
    assert_eq!(table.error_in(at(9), &flow(remote, external)), Ok(inside));
    assert_eq!(table.error_out(at(9), &flow(inside, remote)), Ok(external));
    assert_eq!(table.error_in(at(10), &flow(remote, external)), Err(Lost::NoMapping));
    assert_eq!(table.error_out(at(10), &flow(inside, remote)), Err(Lost::NoMapping));
    // The dropped message from outside counts as filtered.
    assert_eq!(table.filtered, 1);
}

/// Packets after the end of a session begin a new session, also where another session has kept the mapping.
#[test]
fn an_ended_session_begins_anew() {
    let [inside, one, other] = [endpoint(100, 5000), endpoint(1, 7), endpoint(2, 7)];
    let mut table = table("home");
    let external = table.outbound(at(0), &flow(inside, one), OUTER).unwrap();
    table.inbound(at(1), &flow(one, external)).unwrap();
    table.outbound(at(290), &flow(inside, other), OUTER).unwrap();
    table.inbound(at(291), &flow(other, external)).unwrap();
    // The first session has ended after 300 s. The new session has no answer yet, and lives for 30 s.
    assert_eq!(table.outbound(at(310), &flow(inside, one), OUTER), Ok(external));
    let remotes = |second| table.listed(at(second)).into_iter().flat_map(|(.., remotes)| remotes).collect::<Vec<_>>();
    assert_eq!((remotes(339), remotes(340)), (vec![one, other], vec![other]));
}

#[test]
fn a_segment_of_no_connection_is_dropped() {
    let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
    let mut table = table("home");
    let segment = |source, destination, syn| Flow { protocol: Protocol::Tcp, signs: Signs { syn, ..Signs::default() }, ..flow(source, destination) };
    assert_eq!(table.outbound(at(0), &segment(inside, remote, false), OUTER), Err(Lost::NoMapping));
    let external = table.outbound(at(0), &segment(inside, remote, true), OUTER).unwrap();
    assert_eq!(table.inbound(at(1), &segment(remote, external, true)), Ok(inside));
    // The connection is established, and lives for 7440 s.
    assert_eq!(table.outbound(at(7439), &segment(inside, remote, false), OUTER), Ok(external));
    assert_eq!(table.inbound(at(7439 + 7440), &segment(remote, external, false)), Err(Lost::NoMapping));
    assert_eq!(table.outbound(at(7439 + 7440), &segment(inside, remote, false), OUTER), Err(Lost::NoMapping));
}
