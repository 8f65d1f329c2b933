//! A program joins, leaves, and joins again from elsewhere; the record says the same as the emulator alone, and as the clock on the wall.

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::time::{Duration, Instant as Wall};

use cohaptic_live::Place;
use cohaptic_live::client::{ClientConfig, SessionInfo};
use cohaptic_scene::Scene;
use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::{Fate, Network, NetworkConfig, NodeId, PacketInfo};
use serde_json::{Value, json};

use super::http::Control;
use super::jump::assert_no_jump;
use super::peer::{Account, Peer, SESSION};
use super::records::{Input, Packet, assert_counted, assert_replays, inputs, packets, releases};
use super::session::Session;
use super::wait_for;
use crate::integration::desk::Desk;

/// Scene of a user who moves, a program, and a user who holds the object at a place. All links have random delays and losses.
pub(super) const SCENE: &str = r#"
scene        = { duration = "1h", seed = 7 }
object       = { mass = 0.45, damping = 1.0 }
coordination = { strategy = "average-position", stiffness = 600.0, damping = 5.0, update = "8ms" }
peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 800.0, damping = 5.0 }, silence = { after = "150ms", fade = "250ms" } }
link         = { delay = "12ms", jitter = "6ms", loss = "10%" }

[[peers]]
name = "left"
hand = { arm = { mass = 0.4, damping = 5.0, stiffness = 300.0 }, follows = { sine = { amplitude = 0.02, frequency = 0.7 } } }

[[peers]]
name = "right"
kind = "udp"

[[peers]]
name = "third"
hand = { arm = { mass = 0.4, damping = 5.0, stiffness = 300.0 } }

[[links]]
from = "right"
to   = "left"
jitter = { sd = "6.5ms", distribution = "uniform" }
loss = { gilbert-elliott = { p = 0.05, r = 0.3 } }
"#;

/// Positions of the program's copy in its first and in its second visit [m].
const PLACES: [f64; 2] = [0.01, 0.06];
const UPDATE: usize = 8_000_000;

pub(super) fn keyless(peers: u32) -> ClientConfig {
    let (tick, update) = (Duration::from_millis(1), Duration::from_millis(8));
    ClientConfig::Keyless { session: SESSION, place: Place(1), info: SessionInfo { axes: 1, peers, tick, update } }
}

/// Runs the session of this file. Returns its document, and the samples of the program in its two visits, each from a port of its own.
fn visited(desk: &Desk) -> (Value, [Account; 2]) {
    let mut session = Session::begin(desk, "scene.toml --json --out out --listen 127.0.0.1:0 --control");
    let (door, control) = (session.address(), session.control());
    let state = control.state();
    assert_eq!((&state["peers"][1]["status"], &state["peers"][1]["age_s"]), (&json!("absent"), &json!(null)));
    let first = stays(&control, door, PLACES[0]);
    // Who is present was heard within the 150 ms after which he counts as silent; who is simulated here is not heard.
    let state = control.wait_status(1, "present");
    assert!(state["peers"][1]["age_s"].as_f64().is_some_and(|age| (0.0..0.15).contains(&age)) && state["peers"][0]["age_s"].is_null(), "{state}");
    first.fall_silent();
    let state = control.wait_status(1, "stale");
    // It was heard, and not within the last 150 ms.
    assert!(state["peers"][1]["age_s"].as_f64().is_some_and(|age| age >= 0.15), "{state}");
    wait_for("its pull to have faded", || (control.state()["peers"][1]["age_s"].as_f64()? > 0.45).then_some(()));
    let second = stays(&control, door, PLACES[1]);
    control.wait("the program is where it says", |state| state["peers"][1]["position"][0] == json!(PLACES[1]));
    let document = session.end();
    (document, [first.end(), second.end()])
}

/// Starts a peer, and waits until samples have passed both ways for so long that its pull is whole.
fn stays(control: &Control, door: SocketAddr, place: f64) -> Peer {
    let delivered = control.delivered(2);
    let peer = Peer::begin(keyless(3), door, place);
    control.wait_status(1, "present");
    wait_for("samples on both ways", || (control.delivered(2) > delivered + 40 && peer.so_far().received.len() > 60).then_some(()));
    peer
}

/// Returns the offers to the links: the instants of the samples in order, by sender.
fn offers(inputs: &[Input], end: u64) -> BTreeMap<usize, Vec<u64>> {
    let grid: Vec<u64> = (0..=end).step_by(UPDATE).collect();
    let heard = inputs.iter().filter(|row| row.kind == "sample").map(|row| row.at).collect();
    [(0, grid.clone()), (1, heard), (2, grid)].into()
}

/// Returns the fates of the same offers until `end`, in a network of the same links in virtual time and without a scene.
fn in_virtual_time(desk: &Desk, offers: &BTreeMap<usize, Vec<u64>>, end: u64) -> BTreeSet<(String, u64, u64, Option<u64>, String)> {
    let scene = Scene::read_live(&desk.path("scene.toml"), &[]).unwrap();
    let names: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
    let config = NetworkConfig { seed: scene.seed, nodes: names.clone(), general: false };
    let mut network = Network::<()>::new(config, |from, to| scene.links.between(from.index(), to.index()).clone());
    let mut order: Vec<(u64, usize)> = offers.iter().flat_map(|(from, sent)| sent.iter().map(|at| (*at, *from))).collect();
    order.sort_unstable();
    let mut seen = BTreeSet::new();
    let info = PacketInfo { size: Bytes::new(64), ecn: Ecn::Capable0 };
    let mut drain = |network: &mut Network<()>| {
        while let Some(event) = network.poll_event() {
            let link = format!("{}->{}", names[event.path.from.index()], names[event.path.to.index()]);
            let arrived = if let Fate::Delivered(at) = event.fate { Some(at.as_nanos()) } else { None };
            seen.insert((link, event.sequence, event.offered.as_nanos(), arrived, event.fate.name().to_owned()));
        }
    };
    for (at, from) in order {
        for to in (0..3).filter(|to| *to != from) {
            let node = |place: usize| NodeId::new(place);
            network.handle_packet(Instant::from_nanos(at), node(from), node(to), info, ()).unwrap();
        }
        drain(&mut network);
    }
    network.handle_timeout(Instant::from_nanos(end)).unwrap();
    drain(&mut network);
    seen
}

fn as_seen(packet: &Packet) -> (String, u64, u64, Option<u64>, String) {
    (packet.link.clone(), packet.sequence, packet.sent, packet.arrived, packet.fate.clone())
}

#[test]
fn it_comes_goes_and_comes_back_and_the_record_is_the_whole_truth() {
    let desk = Desk::with("scene.toml", SCENE);
    let (document, accounts) = visited(&desk);
    assert_eq!(document["ending"], "interrupted");
    assert_replays(&desk, "scene.toml", "");
    let (packets, inputs) = (packets(&desk, "out"), inputs(&desk, "out"));
    takes_what_was_sent(&document, &inputs, &accounts);
    let end = inputs.last().filter(|row| row.kind == "end").unwrap().at;
    has_the_fates_of_virtual_time(&desk, &packets, &inputs, end);
    releases_what_has_arrived(&desk, &document, &packets);
    is_never_early(&packets, &inputs, &accounts);
    assert_no_jump(&desk, &packets, &PLACES);
}

/// Checks that every counted sample was sent by the program, in this order. A missing sample was lost before it reached the session.
fn takes_what_was_sent(document: &Value, inputs: &[Input], accounts: &[Account; 2]) {
    let samples = assert_sent_by(accounts, inputs);
    let seat = &document["peers"][1]["seat"];
    assert_eq!(seat["taken"], json!(samples));
    assert!(seat["joined"].as_u64().unwrap() >= 2, "{seat}");
    let door = &document["door"];
    assert_counted(door);
    assert!(door["joinings"].as_u64().unwrap() >= 2 && door["admitted"].as_u64().unwrap() >= samples as u64, "{door}");
}

/// Checks that each sample among the inputs was sent by the program, in this order. Returns the number of samples.
pub(super) fn assert_sent_by(accounts: &[Account], inputs: &[Input]) -> usize {
    let mut sent = accounts.iter().flat_map(|account| &account.sent).map(|sent| hexadecimal(&sent.sample));
    let samples = inputs.iter().filter(|row| row.kind == "sample");
    let each = samples.map(|row| {
        assert_eq!(row.peer, "right");
        assert!(sent.any(|sample| untimed(&sample) == untimed(&row.value)), "{row:?} is no sample that was sent by then");
    });
    each.count()
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the parts of a sample around its sequence number, which the session changes with every joining.
fn untimed(sample: &str) -> (&str, &str) {
    (&sample[..48], &sample[64..])
}

fn has_the_fates_of_virtual_time(desk: &Desk, packets: &[Packet], inputs: &[Input], end: u64) {
    let expected = in_virtual_time(desk, &offers(inputs, end), end);
    let recorded: BTreeSet<_> = packets.iter().map(as_seen).collect();
    assert_eq!(recorded.len(), packets.len(), "no packet has two ends");
    assert_eq!(recorded.symmetric_difference(&expected).collect::<Vec<_>>(), Vec::<&_>::new());
    // Each of the six links has carried and lost something, so the comparison is of something.
    for link in ["left->right", "left->third", "right->left", "right->third", "third->left", "third->right"] {
        let fates: Vec<&str> = packets.iter().filter(|packet| packet.link == link).map(|packet| packet.fate.as_str()).collect();
        assert!(fates.contains(&"delivered"), "{link}");
    }
    assert!(packets.iter().any(|packet| packet.fate == "loss"));
}

/// Checks that the packets sent to the program were due at the instants at which the network delivered them, in this order.
fn releases_what_has_arrived(desk: &Desk, document: &Value, packets: &[Packet]) {
    let releases = releases(desk, "out");
    let mut arrivals = packets.iter().filter(|packet| packet.link.ends_with("->right")).filter_map(|packet| packet.arrived);
    for (peer, due, late) in &releases {
        assert_eq!(peer, "right");
        assert!(*late >= 0.0, "due at {due} and sent {late} µs later");
        assert!(arrivals.any(|at| at == *due), "nothing arrived at {due} ns, behind the arrivals before it");
    }
    assert_eq!(document["door"]["sent"], json!(releases.len()));
    assert_eq!(document["release_lateness_us"]["count"], json!(releases.len()));
    assert!(!releases.is_empty());
}

/// On the program's clock nothing comes before it is due.
///
/// The program does not know when the session began. But each sample counts no earlier than it was sent, so the session began no earlier than any `sent − counts`.
fn is_never_early(packets: &[Packet], inputs: &[Input], accounts: &[Account; 2]) {
    let epoch = accounts[0].sent[0].at;
    let seconds = |at: Wall| at.saturating_duration_since(epoch).as_secs_f64();
    let mut sent = accounts.iter().flat_map(|account| &account.sent);
    let samples = inputs.iter().filter(|row| row.kind == "sample");
    let began = samples.map(|row| {
        let of = sent.find(|sent| untimed(&hexadecimal(&sent.sample)) == untimed(&row.value)).unwrap();
        seconds(of.at) - Duration::from_nanos(row.at).as_secs_f64()
    });
    let began = began.fold(f64::MIN, f64::max);
    let due: BTreeMap<(&str, u64), u64> =
        packets.iter().filter_map(|packet| Some(((packet.link.as_str(), packet.sequence), packet.arrived?))).collect();
    let mut received = 0;
    for heard in accounts.iter().flat_map(|account| &account.received) {
        let link = ["left->right", "", "third->right"][heard.sender as usize];
        let due = Duration::from_nanos(due[&(link, heard.sequence)]).as_secs_f64();
        // The kernel's time of receipt is on another clock, which may be adjusted meanwhile: 1 ms is more than a second of the strongest adjustment.
        assert!(
            seconds(heard.at) - began >= due - 1e-3,
            "{heard:?} came {} s after the beginning and was due after {due} s",
            seconds(heard.at) - began
        );
        received += 1;
    }
    assert!(received > 100);
}
