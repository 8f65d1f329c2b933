//! Multicast over IPv6. Outcomes and numbers of errors are as measured with Linux 6 in a network namespace with two interfaces.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddrV6};

use cohaptic_testkit::{Bed, Testbed, UdpSocket};

use crate::multicast::hears;

const GROUP: Ipv6Addr = Ipv6Addr::new(0xff02, 0, 0, 0, 0, 0, 0, 0xfb);
const TO: &str = "[ff02::fb]:5353";

fn bind(bed: &Bed, host: &str) -> UdpSocket {
    bed.host(host).bind("[::]:5353").unwrap()
}

/// Returns the number of the error that Linux gives, or `None` without an error.
fn number<T>(outcome: io::Result<T>) -> Option<i32> {
    outcome.err().map(|error| error.raw_os_error().unwrap_or_else(|| panic!("{error}")))
}

#[test]
fn a_group_reaches_its_members_with_one_copy_a_link() {
    let bed = Testbed::new(["a", "b", "c", "d"]).links("delay 10ms");
    for bed in [bed.clone(), bed.on_tokio()] {
        bed.run_twice(|bed| async move {
            let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| bind(&bed, name));
            b.join_multicast_v6(&GROUP, 0).unwrap();
            c.join_multicast_v6(&GROUP, 2).unwrap();
            // The same identifier in another scope, and with another flag, is another group.
            for other in ["ff05::fb", "ff12::fb", "ff02::fc"] {
                d.join_multicast_v6(&other.parse().unwrap(), 0).unwrap();
            }
            a.send_to(b"?", TO).await.unwrap();
            let (_, from) = b.recv_from(&mut [0; 8]).await.unwrap();
            assert_eq!((from.to_string(), bed.now().as_nanos()), ("[fd00::1]:5353".to_owned(), 10_000_000));
            assert!(hears(&c).await && !hears(&d).await && !hears(&a).await);
            assert_eq!(["b", "c", "d"].map(|host| bed.link_stats("a", host).delivered()), [1, 1, 0]);
            b.send_to(b"!", from).await.unwrap();
            assert!(hears(&a).await && !hears(&c).await);
            b.leave_multicast_v6(&GROUP, 0).unwrap();
            a.send_to(b"?", TO).await.unwrap();
            assert!(!hears(&b).await && hears(&c).await);
        });
    }
}

/// The identifier 2 of a group is the number of a host, which must not hear the group because of its address.
#[test]
fn the_identifier_of_a_group_is_no_address_of_a_host() {
    Testbed::new(["a", "b", "c"]).run(|bed| async move {
        let [a, c] = ["a", "c"].map(|name| bind(&bed, name));
        let host = bed.host("b");
        let (bound, any) = (host.bind("[fd00::2]:5353").unwrap(), host.bind("[::]:9").unwrap());
        a.send_to(b"?", "[ff02::2]:5353").await.unwrap();
        assert!(!hears(&bound).await && !hears(&c).await);
        any.join_multicast_v6(&"ff02::2".parse().unwrap(), 0).unwrap();
        a.send_to(b"?", "[ff02::2]:9").await.unwrap();
        a.send_to(b"?", "[ff02::2]:5353").await.unwrap();
        assert!(hears(&any).await && !hears(&bound).await, "a socket at an address hears that address alone");
        a.send_to(b"?", "[fd00::2]:5353").await.unwrap();
        assert!(hears(&bound).await);
    });
}

#[test]
fn a_membership_is_that_of_the_host_and_ends_with_the_socket() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let a = bed.host("a").bind("[::]:0").unwrap();
        let host = bed.host("b");
        let (hearing, joined) = (bind(&bed, "b"), host.bind("[::]:9").unwrap());
        joined.join_multicast_v6(&GROUP, 0).unwrap();
        a.send_to(b"?", TO).await.unwrap();
        assert!(hears(&hearing).await && !hears(&joined).await);
        drop(joined);
        a.send_to(b"?", TO).await.unwrap();
        assert!(!hears(&hearing).await);
        drop(hearing);
        // A socket that is bound to the group hears the group alone, and sends from the address of the host.
        let bound = host.bind("[ff05::fb]:5353").unwrap();
        assert_eq!(bound.local_addr().unwrap().to_string(), "[ff05::fb]:5353");
        bound.join_multicast_v6(&"ff05::fb".parse().unwrap(), 0).unwrap();
        a.send_to(b"?", "b:5353").await.unwrap();
        a.send_to(b"?", "[ff05::fb]:5353").await.unwrap();
        assert!(hears(&bound).await && !hears(&bound).await);
        bound.send_to(b"!", (Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, 1), a.local_addr().unwrap().port())).await.unwrap();
        assert_eq!(a.recv_from(&mut [0; 8]).await.unwrap().1.to_string(), "[fd00::2]:5353");
    });
}

#[test]
fn loop_hops_and_scope_say_who_hears() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bind(&bed, name));
        for socket in [&a, &b] {
            socket.join_multicast_v6(&GROUP, 0).unwrap();
            socket.join_multicast_v6(&"ff01::fb".parse().unwrap(), 0).unwrap();
        }
        assert_eq!((a.multicast_hops_v6().unwrap(), a.multicast_loop_v6().unwrap(), a.multicast_if_v6().unwrap()), (1, true, 0));
        for (hops, loops, expected) in
            [(1, true, [true, true]), (1, false, [false, true]), (0, true, [true, false]), (0, false, [false, false]), (255, true, [true, true])]
        {
            a.set_multicast_hops_v6(hops).unwrap();
            a.set_multicast_loop_v6(loops).unwrap();
            assert_eq!((a.multicast_hops_v6().unwrap(), a.multicast_loop_v6().unwrap()), (hops, loops));
            a.send_to(b"?", TO).await.unwrap();
            assert_eq!([hears(&a).await, hears(&b).await], expected, "{hops} {loops}");
        }
        // The settings of IPv4 are others.
        assert_eq!((a.multicast_ttl_v4().unwrap(), a.multicast_loop_v4().unwrap()), (1, true));
        a.set_multicast_loop_v4(false).unwrap();
        // A group of an interface never leaves its host.
        a.send_to(b"?", "[ff01::fb]:5353").await.unwrap();
        assert_eq!([hears(&a).await, hears(&b).await], [true, false]);
        // The interface of loopback has the same effect, and its own address.
        a.set_multicast_if_v6(1).unwrap();
        a.send_to(b"?", TO).await.unwrap();
        assert_eq!(a.recv_from(&mut [0; 8]).await.unwrap().1.to_string(), "[::1]:5353");
        assert!(!hears(&b).await);
    });
}

#[test]
fn all_hosts_are_members_without_joining() {
    Testbed::new(["a", "b"]).run(|bed| async move {
        let [a, b] = ["a", "b"].map(|name| bind(&bed, name));
        for (to, expected) in [
            ("[ff02::1]:5353", [true, true]),
            ("[ff01::1]:5353", [true, false]),
            ("[ff02::2]:5353", [false, false]),
            ("[ff05::1]:5353", [false, false]),
            ("224.0.0.1:5353", [true, true]),
            ("224.0.0.2:5353", [false, false]),
        ] {
            a.send_to(b"?", to).await.unwrap();
            assert_eq!([hears(&a).await, hears(&b).await], expected, "{to}");
        }
    });
}

#[test]
fn the_interface_decides_about_source_and_way() {
    let bed = Testbed::new(["phone", "wlan", "mast"]).interfaces("phone", ["wifi", "lte"]).nat("home", "open", ["wifi", "wlan"]);
    bed.run(|bed| async move {
        let [phone, wlan, mast] = ["phone", "wlan", "mast"].map(|name| bind(&bed, name));
        let four = Ipv4Addr::new(224, 0, 0, 251);
        for socket in [&wlan, &mast] {
            socket.join_multicast_v6(&GROUP, 0).unwrap();
            socket.join_multicast_v4(four, Ipv4Addr::UNSPECIFIED).unwrap();
        }
        let on = |zone: u32| SocketAddrV6::new(GROUP, 5353, 0, zone);
        // The uplink is the first interface, number 2.
        for (interface, zone, expected) in [
            (0, 0, [true, false]),
            (2, 0, [true, false]),
            (3, 0, [false, true]),
            (2, 3, [false, true]),
            (3, 2, [true, false]),
            (1, 0, [false, false]),
        ] {
            phone.set_multicast_if_v6(interface).unwrap();
            assert_eq!(phone.multicast_if_v6().unwrap(), interface);
            phone.send_to(b"?", on(zone)).await.unwrap();
            assert_eq!([hears(&wlan).await, hears(&mast).await], expected, "{interface} {zone}");
        }
        // The same with IPv4, by address.
        let [lte, wifi] = ["lte", "wifi"].map(|interface| bed.host("phone").uplink(interface).v4);
        for (interface, expected) in [(Ipv4Addr::UNSPECIFIED, [true, false]), (wifi, [true, false]), (lte, [false, true])] {
            phone.set_multicast_if_v4(&interface).unwrap();
            assert_eq!(phone.multicast_if_v4().unwrap(), interface);
            phone.send_to(b"?", (four, 5353)).await.unwrap();
            assert_eq!([hears(&wlan).await, hears(&mast).await], expected, "{interface}");
        }
    });
}

#[test]
#[cfg(target_os = "linux")]
fn mistakes_are_those_of_linux() {
    Testbed::new(["a"]).run(|bed| async move {
        let (a, four) = (bind(&bed, "a"), bed.host("a").bind("10.0.0.1:0").unwrap());
        let no_group: Ipv6Addr = "fd00::1".parse().unwrap();
        assert_eq!(number(a.join_multicast_v6(&no_group, 0)), Some(22));
        assert_eq!(number(a.leave_multicast_v6(&no_group, 0)), Some(22));
        assert_eq!(number(a.join_multicast_v6(&GROUP, 99)), Some(19));
        for interface in [0, 99] {
            assert_eq!(number(a.leave_multicast_v6(&GROUP, interface)), Some(99));
        }
        // A group is joined once by each interface.
        assert_eq!(number(a.join_multicast_v6(&GROUP, 0)), None);
        for interface in [0, 2] {
            assert_eq!(number(a.join_multicast_v6(&GROUP, interface)), Some(98));
        }
        assert_eq!(number(a.join_multicast_v6(&GROUP, 1)), None);
        assert_eq!(number(a.leave_multicast_v6(&GROUP, 99)), Some(99));
        assert_eq!(number(a.leave_multicast_v6(&GROUP, 0)), None);
        assert_eq!(number(a.leave_multicast_v6(&GROUP, 1)), None);
        assert_eq!(number(a.leave_multicast_v6(&GROUP, 0)), Some(99));

        assert_eq!(number(a.set_multicast_hops_v6(256)), Some(22));
        assert_eq!(number(a.set_multicast_if_v6(99)), Some(19));
        assert_eq!(number(a.set_multicast_if_v4(&Ipv4Addr::new(10, 0, 0, 9))), Some(99));
        // A socket of IPv4 has no options of IPv6.
        assert_eq!([number(four.multicast_loop_v6()), number(four.multicast_hops_v6()), number(four.multicast_if_v6())], [Some(95); 3]);
        assert_eq!([number(four.set_multicast_loop_v6(true)), number(four.join_multicast_v6(&GROUP, 0))], [Some(92); 2]);

        let on = |group: &str, zone: u32| SocketAddrV6::new(group.parse().unwrap(), 53, 0, zone);
        let host = bed.host("a");
        // A group of a link needs an interface in its address, and another group has none there.
        for (group, zone, expected) in [("ff02::fb", 0, Some(22)), ("ff02::fb", 99, Some(19)), ("ff02::fb", 2, None), ("ff05::fb", 99, None)] {
            assert_eq!(number(host.bind(on(group, zone))), expected, "{group} {zone}");
        }
        assert_eq!(host.bind(on("ff02::fb", 2)).unwrap().local_addr().unwrap(), on("ff02::fb", 2).into());
        assert_eq!(host.bind(on("ff05::fb", 99)).unwrap().local_addr().unwrap(), on("ff05::fb", 0).into());
        for (group, zone, expected) in [("ff02::fb", 0, Some(22)), ("ff02::fb", 2, None), ("ff05::fb", 0, None)] {
            assert_eq!(number(a.connect(on(group, zone)).await), expected, "{group} {zone}");
        }
        let b = bed.host("a").bind("[::]:0").unwrap();
        for (group, zone, expected) in [("ff02::fb", 1, Some(101)), ("ff02::fb", 99, Some(101)), ("ff02::fb", 2, None), ("ff05::fb", 99, None)] {
            assert_eq!(number(b.send_to(b"?", on(group, zone)).await), expected, "{group} {zone}");
        }
        // A bound group takes the port.
        let _bound = host.bind(on("ff05::fb", 0)).unwrap();
        for (at, expected) in
            [("[::]:53", Some(98)), ("[ff05::fb]:53", Some(98)), ("[fd00::1]:53", None), ("[ff05::fc]:53", None), ("[ff15::fb]:53", None)]
        {
            assert_eq!(number(host.bind(at)), expected, "{at}");
        }
    });
}
