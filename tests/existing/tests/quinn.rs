//! quinn with its own sockets and its own runtime, over QUIC's own loss recovery. Only the certificate and the random numbers are those of the test kit.

use std::net::SocketAddr;
use std::sync::Arc;

use ::quinn::{Endpoint, EndpointConfig, ServerConfig, TokioRuntime};
use cohaptic_testkit::quinn as kit;

/// Makes an endpoint as `Endpoint::client` and `Endpoint::server` do, but for the random numbers, so that runs repeat to the byte.
fn endpoint(at: &str, server: Option<ServerConfig>) -> Endpoint {
    let socket = std::net::UdpSocket::bind(at.parse::<SocketAddr>().unwrap()).unwrap();
    let mut config: EndpointConfig = kit::endpoint_config();
    config.rng_seed(Some([7; 32]));
    Endpoint::new(config, server, socket, Arc::new(TokioRuntime)).unwrap()
}

#[test]
fn a_question_is_answered() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                let endpoint = endpoint("0.0.0.0:443", Some(kit::server_config()));
                let connection = endpoint.accept().await.unwrap().await.unwrap();
                let (mut answer, mut question) = connection.accept_bi().await.unwrap();
                let asked = question.read_to_end(1 << 20).await.unwrap();
                answer.write_all(&asked).await.unwrap();
                answer.finish().unwrap();
                connection.closed().await;
            });
            let client = bed.host("client").spawn(async {
                let mut endpoint = endpoint("0.0.0.0:0", None);
                endpoint.set_default_client_config(kit::client_config());
                let connection = endpoint.connect("10.0.0.2:443".parse().unwrap(), kit::SERVER_NAME).unwrap().await.unwrap();
                let (mut question, mut answer) = connection.open_bi().await.unwrap();
                let asked: Vec<u8> = (0..50_000).map(|number| number as u8).collect();
                question.write_all(&asked).await.unwrap();
                question.finish().unwrap();
                assert_eq!(answer.read_to_end(1 << 20).await.unwrap(), asked);
                connection.close(0_u32.into(), b"");
                endpoint.wait_idle().await;
            });
            client.await.unwrap();
        },
    );
}
