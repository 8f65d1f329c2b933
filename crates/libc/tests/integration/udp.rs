use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::AsRawFd;
use std::time::Duration;

use cohaptic_testkit::time::sleep;
use cohaptic_testkit::{Bed, Testbed, UdpSocket as Virtual};
use socket2::{Domain, Protocol, SockRef, Socket, Type};

use crate::run;

fn bind(at: &str) -> UdpSocket {
    let socket = UdpSocket::bind(at).unwrap();
    socket.set_nonblocking(true).unwrap();
    socket
}

#[test]
fn datagrams_take_the_link() {
    run(async |bed: Bed| {
        let server = bed.host("server").spawn(async {
            let socket = bind("0.0.0.0:7");
            let mut buffer = [0; 9];
            assert_eq!(socket.recv_from(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
            sleep(Duration::from_millis(9)).await;
            assert_eq!(socket.recv_from(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
            sleep(Duration::from_millis(2)).await;
            assert_eq!(socket.peek(&mut buffer[..2]).unwrap(), 2);
            let (count, from) = socket.recv_from(&mut buffer).unwrap();
            assert_eq!((&buffer[..count], from.ip().to_string()), (&b"question"[..], "10.0.0.1".to_owned()));
            socket.send_to(b"answer", from).unwrap();
        });
        let client = bed.host("client").spawn(async {
            let socket = bind("0.0.0.0:0");
            socket.connect("10.0.0.2:7").unwrap();
            assert_eq!(socket.peer_addr().unwrap().to_string(), "10.0.0.2:7");
            assert_eq!(socket.local_addr().unwrap().ip().to_string(), "10.0.0.1");
            assert_eq!(socket.send(b"question").unwrap(), 8);
            sleep(Duration::from_millis(21)).await;
            // A duplicate is the same socket, and outlives the first descriptor.
            let other = socket.try_clone().unwrap();
            drop(socket);
            let mut buffer = [0; 3];
            assert_eq!((other.recv(&mut buffer).unwrap(), &buffer), (3, b"ans"));
        });
        server.await.unwrap();
        client.await.unwrap();
    });
}

/// A port is free again after the last descriptor was closed, and not before.
#[test]
fn the_last_descriptor_closes_the_socket() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let socket = bind("0.0.0.0:9");
            let other = socket.try_clone().unwrap();
            drop(socket);
            assert_eq!(UdpSocket::bind("0.0.0.0:9").unwrap_err().kind(), ErrorKind::AddrInUse);
            drop(other);
            // The sockets of the test kit itself have the same ports.
            drop(Virtual::bind("0.0.0.0:9").await.unwrap());
            drop(bind("0.0.0.0:9"));
        });
        client.await.unwrap();
    });
}

/// A duplicate in the place of another descriptor closes the socket there, and a duplicate that cannot be made closes nothing.
#[test]
fn a_descriptor_is_replaced_by_a_duplicate() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let (first, second) = (bind("0.0.0.0:9"), bind("0.0.0.0:10"));
            // SAFETY: the call takes numbers only.
            let dup2 = |from: i32, to: i32| unsafe { libc::dup2(from, to) };
            assert_eq!(dup2(-1, second.as_raw_fd()), -1);
            assert_eq!(UdpSocket::bind("0.0.0.0:10").unwrap_err().kind(), ErrorKind::AddrInUse);
            assert_eq!(dup2(first.as_raw_fd(), second.as_raw_fd()), second.as_raw_fd());
            drop(bind("0.0.0.0:10"));
            drop(first);
            assert_eq!(UdpSocket::bind("0.0.0.0:9").unwrap_err().kind(), ErrorKind::AddrInUse);
            assert_eq!(second.local_addr().unwrap().port(), 9);
            drop(second);
            drop(bind("0.0.0.0:9"));
        });
        client.await.unwrap();
    });
}

/// A group is joined in the test bed, and by no option that would join the group on a real interface.
#[test]
fn multicast_has_the_options_of_the_placeholder() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let (group, any) = (Ipv4Addr::new(224, 0, 0, 251), Ipv4Addr::UNSPECIFIED);
            let socket = bind("0.0.0.0:5353");
            let refused = SockRef::from(&socket).join_ssm_v4(&Ipv4Addr::new(10, 0, 0, 2), &Ipv4Addr::new(232, 0, 0, 1), &any);
            assert_eq!(refused.unwrap_err().raw_os_error(), Some(libc::ENOPROTOOPT));
            socket.join_multicast_v4(&group, &any).unwrap();
            let mut buffer = [0; 9];
            socket.send_to(b"all", (group, 5353)).unwrap();
            assert_eq!(socket.recv(&mut buffer).unwrap(), 3);
            socket.set_multicast_loop_v4(false).unwrap();
            socket.send_to(b"all", (group, 5353)).unwrap();
            assert_eq!(socket.recv(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
        });
        client.await.unwrap();
    });
}

/// `setsockopt` with bytes.
fn set(socket: &impl AsRawFd, level: i32, name: i32, value: &[u8]) -> std::io::Result<()> {
    // SAFETY: the value is valid for reading its length.
    let outcome = unsafe { libc::setsockopt(socket.as_raw_fd(), level, name, value.as_ptr().cast(), u32::try_from(value.len()).unwrap()) };
    if outcome == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
}

fn number<T: std::fmt::Debug>(outcome: std::io::Result<T>) -> i32 {
    outcome.unwrap_err().raw_os_error().unwrap()
}

/// Before the bind and after, groups of both versions are joined in the test bed, and interfaces are those of the host.
#[test]
fn groups_and_interfaces_are_those_of_the_host() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let group: std::net::Ipv6Addr = "ff02::fb".parse().unwrap();
            let socket = Socket::new(Domain::IPV6, Type::DGRAM, None).unwrap();
            socket.set_nonblocking(true).unwrap();
            assert_eq!(number(socket.join_multicast_v6(&group, 99)), libc::ENODEV);
            socket.join_multicast_v6(&group, 0).unwrap();
            assert_eq!(number(socket.join_multicast_v6(&group, 0)), libc::EADDRINUSE);
            assert_eq!(number(socket.set_multicast_if_v6(99)), libc::ENODEV);
            socket.set_multicast_if_v6(2).unwrap();
            assert_eq!(socket.multicast_if_v6().unwrap(), 2);
            socket.set_multicast_hops_v6(0).unwrap();
            socket.bind(&"[::]:5353".parse::<SocketAddr>().unwrap().into()).unwrap();
            assert_eq!((socket.multicast_if_v6().unwrap(), socket.multicast_hops_v6().unwrap()), (2, 0));
            let socket = UdpSocket::from(socket);
            let mut buffer = [0; 9];
            socket.send_to(b"all", (group, 5353)).unwrap();
            assert_eq!(socket.recv_from(&mut buffer).unwrap(), (3, "[fd00::1]:5353".parse().unwrap()));
            socket.set_multicast_loop_v6(false).unwrap();
            socket.send_to(b"all", (group, 5353)).unwrap();
            assert_eq!(socket.recv(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
            // The loop of IPv4 is another option of the same socket.
            socket.join_multicast_v4(&Ipv4Addr::new(224, 0, 0, 251), &Ipv4Addr::UNSPECIFIED).unwrap();
            socket.send_to(b"all", "[::ffff:224.0.0.251]:5353").unwrap();
            assert_eq!(socket.recv(&mut buffer).unwrap(), 3);
            socket.leave_multicast_v6(&group, 0).unwrap();
            assert_eq!(number(socket.leave_multicast_v6(&group, 0)), libc::EADDRNOTAVAIL);
            let four = bind("0.0.0.0:0");
            assert_eq!(number(four.join_multicast_v6(&group, 0)), libc::ENOPROTOOPT);
            assert_eq!(number(SockRef::from(&four).multicast_if_v6()), libc::EOPNOTSUPP);
        });
        client.await.unwrap();
    });
}

/// `IP_MULTICAST_IF` takes an `in_addr`, an `ip_mreq` or an `ip_mreqn`, and `IP_ADD_MEMBERSHIP` the last two: outcomes as measured with Linux.
#[test]
fn an_interface_of_ipv4_is_named_in_three_ways() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let (none, own, other) = ([0; 4], [10, 0, 0, 1], [10, 0, 0, 9]);
            let select = |value: &[&[u8]]| {
                let socket = Socket::new(Domain::IPV4, Type::DGRAM, None).unwrap();
                let outcome = set(&socket, libc::IPPROTO_IP, libc::IP_MULTICAST_IF, &value.concat());
                outcome.map_err(|error| error.raw_os_error().unwrap()).map(|()| socket.multicast_if_v4().unwrap().octets())
            };
            let (any, two, many) = (0_u32.to_ne_bytes(), 2_u32.to_ne_bytes(), 99_u32.to_ne_bytes());
            assert_eq!(select(&[&own]), Ok(own));
            assert_eq!(select(&[&other]), Err(libc::EADDRNOTAVAIL));
            assert_eq!(select(&[&none]), Ok(none));
            assert_eq!(select(&[&[127, 0, 0, 1]]), Ok([127, 0, 0, 1]));
            assert_eq!(select(&[&[224, 0, 0, 1], &own]), Ok(own));
            assert_eq!(select(&[&none, &none, &two]), Ok(none));
            assert_eq!(select(&[&none, &none, &many]), Err(libc::EADDRNOTAVAIL));
            assert_eq!(select(&[&none, &own, &any]), Ok(own));
            assert_eq!(select(&[&own, b"abc"]), Ok(own));
            assert_eq!(select(&[b"ab"]), Err(libc::EINVAL));

            let socket = bind("0.0.0.0:5353");
            SockRef::from(&socket).set_multicast_if_v4(&Ipv4Addr::from(own)).unwrap();
            assert_eq!(SockRef::from(&socket).multicast_if_v4().unwrap().octets(), own);
            let join = |value: &[&[u8]]| set(&socket, libc::IPPROTO_IP, libc::IP_ADD_MEMBERSHIP, &value.concat());
            join(&[&[224, 0, 0, 9], &other, &two]).unwrap();
            assert_eq!(number(join(&[&[224, 0, 0, 9], &own])), libc::EADDRINUSE);
            assert_eq!(number(join(&[&[224, 0, 0, 8], &own, &many])), libc::ENODEV);
            assert_eq!(number(join(&[&[224, 0, 0, 8], b"abc"])), libc::EINVAL);
            socket.send_to(b"all", "224.0.0.9:5353").unwrap();
            assert_eq!(socket.recv(&mut [0; 9]).unwrap(), 3);
        });
        client.await.unwrap();
    });
}

#[test]
fn errors_have_the_numbers_of_linux() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let socket = bind("0.0.0.0:0");
            let to = |text: &str| text.parse::<SocketAddr>().unwrap();
            let number = |outcome: std::io::Result<usize>| outcome.unwrap_err().raw_os_error().unwrap();
            assert_eq!(number(socket.send(b"x")), libc::EDESTADDRREQ);
            let ping = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::ICMPV4));
            assert_eq!(ping.unwrap_err().raw_os_error(), Some(libc::EPROTONOSUPPORT));
            assert_eq!(number(socket.send_to(b"x", to("255.255.255.255:1"))), libc::EACCES);
            socket.set_broadcast(true).unwrap();
            socket.send_to(b"x", to("255.255.255.255:1")).unwrap();
            assert_eq!(number(socket.send_to(&[0; 70_000], to("10.0.0.2:1"))), libc::EMSGSIZE);
            assert_eq!(number(socket.send_to(b"x", to("[fd00::2]:1"))), libc::EAFNOSUPPORT);
            assert_eq!(UdpSocket::bind("10.0.0.9:0").unwrap_err().raw_os_error(), Some(libc::EADDRNOTAVAIL));
            socket.connect("10.0.0.2:99").unwrap();
            socket.send(b"x").unwrap();
            sleep(Duration::from_millis(21)).await;
            assert_eq!(socket.take_error().unwrap().unwrap().raw_os_error(), Some(libc::ECONNREFUSED));
            assert!(socket.take_error().unwrap().is_none());
        });
        client.await.unwrap();
    });
}

/// The placeholder has the options, and the socket of the test bed follows.
#[test]
fn options_that_are_set_before_and_after_the_bind_hold() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            let socket = Socket::new(Domain::IPV4, Type::DGRAM, None).unwrap();
            socket.set_nonblocking(true).unwrap();
            // The kernel doubles the size, and finds it too small for two datagrams of 1000 octets.
            socket.set_recv_buffer_size(1500).unwrap();
            socket.bind(&"0.0.0.0:5".parse::<SocketAddr>().unwrap().into()).unwrap();
            socket.set_broadcast(true).unwrap();
            socket.set_ttl_v4(3).unwrap();
            assert_eq!((socket.recv_buffer_size().unwrap(), socket.ttl_v4().unwrap()), (3000, 3));
            let socket = UdpSocket::from(socket);
            for _ in 0..2 {
                socket.send_to(&[0; 1000], "127.0.0.1:5").unwrap();
            }
            let mut buffer = [0; 2000];
            assert_eq!(socket.recv(&mut buffer).unwrap(), 1000);
            assert_eq!(socket.recv(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
            assert_eq!(socket.send_to(b"all", "255.255.255.255:5").unwrap(), 3);
            assert_eq!(socket.recv(&mut buffer).unwrap(), 3);
        });
        client.await.unwrap();
    });
}

#[test]
fn outside_of_a_test_bed_sockets_are_real() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let own = socket.local_addr().unwrap();
    socket.send_to(b"real", own).unwrap();
    let mut buffer = [0; 9];
    assert_eq!(socket.recv_from(&mut buffer).unwrap(), (4, own));
    // A socket from before is a real one in a test bed as well.
    Testbed::new(["host"]).run(async move |bed| {
        bed.host("host").spawn(async move { assert_eq!(socket.send_to(b"real", own).unwrap(), 4) }).await.unwrap();
    });
}
