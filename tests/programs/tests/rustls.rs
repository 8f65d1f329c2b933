//! rustls above a stream, with the certificate and the random numbers of test beds: the ciphertext is the same in both runs.

use std::sync::Arc;

use cohaptic_testkit::Bed;
use cohaptic_testkit::quinn::{SERVER_NAME, tls_client_config, tls_server_config};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_rustls::{TlsAcceptor, TlsConnector};

use crate::{octets, over_a_bad_link};

#[test]
fn an_encrypted_stream() {
    let program = |bed: Bed| async move {
        let listener = bed.host("server").listen("0.0.0.0:443").unwrap();
        let acceptor = TlsAcceptor::from(Arc::new(tls_server_config()));
        let serving = bed.host("server").spawn(async move {
            let mut stream = acceptor.accept(listener.accept().await.unwrap().0).await.unwrap();
            let mut read = Vec::new();
            stream.read_to_end(&mut read).await.unwrap();
            stream.write_all(&read).await.unwrap();
            stream.shutdown().await.unwrap();
        });
        let connector = TlsConnector::from(Arc::new(tls_client_config()));
        let stream = bed.host("client").connect("server:443").await.unwrap();
        let mut stream = connector.connect(SERVER_NAME.try_into().unwrap(), stream).await.unwrap();
        stream.write_all(&octets(20_000)).await.unwrap();
        stream.shutdown().await.unwrap();
        let mut read = Vec::new();
        stream.read_to_end(&mut read).await.unwrap();
        assert_eq!(read, octets(20_000));
        serving.await.unwrap();
    };
    over_a_bad_link(|bed| bed, program);
    over_a_bad_link(|bed| bed.on_tokio(), program);
}
