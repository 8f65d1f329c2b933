use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{LinkBounds, links_like};
use cohaptic_testkit::{Bed, Testbed, quinn, time};

/// The client sends the positions 1 to 20 as datagrams of QUIC, one every 10 ms. The server shows each that arrives.
async fn twenty_positions(bed: Bed) {
    let server = quinn::server(&bed.host("server"), "0.0.0.0:443").unwrap();
    let shown = bed.host("server").spawn(async move {
        let connection = server.accept().await.unwrap().await.unwrap();
        let mut shown = 0;
        while let Ok(position) = connection.read_datagram().await {
            assert!(position[0] > shown, "shown: {shown}, and then {}", position[0]);
            shown = position[0];
        }
    });
    let client = quinn::client(&bed.host("client")).unwrap();
    let address = (bed.host("server").ip(), 443).into();
    let connection = client.connect(address, quinn::SERVER_NAME).unwrap().await.unwrap();
    for position in 1..=20 {
        connection.send_datagram(vec![position].into()).unwrap();
        time::sleep(Duration::from_millis(10)).await;
    }
    time::sleep(Duration::from_secs(1)).await;
    connection.close(0_u32.into(), b"the end");
    shown.await.unwrap();
}

proptest! {
    #[test]
    fn positions_never_go_back(link in links_like(
        LinkBounds::ideal()
            .delay(Duration::ZERO..=Duration::from_millis(100))
            .jitter(Duration::ZERO..=Duration::from_millis(50))
            .loss(0.0..=5.0)
            .duplicate(0.0..=5.0)
    )) {
        Testbed::new(["client", "server"]).links(link).run(twenty_positions);
    }
}
