//! Scenes of very many peers, and the sparse table of links against its dense definition.

use core::time::Duration;
use std::fmt::Write as _;
use std::path::Path;

use cohaptic_scene::{ChangeKind, LinkTable, Scene};
use cohaptic_tests_common::properties;
use cohaptic_wan::LinkModel;
use proptest::prelude::*;

const MS: Duration = Duration::from_millis(1);

fn read(count: usize, rest: &str) -> Scene {
    let text = format!(
        "scene = {{ duration = \"1s\", count = {count} }}\nobject.mass = 1\n\
         coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n\
         peer = {{ contact = \"none\", device.mass = 1 }}\nlink = {{ delay = \"24ms\" }}\n{rest}"
    );
    Scene::parse(&text, Path::new("many.toml"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// A table of all links of 100,000 peers would take 80 GB, and a step for each of them minutes.
#[test]
fn a_scene_of_very_many_peers_is_read_in_no_time() {
    for count in [100_000, 300_000] {
        let scene = read(count, "[[timeline]]\nat = \"1ms\"\nlink = \"all\"\nset = { delay = \"9ms\" }\n");
        assert_eq!((scene.peers.len(), scene.peers[count - 1].name.as_str()), (count, format!("peer{count}").as_str()));
        assert!(scene.links.is_uniform());
        let used: Vec<u64> = scene.links.used().map(|(_, links)| links).collect();
        assert_eq!(used, [count as u64 * (count as u64 - 1)]);
        assert_eq!(scene.links.between(count - 1, 0).mean_delay(), 24 * MS);
        let ChangeKind::AllLinks(later) = &scene.timeline[0].what else { panic!("all links change") };
        assert!(later.is_uniform());
        assert_eq!(later.between(0, count - 1).mean_delay(), 9 * MS);
    }
}

/// A ring whose links to the next peer all differ: as many classes and exceptions as peers.
#[test]
fn a_ring_of_many_peers_is_read_in_time_that_grows_with_their_number() {
    const COUNT: usize = 20_000;
    let mut entries = String::new();
    for peer in 1..=COUNT {
        let next = peer % COUNT + 1;
        let _ = write!(entries, "[[links]]\nfrom = \"peer{peer}\"\nto = \"peer{next}\"\ndelay = \"{}us\"\n", 30_000 + peer);
    }
    let scene = read(COUNT, &format!("{entries}[[timeline]]\nat = \"1ms\"\nlink = \"all\"\nset = {{ loss = 0.5 }}\n"));
    assert_eq!((scene.links.configs().len(), scene.links.exceptions().count()), (COUNT + 1, COUNT));
    assert_eq!(scene.links.between(COUNT - 1, 0).mean_delay(), Duration::from_micros(50_000));
    let ChangeKind::AllLinks(later) = &scene.timeline[0].what else { panic!("all links change") };
    assert_eq!((later.configs().len(), later.exceptions().count()), (COUNT + 1, COUNT));
}

/// Each of many links names an unknown peer. A search for the most similar name among all peers at each fault would take minutes.
#[test]
fn many_misspelt_names_are_refused_as_fast_as_one() {
    let mut text = "scene = { duration = \"1s\", count = 20000 }\nobject.mass = 1\npeer = { contact = \"none\", device.mass = 1 }\n\
                    coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\n"
        .to_owned();
    for peer in 1..=20_000 {
        let _ = write!(text, "[[links]]\nfrom = \"peer{peer}\"\nto = \"pear{peer}\"\n");
    }
    let error = Scene::parse(&text, Path::new("many.toml"), &[]).unwrap_err().to_string();
    assert!(error.starts_with("many.toml:7:6: links.peer1.pear1.to: there is no peer \"pear1\": expected one of peer1, "), "{error}");
}

#[test]
fn a_number_of_peers_that_nobody_means_is_refused() {
    let text = "scene = { duration = \"1s\", count = 1000001 }\nobject.mass = 1\npeer = { contact = \"none\", device.mass = 1 }\n\
                coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\n";
    let error = Scene::parse(text, Path::new("many.toml"), &[]).unwrap_err().to_string();
    assert!(error.contains("an integer from 2 to 1000000"), "{error}");
}

#[test]
fn tables_are_equal_if_their_links_are() {
    let link = |millis| {
        std::sync::Arc::new(LinkModel::from(cohaptic_wan::LinkConfig { delay: cohaptic_wan::Delay::constant(millis * MS), ..Default::default() }))
    };
    let one = LinkTable::new(2, link(1), [((0, 1), link(2))]);
    let other = LinkTable::new(2, link(2), [((1, 0), link(1))]);
    assert_eq!(one, other);
    // Nothing is left of what no link has, and what is no link is left out.
    let all = LinkTable::new(3, link(9), [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2), (7, 0)].map(|pair| (pair, link(1))));
    assert_eq!(all, LinkTable::uniform(3, (*link(1)).clone()));
    assert!(all.is_uniform());
}

/// Statement of a scene about its links: `key` takes `value` on the link `ends`, or on all links for `None`.
#[derive(Clone, Copy, Debug)]
struct Said {
    ends: Option<(usize, usize)>,
    key: usize,
    value: u64,
}

fn said(peers: usize, may_be_all: bool) -> impl Strategy<Value = Said> {
    let ends = (0..peers, 0..peers - 1).prop_map(|(from, to)| (from, if to >= from { to + 1 } else { to }));
    (ends, 0..4_u8, 0..2_usize, 1..4_u64).prop_map(move |(ends, all, key, value)| Said { ends: (all > 0 || !may_be_all).then_some(ends), key, value })
}

/// Dense table of links: delay \[ms\] and limit \[packets\], indexed by sender and then by receiver.
type Dense = Vec<Vec<[u64; 2]>>;

fn lay(dense: &mut Dense, said: Said) {
    for (from, row) in dense.iter_mut().enumerate() {
        for (to, link) in row.iter_mut().enumerate() {
            if said.ends.is_none_or(|ends| ends == (from, to)) {
                link[said.key] = said.value;
            }
        }
    }
}

fn keys(said: Said) -> String {
    if said.key == 0 { format!("delay = \"{}ms\"", said.value) } else { format!("limit = \"{} packets\"", said.value) }
}

fn link(model: &LinkModel) -> [u64; 2] {
    let config = model.as_fixed().unwrap();
    [u64::try_from(config.delay.mean().as_millis()).unwrap(), config.limit.unwrap_or(0)]
}

/// Checks that both tables agree on every pair, on the order of the configurations, and on the number of links of each configuration.
fn same(table: &LinkTable, dense: &Dense) {
    let pairs = (0..dense.len()).flat_map(|from| (0..dense.len()).filter(move |to| *to != from).map(move |to| (from, to)));
    let (mut order, mut counts) = (Vec::new(), Vec::new());
    for (from, to) in pairs {
        assert_eq!(link(table.between(from, to)), dense[from][to], "{from} to {to}");
        let place = order.iter().position(|known| *known == dense[from][to]).unwrap_or(order.len());
        if place == order.len() {
            order.push(dense[from][to]);
            counts.push(0);
        }
        counts[place] += 1;
        assert_eq!(table.config_between(from, to), place);
    }
    assert_eq!(
        table.used().map(|(config, count)| (link(config), count)).collect::<Vec<_>>(),
        order.iter().copied().zip(counts.clone()).collect::<Vec<_>>()
    );
    assert_eq!(table.is_uniform(), order.len() == 1);
    assert!(counts.iter().all(|count| *count <= counts[table.usual()]));
    assert_eq!(table.exceptions().count() as u64, counts.iter().sum::<u64>() - counts[table.usual()]);
}

properties! {
    #[test]
    fn the_sparse_table_is_the_dense_one(
        (peers, entries, changes) in (2..6_usize).prop_flat_map(|peers| {
            (Just(peers), prop::collection::vec(said(peers, false), 0..24), prop::collection::vec(said(peers, true), 0..8))
        }),
    ) {
        let mut dense = vec![vec![[24, 0]; peers]; peers];
        let mut text = String::new();
        let mut named = Vec::new();
        for said in entries {
            let (from, to) = said.ends.unwrap();
            if !named.contains(&(from, to)) {
                named.push((from, to));
                let _ = write!(text, "[[links]]\nfrom = \"peer{}\"\nto = \"peer{}\"\n{}\n", from + 1, to + 1, keys(said));
                lay(&mut dense, said);
            }
        }
        for (place, said) in changes.iter().enumerate() {
            let which = said.ends.map_or_else(|| "\"all\"".to_owned(), |(from, to)| format!("{{ from = \"peer{}\", to = \"peer{}\" }}", from + 1, to + 1));
            let _ = write!(text, "[[timeline]]\nat = \"{place}ms\"\nlink = {which}\nset = {{ {} }}\n", keys(*said));
        }
        let scene = read(peers, &text);
        same(&scene.links, &dense);
        for (change, said) in scene.timeline.iter().zip(changes) {
            lay(&mut dense, said);
            if let ChangeKind::AllLinks(table) = &change.what {
                prop_assert_eq!(said.ends, None);
                same(table, &dense);
            } else if let ChangeKind::Link(change) = &change.what {
                prop_assert_eq!(said.ends, Some((change.from, change.to)));
                prop_assert_eq!(link(&change.config), dense[change.from][change.to]);
            } else {
                panic!("{:?}", change.what);
            }
        }
    }
}
