//! Hosts with several interfaces.

use std::net::SocketAddr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use cohaptic_testkit::{Instant, LinkFile, Testbed, UdpSocket, time};

/// A phone with two networks, each behind a NAT.
fn phone() -> Testbed {
    Testbed::new(["phone", "server", "tv"])
        .interfaces("phone", ["wifi", "lte"])
        .nat("home", "home", ["wifi", "tv"])
        .nat("carrier", "cgnat", ["lte"])
        .link_both("wifi", "home", "delay 1ms")
        .link_both("lte", "carrier", "delay 40ms")
}

async fn heard_from(socket: &UdpSocket) -> Option<SocketAddr> {
    time::timeout(Duration::from_secs(1), socket.recv_from(&mut [0; 64])).await.ok().map(|heard| heard.unwrap().1)
}

#[test]
fn the_uplink_decides_where_unbound_sockets_send_from() {
    for bed in [phone(), phone().on_tokio()] {
        bed.run_twice(|bed| async move {
            let host = bed.host("phone");
            assert_eq!((bed.hosts().len(), host.ip().to_string()), (3, "192.168.1.1".to_owned()));
            let server = bed.host("server").bind("0.0.0.0:7").unwrap();
            let socket = host.bind("0.0.0.0:5000").unwrap();
            socket.send_to(b"?", "server:7").await.unwrap();
            let by_wifi = heard_from(&server).await.unwrap();
            assert_eq!((by_wifi.to_string(), bed.now()), ("10.0.0.6:5000".to_owned(), Instant::from_nanos(1_000_000)));
            let addresses = host.uplink("lte");
            assert_eq!((addresses, addresses.v4.to_string()), (host.addresses(), "100.64.2.1".to_owned()));
            socket.send_to(b"?", "server:7").await.unwrap();
            let by_lte = heard_from(&server).await.unwrap();
            assert_eq!((by_lte.ip().to_string(), bed.now()), ("10.0.0.7".to_owned(), Instant::from_nanos(41_000_000)));
            // Both interfaces are up, and the socket hears by both.
            for to in [by_wifi, by_lte] {
                server.send_to(b"!", to).await.unwrap();
                assert!(heard_from(&socket).await.is_some());
            }
            // Back in the first network, the phone has the address that it had.
            assert_eq!(host.uplink("wifi").v4.to_string(), "192.168.1.1");
        });
    }
}

#[test]
fn a_socket_bound_to_an_interface_uses_that_interface() {
    phone().run(|bed| async move {
        let server = bed.host("server").bind("[::]:7").unwrap();
        for (bound, v4, v6) in [("wifi:0", "10.0.0.6", "fd00::4"), ("lte:0", "10.0.0.7", "fd00::5")] {
            for uplink in ["wifi", "lte"] {
                bed.host("phone").uplink(uplink);
                let four = bed.host("phone").bind(bound).unwrap();
                four.send_to(b"?", "server:7").await.unwrap();
                assert_eq!(heard_from(&server).await.unwrap().ip().to_canonical().to_string(), v4);
                let six = bed.host("phone").bind(format!("[{}]:0", bound.trim_end_matches(":0"))).unwrap();
                // The port 0 of a name in brackets has been cut off, and is written again.
                six.send_to(b"?", "[server]:7").await.unwrap();
                assert_eq!(heard_from(&server).await.unwrap().ip().to_string(), v6);
            }
        }
        // The host reaches itself by all of its addresses.
        let socket = bed.host("phone").bind("0.0.0.0:5000").unwrap();
        for name in ["wifi:5000", "lte:5000", "phone:5000", "localhost:5000"] {
            let to = if name == "localhost:5000" { "127.0.0.1:5000" } else { name };
            socket.send_to(b"?", to).await.unwrap();
            assert!(heard_from(&socket).await.is_some(), "{name}");
        }
    });
}

#[test]
fn names_are_those_of_the_networks_of_all_interfaces() {
    phone().run(|bed| async move {
        let tv = bed.host("tv").bind("0.0.0.0:7").unwrap();
        let socket = bed.host("phone").bind("0.0.0.0:5000").unwrap();
        for uplink in ["wifi", "lte"] {
            bed.host("phone").uplink(uplink);
            // The name is known in both networks, and the address means something in one of them.
            socket.send_to(b"?", "tv:7").await.unwrap();
            assert_eq!(heard_from(&tv).await.is_some(), uplink == "wifi");
            // The name of the phone stands for its uplink, which is out of reach from home while it is the other one.
            assert_eq!(tv.send_to(b"?", "phone:5000").await.is_ok(), uplink == "wifi");
        }
    });
}

#[test]
fn a_new_address_is_that_of_the_uplink() {
    phone().run(|bed| async move {
        let host = bed.host("phone");
        host.uplink("lte");
        let addresses = host.change_addresses();
        assert_eq!((addresses, addresses.v4.to_string()), (host.addresses(), "100.64.2.2".to_owned()));
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        for uplink in ["wifi", "lte"] {
            host.uplink(uplink);
            host.bind("0.0.0.0:0").unwrap().send_to(b"?", "server:7").await.unwrap();
            assert!(heard_from(&server).await.is_some());
        }
        assert_eq!(host.addresses(), addresses);
        assert_eq!(bed.owner(addresses.v4.into()).as_deref(), Some("phone"));
    });
}

#[test]
fn the_message_that_nobody_listens_comes_back_to_the_interface() {
    Testbed::new(["phone", "server"]).interfaces("phone", ["wifi", "lte"]).run(|bed| async move {
        let socket = bed.host("phone").bind("lte:0").unwrap();
        socket.connect("server:9").await.unwrap();
        socket.send(b"?").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
        assert_eq!(socket.send(b"?").await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
        let server = bed.host("server").bind("0.0.0.0:0").unwrap();
        for interface in ["wifi:9", "lte:9"] {
            server.connect(interface).await.unwrap();
            server.send(b"?").await.unwrap();
            time::sleep(Duration::from_millis(1)).await;
            assert_eq!(server.send(b"?").await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
        }
        // A broadcast leaves by the uplink, and is heard by both interfaces as one host.
        server.set_broadcast(true).unwrap();
        let listening = bed.host("phone").bind("0.0.0.0:5").unwrap();
        server.send_to(b"?", "255.255.255.255:5").await.unwrap();
        assert!(heard_from(&listening).await.is_some());
    });
}

/// A host does not hear itself over the network, and hears others once by each interface.
#[test]
fn each_interface_hears_a_broadcast_and_a_multicast_once() {
    Testbed::new(["phone", "server"]).interfaces("phone", ["wifi", "lte"]).run(|bed| async move {
        let sockets = ["phone", "server"].map(|name| bed.host(name).bind("0.0.0.0:5353").unwrap());
        for socket in &sockets {
            socket.set_broadcast(true).unwrap();
            socket.join_multicast_v4([224, 0, 0, 251].into(), [0; 4].into()).unwrap();
        }
        for to in ["255.255.255.255:5353", "224.0.0.251:5353"] {
            for (sender, expected) in sockets.iter().zip([[1, 1], [2, 1]]) {
                sender.send_to(b"?", to).await.unwrap();
                let mut heard = [0; 2];
                for (socket, heard) in sockets.iter().zip(&mut heard) {
                    while heard_from(socket).await.is_some() {
                        *heard += 1;
                    }
                }
                assert_eq!(heard, expected, "{to}");
            }
        }
    });
}

#[cfg(feature = "tcp")]
#[test]
fn a_connection_stays_on_the_interface_of_its_address() {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    phone().run(|bed| async move {
        let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
        let mut connections = Vec::new();
        for (uplink, seen) in [("wifi", "10.0.0.6"), ("lte", "10.0.0.7")] {
            bed.host("phone").uplink(uplink);
            let client = bed.host("phone").connect("server:80").await.unwrap();
            let (server, from) = listener.accept().await.unwrap();
            assert_eq!(from.ip().to_string(), seen);
            connections.push((client, server));
        }
        for (client, server) in &mut connections {
            client.write_all(b"?").await.unwrap();
            server.read_exact(&mut [0]).await.unwrap();
        }
        // The phone leaves the reach of the first network.
        bed.cut("wifi", "home");
        for ((client, server), expected) in connections.iter_mut().zip([false, true]) {
            client.write_all(b"?").await.unwrap();
            assert_eq!(time::timeout(Duration::from_secs(9), server.read_exact(&mut [0])).await.is_ok(), expected);
        }
    });
}

#[test]
fn interfaces_stand_in_files_and_records() {
    let text = "hosts: phone server\ninterfaces phone: wifi lte\nnat home: wifi\nlte -> server: delay 9ms\n";
    let file = LinkFile::parse(text).unwrap();
    assert_eq!((file.hosts(), file.between(3, 1).mean_delay().as_millis()), (&["phone", "server"].map(String::from)[..], 9));
    let folder = tempfile::tempdir().unwrap();
    let ((), record) = Testbed::from(file).run_recorded(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        bed.host("phone").bind("lte:0").unwrap().send_to(b"?", "server:7").await.unwrap();
        assert_eq!((heard_from(&server).await.unwrap().ip().to_string(), bed.now().as_nanos()), ("10.0.0.4".to_owned(), 9_000_000));
    });
    record.write(folder.path().join("kept")).unwrap();
    let links = std::fs::read_to_string(folder.path().join("kept/links.txt")).unwrap();
    assert!(links.contains("hosts: phone server\ninterfaces phone: wifi lte\nnat home home: wifi\nlte -> server: replay"), "{links}");
    assert_eq!(Testbed::from_file(folder.path().join("kept/links.txt")).hosts(), ["phone", "server"]);
}

#[test]
fn interfaces_that_make_no_sense_are_refused() {
    let hosts = || Testbed::new(["a", "b"]);
    let nothing = || |_| async {};
    for (message, run) in [
        ("there is no host `x`", &(|| drop(hosts().interfaces("x", ["w"]))) as &dyn Fn()),
        ("host `a` gets no interfaces", &|| drop(hosts().interfaces("a", []))),
        ("two hosts have the name `b`", &|| drop(hosts().interfaces("a", ["b"]))),
        ("host `a` cannot get interfaces: it has interfaces, or is one", &|| drop(hosts().interfaces("a", ["w"]).interfaces("a", ["l"]))),
        ("host `a` cannot get interfaces: it is `n` or behind it", &|| drop(hosts().nat("n", "", ["a"]).interfaces("a", ["w"]))),
        ("host `a` has interfaces, and cannot be behind `n` itself", &|| drop(hosts().interfaces("a", ["w"]).nat("n", "", ["a"]))),
        ("`a` has no link to `b`", &|| hosts().interfaces("a", ["w"]).link("a", "b", "delay 1ms").run(nothing())),
        ("`b` has no link to `a`", &|| hosts().interfaces("a", ["w"]).link("b", "a", "delay 1ms").run(nothing())),
        ("`a` has no link to `b`", &|| hosts().interfaces("a", ["w"]).run(|bed| async move { bed.cut("a", "b") })),
        ("`b` has no link to `a`", &|| hosts().interfaces("a", ["w"]).run(|bed| async move { bed.cut("b", "a") })),
        ("`w` is an interface of host `a`", &|| hosts().interfaces("a", ["w"]).run(|bed| async move { drop(bed.host("w")) })),
        ("host `a` has no interface `b`", &|| {
            hosts().interfaces("a", ["w"]).run(|bed| async move {
                let _ = bed.host("a").uplink("b");
            })
        }),
        ("`b` is a host", &|| hosts().interfaces("a", ["w"]).run(|bed| async move { drop(bed.nat("b")) })),
    ] {
        let panic = catch_unwind(AssertUnwindSafe(run)).unwrap_err();
        let found = panic.downcast_ref::<String>().cloned().unwrap_or_else(|| (*panic.downcast_ref::<&str>().unwrap()).to_owned());
        assert!(found.starts_with(message), "{found}");
    }
}
