//! Durations of transfers.

use cohaptic_testkit::{Testbed, time};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::tcp::millis;

/// R·(1 + ⌈log₂(N/(10·MSS) + 1)⌉) from `connect` to the last octet: the window doubles, and the writer fills the segment at which its buffer of 64 KiB ends. A small one
/// in the middle would hold the last one back for a round trip.
#[test]
fn a_buffer_that_ends_within_a_segment_costs_no_round_trip() {
    let bed = Testbed::new(["client", "server"]).links("delay 100ms").seed(1);
    for (octets, milliseconds) in [(100_000, 800), (300_000, 1200), (1_000_000, 1600)] {
        for bed in [bed.clone(), bed.clone().on_tokio()] {
            let took = bed.run(move |bed| async move {
                let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
                drop(bed.host("server").spawn(async move {
                    let mut stream = listener.accept().await.unwrap().0;
                    stream.write_all(&crate::tcp::octets(octets)).await.unwrap();
                    // It stays open, so that no FIN takes the last octets along.
                    let _ = stream.read(&mut [0]).await;
                }));
                let mut stream = bed.host("client").connect("server:80").await.unwrap();
                let mut read = vec![0; octets];
                stream.read_exact(&mut read).await.unwrap();
                assert!(read == crate::tcp::octets(octets));
                time::now()
            });
            assert_eq!(took, millis(milliseconds), "{octets}");
        }
    }
}
