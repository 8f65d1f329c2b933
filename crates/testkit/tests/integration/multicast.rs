//! Multicast over IPv4.

use std::io::ErrorKind;
use std::net::Ipv4Addr;
use std::time::Duration;

use cohaptic_testkit::{Testbed, UdpSocket, time};

const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 0, 251);
const ANY: Ipv4Addr = Ipv4Addr::UNSPECIFIED;
const TO: &str = "224.0.0.251:5353";

/// Returns whether a datagram arrives within 100 ms.
pub(crate) async fn hears(socket: &UdpSocket) -> bool {
    time::timeout(Duration::from_millis(100), socket.recv_from(&mut [0; 8])).await.is_ok_and(|heard| heard.is_ok())
}

#[test]
fn a_group_reaches_its_members_with_one_copy_a_link() {
    let bed = Testbed::new(["a", "b", "c", "d"]).links("delay 10ms");
    for bed in [bed.clone(), bed.on_tokio()] {
        bed.run_twice(|bed| async move {
            let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| bed.host(name).bind("0.0.0.0:5353").unwrap());
            b.join_multicast_v4(GROUP, ANY).unwrap();
            c.join_multicast_v4(GROUP, "10.0.0.3".parse().unwrap()).unwrap();
            d.join_multicast_v4(Ipv4Addr::new(224, 0, 0, 252), ANY).unwrap();
            a.send_to(b"?", TO).await.unwrap();
            let (_, from) = b.recv_from(&mut [0; 8]).await.unwrap();
            assert_eq!((from.to_string(), bed.now().as_nanos()), ("10.0.0.1:5353".to_owned(), 10_000_000));
            assert!(hears(&c).await && !hears(&d).await && !hears(&a).await);
            assert_eq!(["b", "c", "d"].map(|host| bed.link_stats("a", host).delivered()), [1, 1, 0]);
            // An answer goes to the sender alone.
            b.send_to(b"!", from).await.unwrap();
            assert!(hears(&a).await && !hears(&c).await);
            b.leave_multicast_v4(GROUP, ANY).unwrap();
            a.send_to(b"?", TO).await.unwrap();
            assert!(!hears(&b).await && hears(&c).await);
        });
    }
}

#[test]
fn a_membership_is_that_of_the_host_and_ends_with_the_socket() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let a = bed.host("a").bind("0.0.0.0:0").unwrap();
        let host = bed.host("b");
        let hearing = host.bind("0.0.0.0:5353").unwrap();
        let joined = host.bind("0.0.0.0:9").unwrap();
        joined.join_multicast_v4(GROUP, ANY).unwrap();
        a.send_to(b"?", TO).await.unwrap();
        // As with Linux, the socket of the port hears what another socket has joined, and nobody else does.
        assert!(hears(&hearing).await && !hears(&joined).await);
        drop(joined);
        a.send_to(b"?", TO).await.unwrap();
        assert!(!hears(&hearing).await);
        drop(hearing);
        // A socket that is bound to the group hears the group alone.
        let bound = host.bind(TO).unwrap();
        bound.join_multicast_v4(GROUP, ANY).unwrap();
        a.send_to(b"?", "b:5353").await.unwrap();
        a.send_to(b"?", TO).await.unwrap();
        assert!(hears(&bound).await && !hears(&bound).await);
        // The group is no source: datagrams from the socket have the address of the host.
        bound.send_to(b"!", a.local_addr().map(|to| ("a", to.port())).unwrap()).await.unwrap();
        assert_eq!(a.recv_from(&mut [0; 8]).await.unwrap().1.to_string(), "10.0.0.2:5353");
        host.crash();
        host.restart();
        let hearing = host.bind("0.0.0.0:5353").unwrap();
        a.send_to(b"?", TO).await.unwrap();
        assert!(!hears(&hearing).await);
        // Dropping the handle of the crashed socket ends no membership of the new socket.
        hearing.join_multicast_v4(GROUP, ANY).unwrap();
        drop(bound);
        a.send_to(b"?", TO).await.unwrap();
        assert!(hears(&hearing).await);
    });
}

#[test]
fn what_is_under_way_to_a_host_that_leaves_is_lost() {
    Testbed::new(["a", "b"]).links("delay 10ms").run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bed.host(name).bind("0.0.0.0:5353").unwrap());
        b.join_multicast_v4(GROUP, ANY).unwrap();
        a.send_to(b"?", TO).await.unwrap();
        b.leave_multicast_v4(GROUP, ANY).unwrap();
        assert!(!hears(&b).await);
    });
}

#[test]
fn loop_and_time_to_live_say_who_hears() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bed.host(name).bind("0.0.0.0:5353").unwrap());
        for socket in [&a, &b] {
            socket.join_multicast_v4(GROUP, ANY).unwrap();
        }
        assert_eq!((a.multicast_ttl_v4().unwrap(), a.multicast_loop_v4().unwrap()), (1, true));
        for (ttl, loops, expected) in
            [(1, true, [true, true]), (1, false, [false, true]), (0, true, [true, false]), (0, false, [false, false]), (255, true, [true, true])]
        {
            a.set_multicast_ttl_v4(ttl).unwrap();
            a.set_multicast_loop_v4(loops).unwrap();
            assert_eq!((a.multicast_ttl_v4().unwrap(), a.multicast_loop_v4().unwrap()), (ttl, loops));
            a.send_to(b"?", TO).await.unwrap();
            assert_eq!([hears(&a).await, hears(&b).await], expected, "{ttl} {loops}");
        }
        assert_eq!(a.set_multicast_ttl_v4(256).unwrap_err().kind(), ErrorKind::InvalidInput);
    });
}

#[test]
fn multicast_stays_in_its_network() {
    let bed = Testbed::new(["pc", "tv", "phone", "server"]).interfaces("phone", ["wifi", "lte"]).nat("home", "open", ["pc", "tv", "wifi"]);
    bed.run(|bed| async move {
        let [pc, tv, phone, server] = ["pc", "tv", "phone", "server"].map(|name| bed.host(name).bind("0.0.0.0:5353").unwrap());
        for socket in [&tv, &phone, &server] {
            socket.join_multicast_v4(GROUP, ANY).unwrap();
        }
        pc.set_multicast_ttl_v4(64).unwrap();
        pc.send_to(b"?", TO).await.unwrap();
        assert_eq!([hears(&tv).await, hears(&phone).await, hears(&server).await], [true, true, false]);
        server.send_to(b"?", TO).await.unwrap();
        assert_eq!([hears(&tv).await, hears(&phone).await, hears(&server).await], [false, true, true]);
    });
}

/// As with Linux, nobody is told that a port is closed where many hosts were asked.
#[test]
fn a_closed_port_of_a_group_is_silent() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bed.host(name).bind("0.0.0.0:9").unwrap());
        a.set_broadcast(true).unwrap();
        b.join_multicast_v4(GROUP, ANY).unwrap();
        for to in [TO, "255.255.255.255:5353"] {
            a.connect(to).await.unwrap();
            for _ in 0..2 {
                a.send(b"?").await.unwrap();
                time::sleep(Duration::from_millis(1)).await;
            }
        }
    });
}

#[test]
fn mistakes_are_those_of_linux() {
    Testbed::new(["a"]).run(|bed| async move {
        let a = bed.host("a").bind("0.0.0.0:5353").unwrap();
        assert_eq!(a.join_multicast_v4(Ipv4Addr::new(10, 0, 0, 1), ANY).unwrap_err().kind(), ErrorKind::InvalidInput);
        assert_eq!(a.leave_multicast_v4(GROUP, ANY).unwrap_err().kind(), ErrorKind::AddrNotAvailable);
        a.join_multicast_v4(GROUP, ANY).unwrap();
        assert_eq!(a.join_multicast_v4(GROUP, ANY).unwrap_err().kind(), ErrorKind::AddrInUse);
        let error = a.join_multicast_v4(GROUP, Ipv4Addr::new(10, 0, 0, 9)).unwrap_err();
        if cfg!(target_os = "linux") {
            assert_eq!(error.raw_os_error(), Some(19));
        }
    });
}
