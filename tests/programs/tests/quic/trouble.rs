//! Faults on the way, and the answer of QUIC to each.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_testkit::quinn::{self, ConnectionError, TransportConfig, VarInt};
use cohaptic_testkit::units::Rate;
use cohaptic_testkit::wan::{Bottleneck, CoDel, Delay, Discipline, LinkConfig};
use cohaptic_testkit::{Bed, Host, Instant, JoinHandle, Testbed, time};

const SIZE: usize = 2_000_000;
const PORT: u16 = 443;
const IDLE: Duration = Duration::from_secs(7);

fn pair() -> Testbed {
    Testbed::new(["client", "server"])
}

fn content() -> Vec<u8> {
    (0..SIZE).map(|place| (place / 7 + place * 3) as u8).collect()
}

fn address(host: &Host) -> SocketAddr {
    (host.ip(), PORT).into()
}

/// A server that takes one stream of one connection, and gives when it had all of it and from where it was sent last.
fn serve(bed: &Bed) -> JoinHandle<(Instant, SocketAddr)> {
    let (bed, server) = (bed.clone(), bed.host("server"));
    let listener = quinn::server(&server, ("0.0.0.0", PORT)).unwrap();
    server.spawn(async move {
        let connection = listener.accept().await.unwrap().await.unwrap();
        let received = connection.accept_uni().await.unwrap().read_to_end(SIZE).await.unwrap();
        assert!(received == content());
        let found = (bed.now(), connection.remote_address());
        connection.closed().await;
        found
    })
}

async fn connect(bed: &Bed) -> Result<quinn::Connection, ConnectionError> {
    let mut transport = TransportConfig::default();
    transport.max_idle_timeout(Some(IDLE.try_into().unwrap()));
    let mut config = quinn::client_config();
    config.transport_config(Arc::new(transport));
    let client = quinn::client(&bed.host("client")).unwrap();
    client.connect_with(config, address(&bed.host("server")), quinn::SERVER_NAME).unwrap().await
}

async fn upload(connection: &quinn::Connection) -> Result<(), Box<dyn std::error::Error>> {
    let mut stream = connection.open_uni().await?;
    stream.write_all(&content()).await?;
    stream.finish()?;
    stream.stopped().await?;
    connection.close(VarInt::from_u32(0), b"");
    Ok(())
}

/// An upload during which something happens at an instant; when it had arrived, and from where.
fn troubled<F: Future<Output = ()> + 'static>(bed: Testbed, trouble: impl Fn(Bed) -> F + Copy + 'static) -> (Instant, SocketAddr) {
    bed.run_twice(move |bed| async move {
        let served = serve(&bed);
        let connection = connect(&bed).await.unwrap();
        let troubles = bed.spawn(trouble(bed.clone()));
        upload(&connection).await.unwrap();
        troubles.await.unwrap();
        served.await.unwrap()
    })
}

#[test]
fn a_client_that_gets_other_addresses_on_the_way_migrates() {
    let (_, from) = troubled(pair().links("delay 20ms rate 20mbit limit 100"), async |bed: Bed| {
        time::sleep(Duration::from_millis(400)).await;
        bed.host("client").change_addresses();
    });
    // Two hosts have 10.0.0.1 and 10.0.0.2, and the third addresses are the next.
    assert_eq!(from.to_string(), "10.0.0.3:49152");
}

/// QUIC knows no migration of servers: what a client sends to the old address is lost, and nothing may be sent from there.
#[test]
fn a_server_that_gets_other_addresses_is_lost() {
    pair().links("delay 20ms").run_twice(|bed| async move {
        let listener = quinn::server(&bed.host("server"), ("0.0.0.0", PORT)).unwrap();
        let lost = bed.host("server").spawn(async move { listener.accept().await.unwrap().await.unwrap().closed().await });
        let connection = connect(&bed).await.unwrap();
        time::sleep(Duration::from_secs(1)).await;
        bed.host("server").change_addresses();
        assert!(upload(&connection).await.is_err());
        assert_eq!(connection.closed().await, ConnectionError::TimedOut);
        assert_eq!(lost.await.unwrap(), ConnectionError::TimedOut);
    });
}

/// Probes go out at distances that double (RFC 9002, 6.2.1), so that one follows the end of a cut no later than the cut had lasted; what it repairs needs some round
/// trips.
#[test]
fn a_cut_of_three_seconds_on_the_way_delays_a_transfer_and_no_more() {
    const CUT: Duration = Duration::from_secs(3);
    let link = "delay 20ms rate 20mbit limit 100";
    let (without, _) = troubled(pair().links(link), async |_| {});
    let (with, _) = troubled(pair().links(link), async |bed: Bed| {
        time::sleep(Duration::from_millis(400)).await;
        bed.partition(&["client"], &["server"]);
        time::sleep(CUT).await;
        bed.mend_all();
    });
    let later = with.saturating_duration_since(without);
    assert!(later > CUT && later < 2 * CUT + Duration::from_secs(1), "{later:?} later");
}

/// RFC 9000, 10.1: a handshake that is never answered is over when nothing has come for the idle timeout.
#[test]
fn a_handshake_with_nobody_ends_with_the_idle_timeout() {
    for silent in [pair(), pair().links("loss 100%")] {
        let at = silent.run_twice(|bed| async move {
            assert_eq!(connect(&bed).await.unwrap_err(), ConnectionError::TimedOut);
            bed.now()
        });
        assert_eq!(at, Instant::ZERO + IDLE);
    }
}

#[test]
fn a_server_that_crashes_is_missed_after_the_idle_timeout_and_found_again_after_its_restart() {
    pair().links("delay 5ms").run_twice(|bed| async move {
        let other = bed.clone();
        bed.host("server").start(move || {
            let bed = other.clone();
            async move {
                serve(&bed).await.unwrap();
            }
        });
        let first = connect(&bed).await.unwrap();
        bed.host("server").crash();
        assert!(upload(&first).await.is_err());
        assert_eq!(first.closed().await, ConnectionError::TimedOut);
        bed.host("server").restart();
        upload(&connect(&bed).await.unwrap()).await.unwrap();
    });
}

/// A queue that marks (CoDel, RFC 8289) instead of losing: quinn sends ECT(0), hears of the marks from its peer, and slows down. Without marks it would have to lose
/// packets to learn that it is too fast.
#[test]
fn marks_of_congestion_travel_there_and_back() {
    let mut bottleneck = Bottleneck::at_rate(Rate::bits_per_sec(5_000_000).unwrap());
    bottleneck.discipline = Discipline::CoDel(CoDel { ecn: true, ..CoDel::default() });
    let line = LinkConfig { bottleneck: Some(bottleneck), delay: Delay::constant(Duration::from_millis(10)), ..LinkConfig::default() };
    pair().links(line).run_twice(|bed| async move {
        let served = serve(&bed);
        let connection = connect(&bed).await.unwrap();
        upload(&connection).await.unwrap();
        served.await.unwrap();
        let (path, marked) = (connection.stats().path, bed.link_stats("client", "server").marked());
        assert!(marked > 0 && path.congestion_events > 0, "{marked} marked, {path:?}");
        assert_eq!(path.lost_packets, 0);
    });
}

/// A damaged datagram is no datagram: its tag does not fit. That the runs are the same needs the same bytes, because what a damaged first byte means depends on them.
#[test]
fn damage_and_disorder_and_copies_are_borne() {
    troubled(pair().links("delay 20ms 5ms corrupt 1% duplicate 1% loss 1%"), async |_| {});
}
