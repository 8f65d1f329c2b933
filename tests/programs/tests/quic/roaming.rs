//! QUIC through a NAT that forgets, and on a phone that changes its network.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_testkit::quinn::{self, Connection, ConnectionError, TransportConfig};
use cohaptic_testkit::{Bed, JoinHandle, Testbed, time};

const PORT: u16 = 443;

/// Serves echoes on one connection. Returns the addresses from which the client has sent, and how the connection has ended.
fn serve(bed: &Bed, may_migrate: bool) -> JoinHandle<(Vec<SocketAddr>, ConnectionError)> {
    let mut config = quinn::server_config();
    config.migration(may_migrate).transport_config(transport());
    let server = bed.host("server");
    let listener = quinn::endpoint(&server, ("0.0.0.0", PORT), quinn::endpoint_config(), Some(config)).unwrap();
    server.spawn(async move {
        let connection = listener.accept().await.unwrap().await.unwrap();
        let mut seen = vec![connection.remote_address()];
        let ended = loop {
            let (mut answer, mut question) = match connection.accept_bi().await {
                Ok(streams) => streams,
                Err(ended) => break ended,
            };
            let asked = question.read_to_end(100).await.unwrap();
            answer.write_all(&asked).await.unwrap();
            answer.finish().unwrap();
            if seen.last() != Some(&connection.remote_address()) {
                seen.push(connection.remote_address());
            }
        };
        (seen, ended)
    })
}

/// An idle timeout of 30 s, and no packets that keep the connection alive.
fn transport() -> Arc<TransportConfig> {
    let mut transport = TransportConfig::default();
    transport.max_idle_timeout(Some(Duration::from_secs(30).try_into().unwrap()));
    Arc::new(transport)
}

async fn connect(bed: &Bed) -> Connection {
    let client = quinn::client(&bed.host("client")).unwrap();
    let mut config = quinn::client_config();
    config.transport_config(transport());
    client.connect_with(config, (bed.host("server").ip(), PORT).into(), quinn::SERVER_NAME).unwrap().await.unwrap()
}

async fn echo(connection: &Connection) -> Result<Vec<u8>, ConnectionError> {
    let (mut question, mut answer) = connection.open_bi().await?;
    question.write_all(b"there?").await.unwrap();
    question.finish().unwrap();
    answer.read_to_end(100).await.map_err(|error| match error {
        quinn::ReadToEndError::Read(quinn::ReadError::ConnectionLost(lost)) => lost,
        error => panic!("{error}"),
    })
}

/// A NAT that forgets after 10 s. A connection has a new port after a longer silence.
fn forgetful() -> Testbed {
    Testbed::new(["client", "server"]).nat("router", "home ports random udp-timeout 10s", ["client"]).link_both("router", "server", "delay 20ms")
}

#[test]
fn a_connection_outlives_the_mapping_of_its_nat() {
    let (seen, ended) = forgetful().run_twice(|bed| async move {
        let served = serve(&bed, true);
        let connection = connect(&bed).await;
        assert_eq!(echo(&connection).await.unwrap(), b"there?");
        time::sleep(Duration::from_secs(15)).await;
        assert_eq!(echo(&connection).await.unwrap(), b"there?");
        connection.close(0_u8.into(), b"");
        served.await.unwrap()
    });
    assert!(matches!(ended, ConnectionError::ApplicationClosed(_)), "{ended}");
    assert_eq!(seen.len(), 2, "one new address: {seen:?}");
    assert!(seen[0].ip() == seen[1].ip() && seen[0].port() != seen[1].port());
}

#[test]
fn without_migration_the_connection_times_out() {
    forgetful().run_twice(|bed| async move {
        let served = serve(&bed, false);
        let connection = connect(&bed).await;
        assert_eq!(echo(&connection).await.unwrap(), b"there?");
        time::sleep(Duration::from_secs(15)).await;
        assert_eq!(echo(&connection).await.unwrap_err(), ConnectionError::TimedOut);
        let (seen, ended) = served.await.unwrap();
        assert_eq!((seen.len(), ended), (1, ConnectionError::TimedOut));
    });
}

#[test]
fn a_phone_that_leaves_its_home_goes_on_by_the_other_network() {
    let bed = Testbed::new(["client", "server"])
        .interfaces("client", ["wifi", "lte"])
        .nat("home", "home", ["wifi"])
        .nat("carrier", "cgnat", ["lte"])
        .link_both("home", "server", "delay 10ms")
        .link_both("carrier", "server", "delay 40ms");
    let seen = bed.run_twice(|bed| async move {
        let served = serve(&bed, true);
        let connection = connect(&bed).await;
        assert_eq!(echo(&connection).await.unwrap(), b"there?");
        bed.cut("wifi", "home");
        bed.cut("home", "wifi");
        bed.host("client").uplink("lte");
        assert_eq!(echo(&connection).await.unwrap(), b"there?");
        connection.close(0_u8.into(), b"");
        served.await.unwrap().0
    });
    assert_eq!(seen.iter().map(|seen| seen.ip().to_string()).collect::<Vec<_>>(), ["10.0.0.5", "10.0.0.6"]);
}
