//! NATs and firewalls.

#[cfg(feature = "strategies")]
mod drawn;
mod firewalls;
mod inside;
mod punching;
mod records;
#[cfg(feature = "tcp")]
mod tcp;

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::{Happening, Host, Lost, Testbed, Trace, UdpSocket, time};

/// Returns the addresses from which a host of the network outside hears a datagram sent to `to`, after at most a second.
async fn heard_from(socket: &UdpSocket) -> Option<SocketAddr> {
    time::timeout(Duration::from_secs(1), socket.recv_from(&mut [0; 64])).await.ok().map(|heard| heard.unwrap().1)
}

/// Sends a letter from a socket, and returns whether another socket hears the letter within a second.
async fn passes(from: &UdpSocket, to: SocketAddr, at: &UdpSocket) -> bool {
    from.send_to(b"?", to).await.unwrap();
    heard_from(at).await.is_some()
}

/// Returns how often packets were lost for a cause.
fn lost(trace: &Trace, cause: Lost) -> usize {
    trace.events().iter().filter(|event| matches!(event.what, Happening::Lost { why, .. } if why == cause)).count()
}

fn bind(host: &Host, address: &str) -> UdpSocket {
    host.bind(address).unwrap()
}

#[test]
fn a_nat_translates_what_goes_out_and_what_comes_back() {
    let bed = Testbed::new(["laptop", "server"]).nat("router", "home", ["laptop"]).link_both("router", "server", "delay 20ms").traced();
    bed.on_tokio().run_twice(|bed| async move {
        let [laptop, server] = ["laptop", "server"].map(|name| bed.host(name));
        assert_eq!(laptop.ip().to_string(), "192.168.1.1");
        assert_eq!(bed.addresses().to_string(), "laptop 192.168.1.1 fd00::1\nserver 10.0.0.2 fd00::2\nrouter 10.0.0.3 fd00::3\n");
        let [inside, outside] = [bind(&laptop, "0.0.0.0:5000"), bind(&server, "0.0.0.0:7")];
        inside.send_to(b"?", "server:7").await.unwrap();
        let from = heard_from(&outside).await.unwrap();
        assert_eq!((from.to_string(), bed.now().as_nanos()), ("10.0.0.3:5000".to_owned(), 20_000_000));
        assert!(passes(&outside, from, &inside).await);
        // The answer comes from the address to which the question went.
        inside.connect("server:7").await.unwrap();
        inside.send(b"?").await.unwrap();
        assert_eq!(heard_from(&outside).await, Some(from));
        assert!(passes(&outside, from, &inside).await);
        let mappings: Vec<String> = bed.nat("router").mappings().iter().map(ToString::to_string).collect();
        assert_eq!(mappings, ["UDP 192.168.1.1:5000 is 10.0.0.3:5000 for 10.0.0.2:7"]);
        let trace = bed.trace();
        let forwarded: Vec<String> = trace
            .events()
            .iter()
            .filter(|event| matches!(event.what, Happening::Forwarded { .. }))
            .map(|event| trace.words(event).to_string())
            .collect();
        assert_eq!(
            &forwarded[..2],
            [
                "0 s  laptop -> router  packet 0 translated: 192.168.1.1:5000 > 10.0.0.2:7 becomes 10.0.0.3:5000 > 10.0.0.2:7",
                "0.04 s  server -> router  packet 0 translated: 10.0.0.2:7 > 10.0.0.3:5000 becomes 10.0.0.2:7 > 192.168.1.1:5000"
            ]
        );
    });
}

#[test]
fn a_mapping_ends_without_outbound_packets() {
    let second = Duration::from_secs(1);
    for (words, answered, unanswered) in [("home", 300, 30), ("strict", 120, 120), ("home udp-timeout 10s", 10, 10)] {
        Testbed::new(["laptop", "server"]).nat("router", words, ["laptop"]).run(move |bed| async move {
            let (inside, outside) = (bind(&bed.host("laptop"), "0.0.0.0:5000"), bind(&bed.host("server"), "0.0.0.0:7"));
            let question = async || {
                inside.send_to(b"?", "server:7").await.unwrap();
                heard_from(&outside).await.unwrap()
            };
            let before = question().await;
            time::sleep(unanswered * second - Duration::from_nanos(1)).await;
            assert!(passes(&outside, before, &inside).await, "{words}");
            let now = question().await;
            assert!(passes(&outside, now, &inside).await);
            // Packets from outside do not keep the mapping.
            for _ in 0..answered - 1 {
                time::sleep(second).await;
                assert!(passes(&outside, now, &inside).await);
            }
            time::sleep(second).await;
            assert_eq!((passes(&outside, now, &inside).await, bed.nat("router").filtered()), (false, 1), "{words}");
            assert!(bed.nat("router").mappings().is_empty());
        });
    }
}

#[test]
fn a_nat_that_forgets_drops_answers_and_changes_while_it_runs() {
    Testbed::new(["laptop", "server", "other"]).nat("router", "home", ["laptop"]).traced().run(|bed| async move {
        let inside = bind(&bed.host("laptop"), "0.0.0.0:5000");
        let [server, other] = ["server", "other"].map(|name| bind(&bed.host(name), "0.0.0.0:7"));
        inside.send_to(b"?", "server:7").await.unwrap();
        let mapped = heard_from(&server).await.unwrap();
        assert!(!passes(&other, mapped, &inside).await);
        bed.nat("router").set("filter endpoint-independent");
        assert!(passes(&other, mapped, &inside).await);
        bed.nat("router").forget();
        assert!(!passes(&server, mapped, &inside).await);
        bed.nat("router").set("strict");
        inside.send_to(b"?", "server:7").await.unwrap();
        assert_ne!(heard_from(&server).await, Some(mapped));
        let trace = bed.trace();
        assert_eq!((lost(&trace, Lost::Filtered), lost(&trace, Lost::NoMapping), bed.nat("router").filtered()), (1, 1, 2));
        let words: Vec<String> = trace.events().iter().map(|event| trace.words(event).to_string()).collect();
        for expected in ["router forgot its mappings", "router behaves otherwise", "other -> router  packet 0 lost: filtered"] {
            assert!(words.iter().any(|words| words.contains(expected)), "{expected}: {words:#?}");
        }
    });
}

#[test]
fn the_message_that_nobody_listens_passes_the_nat() {
    for words in ["home", "strict"] {
        Testbed::new(["laptop", "server"]).nat("router", words, ["laptop"]).run(|bed| async move {
            let inside = bind(&bed.host("laptop"), "0.0.0.0:5000");
            inside.connect("server:9").await.unwrap();
            inside.send(b"?").await.unwrap();
            time::sleep(Duration::from_millis(1)).await;
            assert_eq!(inside.send(b"?").await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
            // The same from inside: a socket inside is closed when the answer comes.
            let server = bind(&bed.host("server"), "0.0.0.0:7");
            inside.connect("server:7").await.unwrap();
            inside.send(b"?").await.unwrap();
            let mapped = heard_from(&server).await.unwrap();
            drop(inside);
            server.connect(mapped).await.unwrap();
            server.send(b"!").await.unwrap();
            time::sleep(Duration::from_millis(1)).await;
            assert_eq!(server.send(b"!").await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
        });
    }
}

#[test]
fn a_message_that_nobody_listens_keeps_no_mapping() {
    let second = Duration::from_secs(1);
    Testbed::new(["laptop", "server"]).nat("router", "home udp-timeout 100s", ["laptop"]).run(|bed| async move {
        let [inside, server] = [("laptop", "0.0.0.0:5000"), ("server", "0.0.0.0:7")].map(|(name, at)| bind(&bed.host(name), at));
        // From outside: the question to a closed port counts as unanswered, and its mapping ends after 30 s.
        inside.send_to(b"?", "server:9").await.unwrap();
        time::sleep(30 * second).await;
        assert!(bed.nat("router").mappings().is_empty());
        // From inside: the last packet of the socket left 29 s before.
        inside.send_to(b"?", "server:7").await.unwrap();
        let mapped = heard_from(&server).await.unwrap();
        drop(inside);
        time::sleep(29 * second).await;
        server.connect(mapped).await.unwrap();
        server.send(b"!").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
        assert_eq!(server.send(b"!").await.unwrap_err().kind(), std::io::ErrorKind::ConnectionRefused);
        // An answered mapping lives for 100 s after the last packet of the socket. The message that nobody listens is no such packet.
        time::sleep(71 * second).await;
        assert!(bed.nat("router").mappings().is_empty());
    });
}

#[test]
fn links_without_delay_and_crowds_of_hosts_work() {
    let names: Vec<String> = (0..200).map(|host| format!("h{host}")).collect();
    let bed = Testbed::new(names.iter().cloned().chain(["server".to_owned()])).nat("router", "home", names.iter().map(|name| &**name)).seed(3);
    let mapped = bed.run_twice(move |bed| {
        let names = names.clone();
        async move {
            let server = bind(&bed.host("server"), "0.0.0.0:7");
            let sockets: Vec<UdpSocket> = names.iter().map(|name| bind(&bed.host(name), "0.0.0.0:5000")).collect();
            let mut mapped = std::collections::BTreeSet::new();
            for socket in &sockets {
                socket.send_to(b"?", "server:7").await.unwrap();
                let from = heard_from(&server).await.unwrap();
                assert!(passes(&server, from, socket).await);
                mapped.insert(from.port());
            }
            mapped
        }
    });
    assert_eq!(mapped.len(), 200);
}
