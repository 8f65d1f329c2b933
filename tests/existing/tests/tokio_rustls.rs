//! tokio-rustls: both ends of TLS, with the certificate and the random numbers of the test bed.

use std::sync::Arc;

use cohaptic_testkit::quinn::{SERVER_NAME, tls_client_config, tls_server_config};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::{TlsAcceptor, TlsConnector};

#[test]
fn an_encrypted_stream_comes_back() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("0.0.0.0:443").await.unwrap();
                let acceptor = TlsAcceptor::from(Arc::new(tls_server_config()));
                let mut stream = acceptor.accept(listener.accept().await.unwrap().0).await.unwrap();
                let mut said = Vec::new();
                stream.read_to_end(&mut said).await.unwrap();
                stream.write_all(&said).await.unwrap();
                stream.shutdown().await.unwrap();
            });
            let client = bed.host("client").spawn(async {
                let connector = TlsConnector::from(Arc::new(tls_client_config()));
                let stream = TcpStream::connect("server:443").await.unwrap();
                let mut stream = connector.connect(SERVER_NAME.try_into().unwrap(), stream).await.unwrap();
                stream.write_all(&[7; 20_000]).await.unwrap();
                stream.shutdown().await.unwrap();
                let mut said = Vec::new();
                stream.read_to_end(&mut said).await.unwrap();
                assert_eq!(said, [7; 20_000]);
            });
            client.await.unwrap();
        },
    );
}
