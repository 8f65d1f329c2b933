//! The section of docs/testing.md on QUIC: endpoints of quinn with the certificate and the random numbers of the test bed.

use cohaptic_testkit::wan::DropCause;
use cohaptic_testkit::{Testbed, quinn};

static LETTER: [u8; 500_000] = [7; 500_000];

#[test]
fn a_letter_arrives_whole_over_quic() {
    let bed = Testbed::new(["client", "server"]).links("delay 40ms 5ms loss 5% rate 5mbit");
    bed.run_twice(|bed| async move {
        let server = quinn::server(&bed.host("server"), "0.0.0.0:443").unwrap();
        let reader = bed.host("server").spawn(async move {
            let connection = server.accept().await.unwrap().await.unwrap();
            let mut stream = connection.accept_uni().await.unwrap();
            assert!(stream.read_to_end(LETTER.len()).await.unwrap() == LETTER);
            connection.closed().await;
        });
        let client = quinn::client(&bed.host("client")).unwrap();
        let address = (bed.host("server").ip(), 443).into();
        let connection = client.connect(address, quinn::SERVER_NAME).unwrap().await.unwrap();
        let mut stream = connection.open_uni().await.unwrap();
        stream.write_all(&LETTER).await.unwrap();
        stream.finish().unwrap();
        stream.stopped().await.unwrap();
        connection.close(0_u32.into(), b"that is all");
        reader.await.unwrap();
        assert!(bed.link_stats("client", "server").dropped(DropCause::Loss) > 0);
    });
}
