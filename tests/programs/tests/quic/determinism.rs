//! Results that two runs share, and results that differ.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_testkit::quinn::rustls::pki_types::pem::PemObject;
use cohaptic_testkit::quinn::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use cohaptic_testkit::quinn::rustls::{self, RootCertStore};
use cohaptic_testkit::quinn::{self, ClientConfig, Endpoint, EndpointConfig, ServerConfig, VarInt};
use cohaptic_testkit::{Bed, Instant, Testbed};

fn pair() -> Testbed {
    Testbed::new(["client", "server"]).links("delay 12345678ns loss 2%").seed(5)
}

/// Asks a server, and gives when the answer was there.
async fn ask(bed: Bed, server: Endpoint, client: Endpoint) -> Instant {
    bed.host("server").spawn(async move {
        let connection = server.accept().await.unwrap().await.unwrap();
        let (mut answer, mut question) = connection.accept_bi().await.unwrap();
        let asked = question.read_to_end(100_000).await.unwrap();
        answer.write_all(&asked).await.unwrap();
        answer.finish().unwrap();
        connection.closed().await;
    });
    let connection = client.connect((bed.host("server").ip(), 443).into(), quinn::SERVER_NAME).unwrap().await.unwrap();
    let (mut question, mut answer) = connection.open_bi().await.unwrap();
    question.write_all(&[7; 50_000]).await.unwrap();
    question.finish().unwrap();
    assert_eq!(answer.read_to_end(100_000).await.unwrap(), [7; 50_000]);
    connection.close(VarInt::from_u32(0), b"");
    bed.now()
}

async fn ask_by_own_configurations(bed: Bed) -> Instant {
    let server = quinn::server(&bed.host("server"), "0.0.0.0:443").unwrap();
    let client = quinn::client(&bed.host("client")).unwrap();
    ask(bed, server, client).await
}

/// As somebody would who knows quinn and nothing of test beds.
async fn ask_by_quinns_configurations(bed: Bed) -> Instant {
    let certificate = CertificateDer::from_pem_slice(quinn::CERTIFICATE.as_bytes()).unwrap();
    let key = PrivateKeyDer::from_pem_slice(quinn::PRIVATE_KEY.as_bytes()).unwrap();
    let mut roots = RootCertStore::empty();
    roots.add(certificate.clone()).unwrap();
    let server = ServerConfig::with_single_cert(vec![certificate], key).unwrap();
    let server = quinn::endpoint(&bed.host("server"), "0.0.0.0:443", EndpointConfig::default(), Some(server)).unwrap();
    let mut client = quinn::endpoint(&bed.host("client"), "0.0.0.0:0", EndpointConfig::default(), None).unwrap();
    client.set_default_client_config(ClientConfig::with_root_certificates(Arc::new(roots)).unwrap());
    ask(bed, server, client).await
}

#[test]
fn with_the_configurations_of_the_kit_every_byte_is_the_same_twice() {
    pair().run_twice(ask_by_own_configurations);
}

#[test]
fn with_quinns_configurations_times_and_lengths_are() {
    pair().without_digests().run_twice(ask_by_quinns_configurations);
}

#[test]
#[should_panic(expected = "two runs of the program are not the same: the runs differ from 0 s on, at event 0")]
fn and_bytes_are_not() {
    pair().run_twice(ask_by_quinns_configurations);
}

/// Tokio's executor polls in another order, but a connection's packets are all that counts here.
#[test]
fn on_tokio_a_connection_takes_the_same_time() {
    let own = pair().run(ask_by_own_configurations);
    assert_eq!(pair().on_tokio().run_twice(ask_by_own_configurations), own);
}

/// Certificates are checked against virtual time.
#[test]
fn the_day_passes_in_virtual_time() {
    use rustls::time_provider::TimeProvider;

    Testbed::new(["a"]).time_limit(Duration::MAX).run(|_| async {
        let day = |provider: quinn::TestTime| provider.current_time().unwrap().as_secs();
        let begin = day(quinn::TestTime);
        cohaptic_testkit::time::sleep(Duration::from_secs(86_400)).await;
        assert_eq!(day(quinn::TestTime) - begin, 86_400);
    });
    assert_eq!(quinn::TestTime.current_time(), None);
}

/// A token of a retry is good for 15 s as quinn has it, and it travels there and back: over 7 s each way it comes in time, over 8 s it does not.
#[test]
fn tokens_grow_old_in_virtual_time() {
    let connected = |delay: &str| {
        Testbed::new(["client", "server"]).links(delay).run_twice(|bed| async move {
            let server = quinn::server(&bed.host("server"), "0.0.0.0:443").unwrap();
            let other = bed.host("server");
            other.clone().spawn(async move {
                while let Some(incoming) = server.accept().await {
                    if incoming.remote_address_validated() {
                        other.spawn(incoming.into_future());
                    } else {
                        incoming.retry().unwrap();
                    }
                }
            });
            let client = quinn::client(&bed.host("client")).unwrap();
            client.connect((bed.host("server").ip(), 443).into(), quinn::SERVER_NAME).unwrap().await.map(drop)
        })
    };
    assert_eq!(connected("delay 7s"), Ok(()));
    let refused = connected("delay 8s").unwrap_err();
    assert!(
        matches!(&refused, quinn::ConnectionError::ConnectionClosed(close) if close.error_code == quinn::TransportErrorCode::INVALID_TOKEN),
        "{refused:?}"
    );
}

#[test]
fn an_endpoint_is_over_with_its_test_bed() {
    let client = Testbed::new(["a"]).run(|bed| async move { quinn::client(&bed.host("a")).unwrap() });
    Testbed::new(["a"]).run(|_| async move {
        let refused = client.connect("10.0.0.1:5".parse().unwrap(), quinn::SERVER_NAME).unwrap_err();
        assert_eq!(refused, quinn::ConnectError::EndpointStopping);
    });
}

#[test]
#[should_panic(expected = "the numbers of an endpoint can be drawn only inside a running test bed")]
fn a_configuration_draws_inside_a_test_bed_only() {
    drop(quinn::endpoint_config());
}

#[test]
fn a_socket_of_the_system_is_refused() {
    Testbed::new(["a"]).run(|bed| async move {
        let client = quinn::client(&bed.host("a")).unwrap();
        let error = client.rebind(std::net::UdpSocket::bind("127.0.0.1:0").unwrap()).unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::Unsupported);
    });
}
