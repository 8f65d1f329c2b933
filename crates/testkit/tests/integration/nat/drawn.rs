//! NATs drawn by strategies.

use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{ImpairedNetwork, LinkBounds, any_network, networks_like};
use cohaptic_testkit::wan::NodeId;
use cohaptic_testkit::{Bed, Testbed, time};

/// A client that asks each second until it is answered, ten times at most.
async fn is_answered(bed: Bed) -> bool {
    let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    bed.host("server").spawn(async move {
        while let Ok((_, from)) = server.recv_from(&mut [0; 8]).await {
            server.send_to(b"!", from).await.unwrap();
        }
    });
    let client = bed.host("client").bind("0.0.0.0:0").unwrap();
    for _ in 0..10 {
        client.send_to(b"?", "server:7").await.unwrap();
        if time::timeout(Duration::from_secs(1), client.recv(&mut [0; 8])).await.is_ok() {
            return true;
        }
    }
    false
}

proptest! {
    #[test]
    fn a_client_is_answered_through_any_nat(network in networks_like(2, LinkBounds::ideal().delay(Duration::ZERO..=Duration::from_millis(400))).behind_nats([0])) {
        prop_assert!(Testbed::new(["client", "server"]).network(&network).run(is_answered));
    }

    #[test]
    fn a_text_with_nats_is_read_again(network in any_network(3).behind_nats([0, 1, 2])) {
        prop_assert_eq!(network.to_string().parse::<ImpairedNetwork>().unwrap(), network);
    }
}

#[test]
fn the_links_of_a_host_are_those_of_its_nat() {
    let network = ImpairedNetwork::words("2 hosts; nat a: home udp-timeout 5s; a -> b: delay 20ms; b -> a: delay 30ms");
    assert_eq!(network.nats().collect::<Vec<_>>(), [(NodeId(0), "home udp-timeout 5s".to_owned())]);
    assert_eq!(ImpairedNetwork::ideal(2).with_nat(NodeId(0), "home udp-timeout 5s").to_string(), "2 hosts\nnat a: home udp-timeout 5s");
    Testbed::new(["client", "server"]).links("loss 100%").network(&network).run(|bed| async move {
        assert!(is_answered(bed.clone()).await);
        assert_eq!((bed.now().as_nanos(), bed.nat("nat-client").mappings().len()), (50_000_000, 1));
    });
    for (text, message) in [
        ("2 hosts; nat c: home", "\"nat c: home\" puts no host behind a NAT: there is no such host"),
        ("2 hosts; nat a: odd", "\"nat a: odd\" puts no host behind a NAT: unknown word \"odd\""),
        ("2 hosts; nat a: home; nat a: open", "\"nat a: open\" puts no host behind a NAT: the host has a NAT already"),
    ] {
        let found = text.parse::<ImpairedNetwork>().unwrap_err().to_string();
        assert!(found.starts_with(message), "{found}");
    }
}
