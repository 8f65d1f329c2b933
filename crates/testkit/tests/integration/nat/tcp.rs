//! Connections of TCP through NATs (RFC 5382).

use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::net::{TcpSocket, TcpStream};
use cohaptic_testkit::tcp::{Flags, TcpConfig};
use cohaptic_testkit::units::Probability;
use cohaptic_testkit::wan::{Chance, Checksum, Corruption, Flips, LinkConfig};
use cohaptic_testkit::{Bed, Happening, Host, Instant, Lost, NatProtocol, Testbed, Trace, TraceEvent, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::lost;

fn home() -> Testbed {
    Testbed::new(["laptop", "server"]).nat("router", "home", ["laptop"]).link_both("router", "server", "delay 10ms")
}

/// Opens a connection from port 5000 of a host.
async fn open(host: Host, to: &str) -> io::Result<TcpStream> {
    let to: SocketAddr = to.parse().unwrap();
    host.scope(async {
        let socket = TcpSocket::new_v4()?;
        socket.bind("0.0.0.0:5000".parse().unwrap())?;
        socket.connect(to).await
    })
    .await
}

async fn serve(bed: &Bed) -> (TcpStream, TcpStream) {
    let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
    let client = bed.host("laptop").connect("server:80").await.unwrap();
    (client, listener.accept().await.unwrap().0)
}

/// Returns the number of resets that were sent.
fn resets(trace: &Trace) -> usize {
    let is_reset = |event: &&TraceEvent| matches!(event.what, Happening::Segment { flags, .. } if flags.has(Flags::RST));
    trace.events().iter().filter(is_reset).count()
}

async fn passes(from: &mut TcpStream, to: &mut TcpStream) -> bool {
    from.write_all(b"?").await.unwrap();
    time::timeout(Duration::from_secs(2), to.read_exact(&mut [0])).await.is_ok_and(|read| read.is_ok())
}

#[test]
fn a_connection_passes_and_its_server_sees_the_nat() {
    for (words, bed) in [("home", home()), ("strict", home().on_tokio())] {
        bed.time_limit(Duration::from_secs(40)).run_twice(move |bed| async move {
            bed.nat("router").set(words);
            let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
            let mut client = bed.host("laptop").connect("server:80").await.unwrap();
            let (mut server, from) = listener.accept().await.unwrap();
            assert_eq!((from.ip().to_string(), from == server.peer_addr().unwrap()), ("10.0.0.3".to_owned(), true));
            assert_eq!(client.local_addr().unwrap().ip().to_string(), "192.168.1.1");
            assert_eq!(from.port() == client.local_addr().unwrap().port(), words == "home");
            server.write_all(&[7; 100_000]).await.unwrap();
            client.read_exact(&mut [0; 100_000]).await.unwrap();
            assert_eq!(bed.nat("router").mappings()[0].protocol, NatProtocol::Tcp);
            drop(client);
            assert_eq!(server.read(&mut [0]).await.unwrap(), 0);
        });
    }
}

#[test]
fn both_sides_open_at_once_through_two_homes() {
    let bed =
        Testbed::new(["alice", "bob"]).nat("home-a", "home", ["alice"]).nat("home-b", "home", ["bob"]).link_both("home-a", "home-b", "delay 25ms");
    bed.traced().run(|bed| async move {
        let alice = bed.host("alice").spawn(open(bed.host("alice"), "10.0.0.4:5000"));
        time::sleep(Duration::from_millis(200)).await;
        let mut bob = open(bed.host("bob"), "10.0.0.3:5000").await.unwrap();
        // Bob's SYN finds alice in SYN-SENT: her SYN and ACK come back after a round trip.
        assert_eq!(bed.now(), Instant::from_nanos(250_000_000));
        let mut alice = alice.await.unwrap().unwrap();
        assert!(passes(&mut alice, &mut bob).await && passes(&mut bob, &mut alice).await);
        // Her first SYN came too early. Nothing answers it, because bob's own SYN has followed.
        time::sleep(Duration::from_secs(10)).await;
        assert_eq!((lost(&bed.trace(), Lost::NoMapping), resets(&bed.trace())), (1, 0));
        assert!(passes(&mut alice, &mut bob).await);
    });
}

#[test]
fn an_unexpected_syn_is_answered_by_silence_and_then_by_a_reset() {
    home().traced().run(|bed| async move {
        let error = open(bed.host("server"), "10.0.0.3:80").await.unwrap_err();
        assert_eq!((error.kind(), bed.now()), (ErrorKind::ConnectionRefused, Instant::from_nanos(6_020_000_000)));
        // The SYNs of seconds 0 to 5 were dropped.
        assert_eq!(lost(&bed.trace(), Lost::NoMapping), 6);
    });
}

#[test]
fn an_expired_connection_is_silent() {
    home().time_limit(Duration::from_secs(40_000)).traced().run(|bed| async move {
        let (mut client, mut server) = serve(&bed).await;
        let idle = Duration::from_secs(7440) - Duration::from_millis(100);
        time::sleep(idle).await;
        assert!(passes(&mut server, &mut client).await && passes(&mut client, &mut server).await);
        time::sleep(idle + Duration::from_secs(1)).await;
        // Neither side is told, and both go on to repeat what they have sent.
        assert!(!passes(&mut server, &mut client).await);
        assert!(!passes(&mut client, &mut server).await);
        assert!(client.info().retransmissions > 0 && bed.nat("router").mappings().is_empty());
        assert_eq!(resets(&bed.trace()), 0);
    });
}

#[test]
fn a_connection_that_never_opens_is_forgotten_after_240_s() {
    home().run(|bed| async move {
        bed.host("server").crash();
        let attempt = bed.host("laptop").spawn(open(bed.host("laptop"), "10.0.0.2:80"));
        assert_eq!(attempt.await.unwrap().unwrap_err().kind(), ErrorKind::TimedOut);
        // The last SYN has left after 67 s, and the attempt has ended after 131 s.
        assert_eq!(bed.now().as_nanos() / 1_000_000_000, 131);
        assert_eq!(bed.nat("router").mappings().len(), 1);
        time::sleep_until(Instant::from_nanos(307_100_000_000)).await;
        assert!(bed.nat("router").mappings().is_empty());
    });
}

#[test]
fn a_listener_behind_an_open_nat_is_reached_through_a_mapping() {
    Testbed::new(["laptop", "server", "other"]).nat("router", "open", ["laptop"]).run(|bed| async move {
        let server = bed.host("server").listen("0.0.0.0:80").unwrap();
        let laptop = bed.host("laptop");
        let (listening, opening) = laptop
            .scope(async {
                let [listening, opening] = [(); 2].map(|()| TcpSocket::new_v4().unwrap());
                for socket in [&listening, &opening] {
                    socket.set_reuseaddr(true).unwrap();
                    socket.bind("0.0.0.0:5000".parse().unwrap()).unwrap();
                }
                (listening, opening)
            })
            .await;
        let _opened = opening.connect("10.0.0.2:80".parse().unwrap()).await.unwrap();
        let mapped = server.accept().await.unwrap().1;
        let listener = listening.listen(5).unwrap();
        let mut other = bed.host("other").connect(mapped).await.unwrap();
        let (mut accepted, from) = listener.accept().await.unwrap();
        assert_eq!(from.ip().to_string(), "10.0.0.3");
        assert!(passes(&mut other, &mut accepted).await && passes(&mut accepted, &mut other).await);
        // The connection is established for the NAT, and outlives the 240 s of a connection that opens.
        time::sleep(Duration::from_secs(300)).await;
        assert!(passes(&mut other, &mut accepted).await && passes(&mut accepted, &mut other).await);
    });
}

/// Only a SYN that opens a connection is answered, and not the answer to a SYN from inside whose mapping is gone.
#[test]
fn a_late_answer_is_dropped_in_silence() {
    let bed = Testbed::new(["laptop", "server"]).nat("router", "strict", ["laptop"]).link_both("router", "server", "delay 10ms");
    bed.traced().run(|bed| async move {
        let _listener = bed.host("server").listen("0.0.0.0:80").unwrap();
        let opening = bed.host("laptop").spawn(open(bed.host("laptop"), "10.0.0.2:80"));
        time::sleep(Duration::from_millis(15)).await;
        bed.nat("router").forget();
        let _client = opening.await.unwrap().unwrap();
        time::sleep(Duration::from_secs(9)).await;
        assert!(lost(&bed.trace(), Lost::NoMapping) > 0);
        assert_eq!(resets(&bed.trace()), 0);
    });
}

/// A host inside that opens a connection to the outside of its own NAT, where nothing is mapped, is not told.
#[test]
fn a_syn_that_turns_back_to_nobody_is_dropped_in_silence() {
    Testbed::new(["laptop", "server"]).nat("router", "open", ["laptop"]).traced().run(|bed| async move {
        let opening = open(bed.host("laptop"), "10.0.0.3:80");
        assert!(time::timeout(Duration::from_secs(10), opening).await.is_err());
        assert_eq!(resets(&bed.trace()), 0);
    });
}

/// A mark of the link before a NAT or a firewall reaches the receiver, which tells the sender.
#[test]
fn a_mark_stays_on_its_segment() {
    for is_nat in [true, false] {
        let bed = Testbed::new(["laptop", "server"]).tcp(TcpConfig { ecn: true, ..TcpConfig::default() }).seed(1);
        let bed = if is_nat { bed.nat("router", "home", ["laptop"]) } else { bed.firewall("router", "", ["laptop"]) };
        bed.link_both("laptop", "router", "delay 10ms").link("laptop", "router", "delay 10ms loss 2% ecn").run(|bed| async move {
            let (mut client, mut server) = serve(&bed).await;
            let writing = bed.host("laptop").spawn(async move {
                client.write_all(&[7; 500_000]).await.unwrap();
                // The buffer takes much of the data before a mark is reported.
                time::sleep(Duration::from_secs(5)).await;
                client.info()
            });
            server.read_exact(&mut [0; 500_000]).await.unwrap();
            let info = writing.await.unwrap();
            let stats = bed.link_stats("laptop", "router");
            // No segment was lost, so that only marks can have slowed the sender down.
            assert!(stats.marked() > 0 && stats.dropped_in_all() == 0 && info.slow_start_threshold < u32::MAX, "{info:?}");
        });
    }
}

/// A damaged segment has no ports that could be believed, and makes no mapping.
#[test]
fn a_damaged_segment_ends_at_the_nat() {
    let bits = Flips::Bits { packets: Chance::independent(Probability::new(0.1).unwrap()), count: 1 };
    let flips = LinkConfig { corruption: Some(Corruption { bits, within: None, checksum: Checksum::Passes }), ..LinkConfig::default() };
    let bed = Testbed::new(["laptop", "server"]).nat("router", "home", ["laptop"]).link("laptop", "router", flips);
    bed.traced().run(|bed| async move {
        let (mut client, mut server) = serve(&bed).await;
        let writing = bed.host("laptop").spawn(async move {
            client.write_all(&[7; 300_000]).await.unwrap();
            client
        });
        server.read_exact(&mut [0; 300_000]).await.unwrap();
        let _client = writing.await.unwrap();
        assert!(lost(&bed.trace(), Lost::Checksum) > 0);
        let protocols: Vec<NatProtocol> = bed.nat("router").mappings().iter().map(|mapping| mapping.protocol).collect();
        assert_eq!(protocols, [NatProtocol::Tcp]);
    });
}

#[test]
fn the_capture_of_each_link_has_its_addresses() {
    let folder = tempfile::tempdir().unwrap();
    let ((), record) = home().run_recorded(|bed| async move {
        let (mut client, mut server) = serve(&bed).await;
        assert!(passes(&mut client, &mut server).await);
    });
    record.write(folder.path().join("kept")).unwrap();
    for (link, source) in [("laptop-to-router", [192, 168, 1, 1]), ("router-to-server", [10, 0, 0, 3])] {
        let capture = std::fs::read(folder.path().join(format!("kept/packets-{link}.pcapng"))).unwrap();
        let addresses = [source, [10, 0, 0, 2]].concat();
        assert!(capture.windows(8).any(|window| window == addresses), "{link}");
    }
}
