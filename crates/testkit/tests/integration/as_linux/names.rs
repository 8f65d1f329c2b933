//! Names, and several addresses.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};
use std::panic::{AssertUnwindSafe, catch_unwind};

use cohaptic_testkit::net::lookup_host;
use cohaptic_testkit::{Testbed, ToSocketAddrs};

use super::{R, beds, timed};

/// Returns the addresses that a description has, as a text.
async fn found(description: impl ToSocketAddrs) -> String {
    lookup_host(description).await.unwrap().map(|address| address.to_string()).collect::<Vec<_>>().join(" ")
}

#[test]
fn names_stand_for_the_addresses_of_both_versions() {
    for bed in beds() {
        bed.run(|_| async {
            for name in ["localhost:80", "LocalHost:80", "localhost.:80"] {
                assert_eq!(found(name).await, "[::1]:80 127.0.0.1:80");
            }
            // Neither the case of letters nor a final dot counts (RFC 4343).
            for name in ["b:80", "B:80", "b.:80"] {
                assert_eq!(found(name).await, "10.0.0.2:80 [fd00::2]:80");
            }
            assert_eq!(found("[b]:80").await, "[fd00::2]:80");
        });
    }
    Testbed::new(["a", "b"]).ipv6_first().run(|bed| async move {
        assert_eq!(found("b:80").await, "[fd00::2]:80 10.0.0.2:80");
        assert_eq!(found((&bed.host("b"), 80)).await, "[fd00::2]:80 10.0.0.2:80");
    });
    let panic = catch_unwind(|| Testbed::new(["Host", "host."])).unwrap_err();
    assert!(panic.downcast_ref::<String>().unwrap().starts_with("two hosts have the name `host.`"));
}

#[test]
fn addresses_have_all_forms_of_tokio() {
    Testbed::new(["a"]).run(|_| async {
        let (v4, v6) = (Ipv4Addr::new(10, 0, 0, 1), Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, 1));
        let four = SocketAddr::from((v4, 80));
        assert_eq!(found(four).await, "10.0.0.1:80");
        assert_eq!(found(SocketAddrV4::new(v4, 80)).await, "10.0.0.1:80");
        assert_eq!(found(SocketAddrV6::new(v6, 80, 0, 0)).await, "[fd00::1]:80");
        assert_eq!(found((IpAddr::from(v4), 80)).await, "10.0.0.1:80");
        assert_eq!(found((v4, 80)).await, "10.0.0.1:80");
        assert_eq!(found((v6, 80)).await, "[fd00::1]:80");
        assert_eq!(found(&[four, SocketAddr::from((v6, 7))][..]).await, "10.0.0.1:80 [fd00::1]:7");
        assert_eq!(found("10.0.0.1:80").await, "10.0.0.1:80");
        assert_eq!(found("a:80".to_owned()).await, "10.0.0.1:80 [fd00::1]:80");
        assert_eq!(found(("a", 80)).await, "10.0.0.1:80 [fd00::1]:80");
        assert_eq!(found(("fd00::1", 80)).await, "[fd00::1]:80");
        assert_eq!(found(&&("a".to_owned(), 80)).await, "10.0.0.1:80 [fd00::1]:80");
    });
}

#[test]
fn each_of_several_addresses_is_tried_and_the_last_error_counts() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let listener = b.listen("[::1]:0").unwrap();
            assert_eq!(listener.local_addr().unwrap().ip(), Ipv6Addr::LOCALHOST);
            let _listener = b.listen("[fd00::2]:80").unwrap();
            let begin = bed.now();
            // The address of IPv4 comes first, and nobody listens there.
            let stream = a.connect("b:80").await.unwrap();
            assert_eq!((stream.peer_addr().unwrap().to_string(), bed.now() - begin), ("[fd00::2]:80".into(), 2 * R));
            // Refused by both.
            assert_eq!(timed(&bed, a.connect("b:81")).await, (Some(111), 2 * R));
            let addresses = ["10.0.0.2:81", "192.0.2.1:80"].map(|text| text.parse::<SocketAddr>().unwrap());
            assert_eq!(timed(&bed, a.connect(&addresses[..])).await, (Some(101), R));
            // Binding, and connecting of UDP.
            let addresses = ["192.0.2.1:9", "10.0.0.1:9"].map(|text| text.parse::<SocketAddr>().unwrap());
            let socket = a.bind(&addresses[..]).unwrap();
            assert_eq!(socket.local_addr().unwrap(), addresses[1]);
            assert_eq!(a.listen(&addresses[..]).unwrap().local_addr().unwrap(), addresses[1]);
            socket.connect(&addresses[..]).await.unwrap();
            assert_eq!(socket.peer_addr().unwrap(), addresses[1]);
            assert_eq!(a.bind(&addresses[..0]).unwrap_err().to_string(), "could not resolve to any address");
        });
    }
}

#[test]
fn a_test_chooses_addresses() {
    let bed = Testbed::new(["a", "b"]).links("delay 10ms").address("b", [192, 168, 1, 10]).address("b", [0xfd00, 0, 0, 0, 0, 0, 7, 1]);
    bed.run_twice(|bed| async move {
        let (a, b) = (bed.host("a"), bed.host("b"));
        assert_eq!(bed.addresses().to_string(), "a 10.0.0.1 fd00::1\nb 192.168.1.10 fd00::7:1\n");
        assert_eq!(bed.owner([192, 168, 1, 10].into()).as_deref(), Some("b"));
        let listener = b.listen("[::]:80").unwrap();
        for (address, seen) in [("192.168.1.10:80", "[::ffff:192.168.1.10]:80"), ("[fd00::7:1]:80", "[fd00::7:1]:80")] {
            let stream = a.connect(address).await.unwrap();
            assert_eq!(stream.peer_addr().unwrap().to_string(), address);
            let (stream, _) = listener.accept().await.unwrap();
            assert_eq!(stream.local_addr().unwrap().to_string(), seen);
        }
        let socket = a.bind("0.0.0.0:0").unwrap();
        b.bind("192.168.1.10:9").unwrap();
        // The address that the host would have had belongs to nobody, and neighbours of the chosen address cannot be reached.
        assert_eq!(timed(&bed, a.connect("10.0.0.2:80")).await.0, Some(113));
        assert_eq!(timed(&bed, socket.send_to(b"x", "192.168.1.11:80")).await.0, Some(101));
    });
    for (act, text) in [
        (Box::new(|| drop(Testbed::new(["a"]).address("a", [127, 0, 0, 1]))) as Box<dyn Fn()>, "127.0.0.1 cannot be the address of a host"),
        (Box::new(|| drop(Testbed::new(["a", "b"]).address("a", [10, 0, 0, 9]).address("b", [10, 0, 0, 9]))), "is the address of host `a` already"),
        (Box::new(|| drop(Testbed::new(["a"]).address("b", [10, 0, 0, 9]))), "there is no host `b`"),
    ] {
        let panic = catch_unwind(AssertUnwindSafe(act)).unwrap_err();
        assert!(panic.downcast_ref::<String>().unwrap().contains(text), "{text}");
    }
}
