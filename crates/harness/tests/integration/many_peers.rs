//! Scenes with so many peers that a list of all links would not fit into memory.

use cohaptic_harness::record::links_csv;
use cohaptic_harness::{Model, NoObserver, Simulation, Summary, too_large};
use cohaptic_scene::Scene;

/// Runs a scene of `peers` peers with copies of 1 kg over a constant delay of 24 ms. The first peer begins 0.5 m away from all others.
fn run(peers: usize, duration: &str, link: &str) -> Summary {
    let text = format!(
        "scene = {{ duration = \"{duration}\", count = {peers} }}\nobject = {{ mass = {peers}.0, damping = 1.0 }}\nlink = {{ delay = \"24ms\", {link} }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 500.0, update = \"8ms\" }}\n\
         peer = {{ contact = \"none\", device.mass = 0.1 }}\npeers = [{{ name = \"peer1\", position = 0.5 }}]\n"
    );
    let scene = Scene::parse(&text, "many.toml".as_ref(), &[]).unwrap();
    assert_eq!(too_large(&scene, Model::Least, false), None);
    let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
    summary
}

/// The scene has 10¹⁰ links, a number beyond 32 bits, between a number of peers beyond 16 bits.
#[test]
fn a_hundred_thousand_peers_run_and_their_links_are_counted() {
    const PEERS: usize = 100_000;
    let summary = run(PEERS, "33ms", "");
    assert_eq!((summary.ticks, summary.peers.len(), summary.links.len()), (33, PEERS, 9_999_900_000));
    // Sent at 0, 8, 16, 24 and 32 ms; there by 33 ms are those of 0 and 8 ms.
    let total = summary.links.total();
    assert_eq!((total.offered(), total.delivered(), total.in_flight()), (5 * 9_999_900_000, 2 * 9_999_900_000, 3 * 9_999_900_000));
    assert_eq!(summary.links.delivered_fraction().unwrap().p50, 0.4);
    assert_eq!(summary.links.mean_delay().unwrap().max, 0.024);
    // The others hold one and the same mean, and the first is drawn to where they are.
    let at = |peer: usize| summary.peers[peer].position[0];
    assert!((2..PEERS).all(|peer| at(peer) == at(1)));
    assert!(at(1) > 0.0 && at(1) < 0.5 / 99_999.0 && at(0) > 0.3 && at(0) < 0.5, "{} {}", at(0), at(1));
}

/// A table with an entry per link and a table with an entry per sender are written as the same text, which has every link.
#[test]
fn each_link_is_written_however_links_are_kept() {
    let text = |summary: &Summary| {
        let mut text = Vec::new();
        links_csv(summary, |rows| -> Result<(), std::convert::Infallible> {
            text.extend_from_slice(rows);
            Ok(())
        })
        .unwrap();
        String::from_utf8(text).unwrap()
    };
    // An order of packets that is none makes a link one by itself.
    let (together, each) = (run(40, "33ms", ""), run(40, "33ms", "loss = 1e-300"));
    assert_eq!(together.links, each.links);
    assert_eq!(text(&together), text(&each));
    let rows: Vec<String> = text(&together).lines().map(str::to_owned).collect();
    assert_eq!(rows.len(), 1 + 40 * 39);
    assert_eq!(rows[1].split(',').take(4).collect::<Vec<_>>(), ["peer1->peer2", "5", "0", "2"]);
    assert!(rows.last().unwrap().starts_with("peer40->peer39,5,0,2,") && rows.last().unwrap().ends_with(",3,0,0,0.024"));
    // What could not be written is not gone on with.
    let mut pieces = 0;
    let refuse = |_: &[u8]| {
        pieces += 1;
        Err("full")
    };
    assert_eq!((links_csv(&together, refuse), pieces), (Err("full"), 1));
}
