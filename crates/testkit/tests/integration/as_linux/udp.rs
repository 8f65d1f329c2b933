//! Datagrams.

use std::io::ErrorKind;
use std::time::Duration;

use cohaptic_testkit::{Testbed, time};

use super::{R, beds, number, timed};

#[test]
fn a_socket_of_all_addresses_of_version_6_hears_version_4() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let (four, both) = (a.bind("0.0.0.0:7").unwrap(), b.bind("[::]:9").unwrap());
            four.send_to(b"four", "10.0.0.2:9").await.unwrap();
            let (_, from) = both.recv_from(&mut [0; 8]).await.unwrap();
            assert_eq!(from.to_string(), "[::ffff:10.0.0.1]:7");
            // The answer goes over IPv4, also if the program names the address of IPv4 itself.
            both.send_to(b"five", from).await.unwrap();
            both.send_to(b"six", "10.0.0.1:7").await.unwrap();
            for len in [4, 3] {
                assert_eq!(four.recv_from(&mut [0; 8]).await.unwrap(), (len, "10.0.0.2:9".parse().unwrap()));
            }
            for taken in ["0.0.0.0:9", "10.0.0.2:9", "[::1]:9"] {
                assert_eq!(number(b.bind(taken)), Some(98), "{taken}");
            }
            // Connected to an address of IPv4, the socket hears that peer alone.
            both.connect(from).await.unwrap();
            assert_eq!((both.local_addr().unwrap().to_string(), both.peer_addr().unwrap()), ("[::ffff:10.0.0.2]:9".into(), from));
            a.bind("0.0.0.0:8").unwrap().send_to(b"stranger", "10.0.0.2:9").await.unwrap();
            four.send_to(b"peer", "10.0.0.2:9").await.unwrap();
            assert_eq!(both.recv_from(&mut [0; 8]).await.unwrap(), (4, from));
            drop(both);
            b.bind("0.0.0.0:9").unwrap();
            // A socket of one version of IP has no address of the other one.
            assert_eq!(number(b.bind("[fd00::2]:10").unwrap().send_to(b"x", from).await), Some(101));
        });
    }
}

#[test]
fn the_local_address_of_a_connected_socket_is_the_one_it_sends_from() {
    beds()[0].clone().run_twice(|bed| async move {
        let socket = bed.host("a").bind("0.0.0.0:7").unwrap();
        let local = || socket.local_addr().unwrap().to_string();
        assert_eq!(local(), "0.0.0.0:7");
        socket.connect("b:9").await.unwrap();
        assert_eq!(local(), "10.0.0.1:7");
        socket.connect("127.0.0.5:9").await.unwrap();
        assert_eq!(local(), "127.0.0.1:7");
        let six = bed.host("a").bind("[::]:8").unwrap();
        six.connect("[b]:9").await.unwrap();
        assert_eq!(six.local_addr().unwrap().to_string(), "[fd00::1]:8");
    });
}

#[test]
fn where_datagrams_can_go() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let a = bed.host("a");
            let (socket, local, six) = (a.bind("0.0.0.0:0").unwrap(), a.bind("127.0.0.1:0").unwrap(), a.bind("[::]:0").unwrap());
            let is_at_once = |outcome| outcome == (Some(101), Duration::ZERO);
            for nobody in ["10.0.0.77:9", "10.200.1.1:9"] {
                for _ in 0..3 {
                    assert_eq!(socket.send_to(b"lost", nobody).await.unwrap(), 4);
                    time::sleep(Duration::from_secs(5)).await;
                }
            }
            assert_eq!(six.send_to(b"lost", "[fd00::77]:9").await.unwrap() + six.send_to(b"lost", "[fd12::1]:9").await.unwrap(), 8);
            assert!(is_at_once(timed(&bed, socket.send_to(b"x", "192.0.2.1:9")).await));
            assert!(is_at_once(timed(&bed, six.send_to(b"x", "[2001:db8::1]:9")).await));
            assert!(is_at_once(timed(&bed, socket.connect("192.0.2.1:9")).await));
            assert_eq!(number(socket.send_to(b"x", "10.0.0.2:0").await), Some(22));
            // From loopback only this host is reached, by each of its addresses.
            assert_eq!(number(local.send_to(b"x", "10.0.0.2:9").await), Some(22));
            assert_eq!(number(local.connect("10.0.0.2:9").await), Some(22));
            let own = a.bind("10.0.0.1:9").unwrap();
            local.send_to(b"own", "10.0.0.1:9").await.unwrap();
            assert_eq!(own.recv_from(&mut [0; 4]).await.unwrap(), (3, local.local_addr().unwrap()));
            // 127.0.0.5 reaches all addresses, and not 127.0.0.1.
            socket.send_to(b"five", ("127.0.0.5", local.local_addr().unwrap().port())).await.unwrap();
            assert_eq!(local.try_recv(&mut [0; 4]).unwrap_err().kind(), ErrorKind::WouldBlock);
            let wide = a.bind("0.0.0.0:10").unwrap();
            socket.send_to(b"five", "127.0.0.5:10").await.unwrap();
            assert_eq!(wide.try_recv_from(&mut [0; 4]).unwrap().1.ip().to_string(), "127.0.0.1");
            assert_eq!(number(a.bind("10.0.0.2:11")), Some(99));
        });
    }
}

/// Several sockets of a host may have one port, each with an address of its own.
#[test]
fn each_address_of_a_port_has_its_own_socket() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let (a, b) = (bed.host("a"), bed.host("b"));
            let at = ["10.0.0.2:9", "127.0.0.1:9", "127.0.0.5:9", "[fd00::2]:9", "[::1]:9"];
            let sockets = at.map(|at| b.bind(at).unwrap());
            assert!(["0.0.0.0:9", "[::]:9", at[2]].iter().all(|taken| number(b.bind(*taken)) == Some(98)));
            let [far, near] = [[a.bind("0.0.0.0:1").unwrap(), a.bind("[::]:2").unwrap()], [b.bind("0.0.0.0:1").unwrap(), b.bind("[::]:2").unwrap()]];
            for (place, (at, socket)) in at.iter().zip(&sockets).enumerate() {
                let senders = if matches!(place, 0 | 3) { &far } else { &near };
                senders[usize::from(place > 2)].send_to(&[0; 9][..place], *at).await.unwrap();
                assert_eq!(socket.recv(&mut [0; 9]).await.unwrap(), place, "{at}");
            }
            // The other sockets keep their addresses when the first socket is closed.
            let [first, others @ ..] = sockets;
            drop(first);
            near[0].send_to(b"five", at[2]).await.unwrap();
            assert_eq!(others[1].recv(&mut [0; 9]).await.unwrap(), 4);
            assert_eq!(others[0].try_recv(&mut [0; 9]).unwrap_err().kind(), ErrorKind::WouldBlock);
        });
    }
}

#[test]
fn a_broadcast_is_heard_by_sockets_of_all_addresses_and_by_no_others() {
    for to in ["255.255.255.255:5", "10.255.255.255:5"] {
        Testbed::new(["a", "b", "c"]).links("delay 10ms").run_twice(move |bed| async move {
            let (a, b, c) = (bed.host("a"), bed.host("b"), bed.host("c"));
            let (sender, wide, narrow) = (a.bind("0.0.0.0:5").unwrap(), b.bind("[::]:5").unwrap(), c.bind("10.0.0.3:5").unwrap());
            assert_eq!(number(sender.send_to(b"all", to).await), Some(13));
            assert_eq!(number(sender.connect(to).await), Some(13));
            sender.set_broadcast(true).unwrap();
            sender.send_to(b"all", to).await.unwrap();
            // The sender's own sockets hear the datagram at once.
            assert_eq!(sender.try_recv_from(&mut [0; 3]).unwrap(), (3, "10.0.0.1:5".parse().unwrap()));
            assert_eq!(wide.recv_from(&mut [0; 3]).await.unwrap().1.to_string(), "[::ffff:10.0.0.1]:5");
            time::sleep(R).await;
            assert_eq!(narrow.try_recv(&mut [0; 3]).unwrap_err().kind(), ErrorKind::WouldBlock);
        });
    }
}

#[test]
fn a_closed_port_is_told_to_a_connected_socket_once() {
    for bed in beds() {
        bed.run_twice(|bed| async move {
            let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
            socket.connect("b:9").await.unwrap();
            // The answer takes a round trip, and until then sending succeeds.
            socket.send(b"x").await.unwrap();
            time::sleep(R / 2).await;
            socket.send(b"x").await.unwrap();
            time::sleep(R / 2).await;
            assert_eq!(number(socket.send(b"x").await), Some(111));
            socket.send(b"x").await.unwrap();
            assert_eq!(timed(&bed, socket.recv(&mut [0; 1])).await, (Some(111), R / 2), "the answer to the second one");
            time::sleep(R).await;
            assert_eq!(socket.take_error().unwrap().unwrap().raw_os_error(), Some(111));
            assert!(socket.take_error().unwrap().is_none());
            let unconnected = bed.host("a").bind("0.0.0.0:0").unwrap();
            unconnected.send_to(b"x", "b:9").await.unwrap();
            time::sleep(R).await;
            unconnected.send_to(b"x", "b:9").await.unwrap();
            assert!(unconnected.take_error().unwrap().is_none());
        });
    }
}

#[test]
fn lengths_of_datagrams() {
    beds()[0].clone().run_twice(|bed| async move {
        let (a, b) = (bed.host("a").bind("[::]:7").unwrap(), bed.host("b").bind("[::]:9").unwrap());
        assert_eq!(number(a.send(b"x").await), Some(89));
        for (to, longest) in [("10.0.0.2:9", 65_507), ("[fd00::2]:9", 65_527)] {
            assert_eq!(number(a.send_to(&vec![0; longest + 1], to).await), Some(90));
            assert_eq!(a.send_to(&vec![0; longest], to).await.unwrap(), longest);
            assert_eq!(b.recv(&mut vec![0; 70_000]).await.unwrap(), longest);
        }
        // An empty datagram is a datagram, and a receiver without space takes one.
        assert_eq!(a.send_to(b"", "10.0.0.2:9").await.unwrap(), 0);
        assert_eq!(b.recv(&mut [0; 4]).await.unwrap(), 0);
        a.send_to(b"gone", "10.0.0.2:9").await.unwrap();
        a.send_to(b"stays", "10.0.0.2:9").await.unwrap();
        assert_eq!(b.recv(&mut []).await.unwrap(), 0);
        assert_eq!(b.recv(&mut [0; 8]).await.unwrap(), 5);
    });
}
