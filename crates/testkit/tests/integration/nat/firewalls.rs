//! Firewalls, which filter and translate nothing.

use cohaptic_testkit::{Testbed, Testbed as Bed};

use super::{bind, heard_from, passes};

#[test]
fn a_firewall_lets_in_what_answers() {
    for (words, expected) in
        [("", [true, false, false]), ("filter address-dependent", [true, true, false]), ("filter endpoint-independent", [true, true, true])]
    {
        Bed::new(["office", "server", "other"]).firewall("wall", words, ["office"]).run(move |bed| async move {
            let office = bind(&bed.host("office"), "0.0.0.0:5000");
            let sockets = [("server", "0.0.0.0:7"), ("server", "0.0.0.0:8"), ("other", "0.0.0.0:7")].map(|(name, at)| bind(&bed.host(name), at));
            // Outsiders know the name of the host, and cannot reach it.
            sockets[0].send_to(b"?", "office:5000").await.unwrap();
            assert_eq!(heard_from(&office).await, None);
            office.send_to(b"?", "server:7").await.unwrap();
            let from = heard_from(&sockets[0]).await.unwrap();
            assert_eq!(from.to_string(), "10.0.0.1:5000");
            for (socket, expected) in sockets.iter().zip(expected) {
                assert_eq!(passes(socket, from, &office).await, expected, "{words}");
            }
            assert_eq!(bed.nat("wall").mappings()[0].to_string(), "UDP 10.0.0.1:5000 is 10.0.0.1:5000 for 10.0.0.2:7");
        });
    }
}

#[test]
fn a_firewall_inside_a_nat_is_in_its_network() {
    Testbed::new(["pc", "tv", "server"]).firewall("wall", "", ["pc"]).nat("home", "open", ["wall", "tv"]).run(|bed| async move {
        let [pc, tv, server] = ["pc", "tv", "server"].map(|name| bind(&bed.host(name), "0.0.0.0:5000"));
        assert_eq!(bed.host("pc").ip().to_string(), "192.168.1.1");
        let at_pc = (bed.host("pc").ip(), 5000).into();
        assert!(!passes(&tv, at_pc, &pc).await);
        pc.send_to(b"?", "tv:5000").await.unwrap();
        assert_eq!(heard_from(&tv).await, Some(at_pc));
        assert!(passes(&tv, at_pc, &pc).await);
        pc.send_to(b"?", "server:5000").await.unwrap();
        let mapped = heard_from(&server).await.unwrap();
        assert_eq!(mapped.ip(), bed.addresses().addresses("home").unwrap().v4);
        assert!(passes(&server, mapped, &pc).await);
    });
}

#[test]
fn a_firewall_is_changed_by_its_own_words() {
    Testbed::new(["office", "server"]).firewall("wall", "", ["office"]).run(|bed| async move {
        let [office, server] = ["office", "server"].map(|name| bind(&bed.host(name), "0.0.0.0:5000"));
        office.send_to(b"?", "server:5000").await.unwrap();
        heard_from(&server).await.unwrap();
        bed.nat("wall").set("udp-timeout 1s");
        cohaptic_testkit::time::sleep(std::time::Duration::from_secs(1)).await;
        assert!(!passes(&server, "10.0.0.1:5000".parse().unwrap(), &office).await);
    });
}
