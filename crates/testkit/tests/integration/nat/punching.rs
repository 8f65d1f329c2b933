//! Pairs of NATs through which two hosts can talk after a third host has told each host the address of the other (Ford, Srisuresh and Kegel 2005).

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::{Bed, Host, Instant, Testbed, time};

/// Instant at which the first host begins to probe.
const BEGIN: Instant = Instant::from_nanos(1_000_000_000);

/// Span between two probes, and by which the second host begins later.
const BETWEEN: Duration = Duration::from_millis(200);

/// Tells each of two hosts the address of the other one, as seen here.
async fn meet(host: Host) {
    let socket = host.bind("0.0.0.0:7").unwrap();
    let [one, other] = [socket.recv_from(&mut [0]).await.unwrap().1, socket.recv_from(&mut [0]).await.unwrap().1];
    for (to, about) in [(one, other), (other, one)] {
        socket.send_to(about.to_string().as_bytes(), to).await.unwrap();
    }
}

/// Sends probes to the address of the other host, and to the latest address from which a probe has come. Returns the span after `BEGIN` until the first probe.
async fn probe(host: Host, wait: Duration) -> Option<Duration> {
    let socket = host.bind("0.0.0.0:5000").unwrap();
    socket.send_to(b"?", "meet:7").await.unwrap();
    let mut buffer = [0; 64];
    let (len, _) = socket.recv_from(&mut buffer).await.unwrap();
    let mut to: SocketAddr = std::str::from_utf8(&buffer[..len]).unwrap().parse().unwrap();
    let mut heard = None;
    time::sleep_until(BEGIN + wait).await;
    for _ in 0..10 {
        socket.send_to(b"probe", to).await.unwrap();
        let next = time::now() + BETWEEN;
        while let Ok(probe) = time::timeout(next.saturating_duration_since(time::now()), socket.recv_from(&mut buffer)).await {
            to = probe.unwrap().1;
            heard.get_or_insert_with(|| time::now().saturating_duration_since(BEGIN));
        }
    }
    heard
}

async fn punch(bed: Bed) -> [Option<Duration>; 2] {
    bed.host("meet").spawn(meet(bed.host("meet")));
    let [alice, bob] = [("alice", 0), ("bob", 1)].map(|(name, turn)| bed.host(name).spawn(probe(bed.host(name), turn * BETWEEN)));
    [alice.await.unwrap(), bob.await.unwrap()]
}

fn is_punched(bed: Testbed) -> bool {
    let heard = bed.links("delay 25ms").run(punch);
    assert_eq!(heard[0].is_some(), heard[1].is_some(), "one side alone cannot hear, because each answers");
    heard[0].is_some()
}

fn hosts() -> Testbed {
    Testbed::new(["alice", "bob", "meet"])
}

/// Returns a test bed with each host behind a NAT of its own, or without a NAT.
fn pair(kinds: [&str; 2], seed: u64) -> Testbed {
    let names = [("home-a", "alice"), ("home-b", "bob")];
    names.into_iter().zip(kinds).fold(hosts().seed(seed), |bed, ((nat, host), kind)| if kind == "none" { bed } else { bed.nat(nat, kind, [host]) })
}

#[test]
fn hosts_meet_through_the_nats_of_the_table() {
    let kinds = ["none", "open", "address", "cgnat", "home", "strict"];
    for (place, one) in kinds.into_iter().enumerate() {
        for other in &kinds[place..] {
            // The filter of one side must permit the port of the other side's mapping.
            let expected = !matches!((one, *other), ("home" | "strict", "strict"));
            for kinds in [[one, *other], [*other, one]] {
                for seed in 0..3 {
                    assert_eq!(is_punched(pair(kinds, seed)), expected, "{kinds:?}, seed {seed}");
                }
            }
        }
    }
}

#[test]
fn columns_decide_and_not_the_name_of_the_kind() {
    let home = "address-and-port-dependent";
    for (words, expected) in [
        // A port that is kept is the same for each receiver, as long as no other mapping takes it.
        ("home ports random", true),
        ("home mapping address-and-port-dependent", false),
        ("strict mapping endpoint-independent", true),
        ("open filter address-and-port-dependent", true),
        (&format!("cgnat mapping {home} filter {home}"), false),
    ] {
        assert_eq!(is_punched(pair(["home", words], 1)), expected, "{words}");
    }
}

#[test]
fn behind_one_nat_only_a_hairpin_helps() {
    for (words, expected) in [("home", false), ("home hairpin yes", true), ("strict hairpin yes", false), ("open", true), ("cgnat hairpin no", false)]
    {
        assert_eq!(is_punched(hosts().nat("shared", words, ["alice", "bob"])), expected, "{words}");
    }
    for (words, expected) in [("cgnat", true), ("cgnat hairpin no", false)] {
        let homes = hosts().nat("home-a", "home", ["alice"]).nat("home-b", "home", ["bob"]);
        assert_eq!(is_punched(homes.nat("carrier", words, ["home-a", "home-b"])), expected, "{words}");
    }
}

#[test]
fn the_strictest_nat_on_the_way_decides() {
    for (words, expected) in [("strict", false), ("cgnat", true), ("home", true)] {
        let bed = hosts().nat("home-a", "home", ["alice"]).nat("carrier", words, ["home-a"]).nat("home-b", "home", ["bob"]);
        assert_eq!(is_punched(bed), expected, "{words}");
    }
}

#[test]
fn two_homes_hear_at_225_ms_after_one_filtered_probe() {
    let bed = pair(["home", "home"], 1).links("delay 25ms").link_both("alice", "home-a", "").link_both("bob", "home-b", "");
    let (heard, filtered) = bed.run(|bed| async move {
        let heard = punch(bed.clone()).await;
        (heard, ["home-a", "home-b"].map(|nat| bed.nat(nat).filtered()))
    });
    // The first probe of alice comes before bob has sent one. Her second probe and his first one cross, and both pass.
    assert_eq!((heard, filtered), ([Some(Duration::from_millis(225)); 2], [0, 1]));
}
