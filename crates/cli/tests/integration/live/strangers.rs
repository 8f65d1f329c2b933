//! Somebody who is not meant to take part sends whatever he likes to a session.

use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use cohaptic_live::client::{ClientConfig, Joining};
use cohaptic_live::{Place, SessionKey};
use serde_json::{Value, json};

use super::http::Control;
use super::peer::{Account, Peer, SESSION, sample};
use super::peer_elsewhere::{SCENE, assert_sent_by, keyless};
use super::records::{assert_counted, assert_replays, inputs, trajectory};
use super::session::Session;
use super::wait_for;
use crate::integration::desk::Desk;

/// Number of datagrams of each kind that the stranger sends.
const ROUNDS: u64 = 250;
/// Memory by which the process may grow, for its files and messages [KiB]. If every datagram were kept, the process would grow by more.
const GROWTH: u64 = 16 * 1024;

/// Random numbers that are equal on every machine (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, bound: usize) -> usize {
        usize::try_from(self.next() % bound as u64).unwrap()
    }

    fn bytes(&mut self, len: usize) -> Vec<u8> {
        (0..len).map(|_| self.next().to_le_bytes()[0]).collect()
    }
}

/// One of each kind. `heard` is what the program has said so far: he listens.
fn round(noise: &mut Noise, number: u64, heard: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let mut nan = sample(SESSION, 1, 1000 + number, 0.0);
    nan[48..56].copy_from_slice(&f64::NAN.to_le_bytes());
    let replayed = heard[noise.below(heard.len())].clone();
    let mut changed = replayed.clone();
    let place = noise.below(changed.len());
    changed[place] ^= 1 << noise.below(8);
    let (short, long) = (noise.below(48), 129 + noise.below(1800));
    // An own nonce: a guest who has another key.
    let nonce = noise.bytes(16).try_into().unwrap();
    let hello = Joining::new(SESSION, Place(1), &SessionKey::from_bytes([9; 32]), nonce).hello();
    vec![
        noise.bytes(short),
        noise.bytes(64),
        noise.bytes(long),
        replayed,
        changed,
        nan,
        sample(SESSION + 1 + number, 1, number, 5.0),
        sample(SESSION, 0, number, 5.0),
        sample(SESSION, 1, 2000 + number, 5.0),
        hello.to_vec(),
        heard[0].clone(),
        Vec::new(),
    ]
}

/// Sends it all, in portions that a socket has room for.
fn flood(door: SocketAddr, peer: &Peer) -> u64 {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let (mut noise, mut sent) = (Noise(1), 0);
    for number in 0..ROUNDS {
        let heard = peer.so_far().wire;
        for datagram in round(&mut noise, number, &heard) {
            sent += u64::from(socket.send_to(&datagram, door).is_ok());
        }
        std::thread::sleep(Duration::from_millis(3));
    }
    sent
}

/// Results of a session to which a stranger sent datagrams.
struct Flooded {
    document: Value,
    account: Account,
    sent: u64,
}

fn flooded(desk: &Desk, key: Option<SessionKey>) -> Flooded {
    let words = if key.is_some() { " --key-file session.key" } else { "" };
    let mut session = Session::begin(desk, &format!("scene.toml --json --out out --listen 127.0.0.1:0 --control{words}"));
    let (door, control) = (session.address(), session.control());
    let config = key.map_or_else(|| keyless(3), |key| ClientConfig::Keyed { session: SESSION, place: Place(1), key });
    let peer = Peer::begin(config, door, 0.02);
    wait_for("samples on both ways", || (control.delivered(2) > 20 && peer.so_far().received.len() > 20).then_some(()));
    let before = session.memory();
    let sent = flood(door, &peer);
    let account = peer.end();
    settle(&control);
    if let (Some(before), Some(after)) = (before, session.memory()) {
        assert!(after < before + GROWTH, "it had {before} KiB and has {after} KiB");
    }
    let state = control.state();
    assert_eq!(state["peers"][1]["status"], "present", "nobody was thrown out");
    assert_eq!(state["peers"][1]["position"][0], json!(0.02), "nobody was moved");
    Flooded { document: session.end(), account, sent }
}

/// Waits until all that has come in is handled: a second of ticks, before each of which the session reads.
fn settle(control: &Control) {
    let elapsed = |state: &Value| state["elapsed_s"].as_f64().unwrap();
    let until = elapsed(&control.state()) + 1.0;
    control.wait("a second", |state| elapsed(state) > until);
}

/// The scene, in which the program keeps its seat however long this machine lets it wait.
fn desk() -> Desk {
    let scene = SCENE.replace("after = \"150ms\"", "after = \"1h\"");
    assert!(scene.contains("1h\", fade"));
    Desk::with("scene.toml", &scene)
}

/// Asserts the results that must not depend on strangers.
fn assert_untouched(desk: &Desk, flooded: &Flooded, causes: &[&str]) {
    let Flooded { document, account, sent } = flooded;
    let door = &document["door"];
    assert_counted(door);
    let count = |of: &Value, key: &str| of[key].as_u64().unwrap_or_else(|| panic!("{key} in {of}"));
    // Nothing was let in but what the program sent, and all of that.
    let (inputs, samples) = (inputs(desk, "out"), account.sent.len() as u64);
    let taken = assert_sent_by(std::slice::from_ref(account), &inputs) as u64;
    assert_eq!((count(door, "admitted"), count(door, "joinings")), (taken, 1), "{door}");
    assert!(inputs.iter().all(|row| row.kind == "sample" || row.kind == "end"));
    // Every datagram that was sent by anybody is one that was handled, or that the kernel had no room for.
    if let Some(dropped) = door["kernel_drops"].as_u64() {
        let arrived = count(door, "handled") + count(door, "oversized") + dropped;
        assert_eq!(arrived, sent + account.wire.len() as u64, "{door}");
        assert!(dropped > 0 || taken == samples, "{taken} of {samples}");
    }
    let refused = &door["refused"];
    for cause in causes {
        assert!(count(refused, cause) > 0, "none was refused as {cause}: {refused}");
    }
    // The motion is that of the record, in which he is not.
    assert_replays(desk, "scene.toml", "");
    let farthest = trajectory(desk, "out").values().flatten().map(|tick| tick.xo.abs()).fold(0.0, f64::max);
    assert!(farthest < 0.2, "nothing was thrown as far as he said things were: {farthest} m");
}

#[test]
fn with_a_key_nothing_of_a_stranger_counts() {
    let desk = desk();
    desk.text("live --new-key session.key");
    let key = SessionKey::read_from(desk.path("session.key")).unwrap();
    let flooded = flooded(&desk, Some(key));
    let causes = ["oversized", "too-short", "magic", "not-finite", "foreign-session", "unknown-seat", "unsealed", "forged"];
    assert_untouched(&desk, &flooded, &causes);
    // Repeating its hello gets an answer and changes nothing.
    assert!(flooded.document["door"]["welcomed"].as_u64() > Some(1), "{:#}", flooded.document["door"]);
}

#[test]
fn without_a_key_nobody_takes_a_seat_that_is_taken() {
    let desk = desk();
    let flooded = flooded(&desk, None);
    let causes = ["oversized", "too-short", "magic", "not-finite", "foreign-session", "unknown-seat", "keyless", "seat-taken"];
    assert_untouched(&desk, &flooded, &causes);
    assert_eq!(flooded.document["door"]["welcomed"], json!(0));
}
