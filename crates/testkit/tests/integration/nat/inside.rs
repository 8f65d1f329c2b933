//! Networks behind NATs: addresses, names and links, and what makes no sense.

use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::{Instant, Testbed, time};

use super::{bind, heard_from, passes};

/// Alice and carol at home, bob at another home, both homes at a carrier.
fn homes() -> Testbed {
    Testbed::new(["alice", "carol", "bob", "server"]).nat("home-a", "home", ["alice", "carol"]).nat("home-b", "home", ["bob"]).nat(
        "carrier",
        "cgnat",
        ["home-a", "home-b"],
    )
}

#[test]
fn hosts_have_the_addresses_of_their_networks() {
    homes().run(|bed| async move {
        let addresses =
            ["alice", "carol", "bob", "server", "home-a", "home-b", "carrier"].map(|name| bed.addresses().addresses(name).unwrap().v4.to_string());
        assert_eq!(addresses, ["192.168.1.1", "192.168.1.2", "192.168.2.1", "10.0.0.4", "100.64.3.1", "100.64.3.2", "10.0.0.7"]);
        assert_eq!(bed.hosts().len(), 4);
        // A host that moves stays in its network, and has an address that no host has had.
        assert_eq!(bed.host("alice").change_addresses().v4.to_string(), "192.168.1.3");
        let alice = bind(&bed.host("alice"), "0.0.0.0:5000");
        alice.send_to(b"?", "server:7").await.unwrap();
    });
}

#[test]
fn an_address_chosen_by_the_test_is_kept() {
    homes().address("alice", [192, 168, 77, 7]).address("carrier", [203, 0, 113, 5]).run(|bed| async move {
        let (alice, server) = (bind(&bed.host("alice"), "192.168.77.7:5000"), bind(&bed.host("server"), "0.0.0.0:7"));
        alice.send_to(b"?", "server:7").await.unwrap();
        assert!(heard_from(&server).await.unwrap().to_string().starts_with("203.0.113.5:"));
    });
}

#[test]
fn names_are_known_inside_alone() {
    homes().run(|bed| async move {
        for (asking, name, is_known) in [
            ("alice", "carol", true),
            ("alice", "alice", true),
            ("alice", "bob", false),
            ("alice", "server", true),
            ("alice", "home-b", true),
            ("server", "alice", false),
            ("server", "home-a", false),
            ("server", "carrier", true),
        ] {
            let socket = bind(&bed.host(asking), "[::]:0");
            // The name means what it means to the host of the socket, whichever task sends.
            let sent = socket.send_to(b"?", (name, 7)).await;
            let asked = bed.host(asking).spawn(async move { bind_and_send(name).await }).await.unwrap();
            for sent in [sent, asked] {
                assert_eq!(sent.as_ref().map_err(std::io::Error::kind).err(), (!is_known).then_some(ErrorKind::NotFound), "{asking} asks for {name}");
            }
        }
        let error = bind(&bed.host("server"), "0.0.0.0:0").send_to(b"?", "bob:7").await.unwrap_err().to_string();
        assert_eq!(error, "there is no host `bob` here: the host is behind the NAT `home-b`, and only hosts behind that NAT know its name");
    });
}

async fn bind_and_send(name: &str) -> std::io::Result<usize> {
    cohaptic_testkit::UdpSocket::bind("0.0.0.0:0").await?.send_to(b"?", (name, 7)).await
}

#[test]
fn hosts_of_one_network_talk_without_their_nat() {
    homes().link_both("alice", "carol", "delay 3ms").run(|bed| async move {
        let [alice, carol, bob] = ["alice", "carol", "bob"].map(|name| bind(&bed.host(name), "0.0.0.0:5000"));
        alice.send_to(b"?", "carol:5000").await.unwrap();
        assert_eq!(heard_from(&carol).await.unwrap().to_string(), "192.168.1.1:5000");
        assert_eq!(bed.now(), Instant::from_nanos(3_000_000));
        // The address of a host in another network leads nowhere, and is no error either.
        for to in ["192.168.2.1:5000", "192.168.9.9:5000", "8.8.8.8:53"] {
            assert!(!passes(&alice, to.parse().unwrap(), &bob).await, "{to}");
        }
        assert!(bed.nat("home-a").mappings().is_empty() && bed.nat("home-b").mappings().is_empty());
        // IPv6 has no translation, so that the host itself knows that no way leads to another network.
        let six = bind(&bed.host("alice"), "[::]:0").send_to(b"?", "[2001:db8::1]:53").await;
        assert_eq!(six.unwrap_err().kind(), ErrorKind::NetworkUnreachable);
    });
}

#[test]
fn version_6_is_filtered_and_not_translated() {
    homes().run(|bed| async move {
        let [alice, bob, server] = ["alice", "bob", "server"].map(|name| bind(&bed.host(name), "[::]:5000"));
        let [at_alice, at_bob] = ["[fd00::1]:5000", "[fd00::3]:5000"].map(|address| address.parse().unwrap());
        assert!(!passes(&server, at_alice, &alice).await);
        alice.send_to(b"?", "[server]:5000").await.unwrap();
        assert_eq!(heard_from(&server).await, Some(at_alice));
        assert!(passes(&server, at_alice, &alice).await);
        // The homes of both hosts must have seen a packet out.
        assert!(!passes(&alice, at_bob, &bob).await);
        assert!(passes(&bob, at_alice, &alice).await);
        assert!(passes(&alice, at_bob, &bob).await);
        assert_eq!(bed.nat("home-b").mappings()[0].to_string(), "UDP [fd00::3]:5000 is [fd00::3]:5000 for [fd00::1]:5000");
    });
}

#[test]
fn a_broadcast_stays_in_its_network() {
    homes().run(|bed| async move {
        let sockets = ["alice", "carol", "bob", "server"].map(|name| bind(&bed.host(name), "0.0.0.0:5000"));
        sockets[0].set_broadcast(true).unwrap();
        sockets[0].send_to(b"?", "255.255.255.255:5000").await.unwrap();
        let mut heard = Vec::new();
        for socket in &sockets {
            heard.push(heard_from(socket).await.is_some());
        }
        assert_eq!(heard, [true, true, false, false]);
        // A NAT beside the sender gets no broadcast either.
        sockets[3].set_broadcast(true).unwrap();
        sockets[3].send_to(b"?", "255.255.255.255:5000").await.unwrap();
        assert_eq!(bed.link_stats("server", "carrier").offered(), 0);
    });
}

#[test]
fn a_cut_link_and_a_crashed_host_behind_a_nat_are_silent() {
    homes().run(|bed| async move {
        let (alice, server) = (bind(&bed.host("alice"), "0.0.0.0:5000"), bind(&bed.host("server"), "0.0.0.0:7"));
        bed.cut("carrier", "server");
        alice.send_to(b"?", "server:7").await.unwrap();
        assert_eq!(heard_from(&server).await, None);
        bed.mend_all();
        alice.send_to(b"?", "server:7").await.unwrap();
        let mapped = heard_from(&server).await.unwrap();
        bed.host("alice").crash();
        server.send_to(b"!", mapped).await.unwrap();
        time::sleep(Duration::from_secs(1)).await;
    });
}

#[test]
fn what_makes_no_sense_is_refused_with_the_way_out() {
    let hosts = || Testbed::new(["a", "b", "c"]);
    let nat = || hosts().nat("n", "home", ["a"]);
    let refused = |run: &dyn Fn()| {
        let panic = catch_unwind(AssertUnwindSafe(run)).unwrap_err();
        panic.downcast_ref::<String>().cloned().unwrap_or_else(|| (*panic.downcast_ref::<&str>().unwrap()).to_owned())
    };
    let nothing = || |_| async {};
    for (message, run) in [
        ("`n`: 1:1: unknown word \"symmetric\"", &(|| drop(hosts().nat("n", "symmetric", ["a"]))) as &dyn Fn()),
        ("there is no host `x`", &|| drop(hosts().nat("n", "home", ["x"]))),
        ("`n` cannot be added: expected the names of the hosts inside", &|| drop(hosts().nat("n", "home", []))),
        ("host `a` is named twice behind `n`", &|| drop(hosts().nat("n", "home", ["a", "a"]))),
        ("host `a` is behind `n` already, and cannot be behind `m` as well", &|| drop(nat().nat("m", "home", ["b", "a"]))),
        ("two hosts have the name `a`", &|| drop(hosts().nat("a", "home", ["b"]))),
        ("`a` has no link to `b`, because a NAT, a firewall or an interface is between them", &|| nat().link("a", "b", "delay 1ms").run(nothing())),
        ("`b` has no link to `a`", &|| nat().hit("b", "a", "drop packet 0").run(nothing())),
        ("`a` has no link to `b`", &|| nat().run(|bed| async move { bed.cut("a", "b") })),
        ("`n` is a NAT or a firewall, and runs no programs", &|| nat().run(|bed| async move { drop(bed.host("n")) })),
        ("`a` is a host: `Bed::host` returns it", &|| nat().run(|bed| async move { drop(bed.nat("a")) })),
        ("1:1: unknown word \"often\"", &|| nat().run(|bed| async move { bed.nat("n").set("often") })),
    ] {
        let found = refused(run);
        assert!(found.starts_with(message), "{found}");
    }
}
