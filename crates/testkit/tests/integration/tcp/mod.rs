//! Tests of streams and listeners.

mod ends;
mod faults;
mod handshake;
mod like_tokio;
mod limits;
mod records;
mod times;
#[cfg(feature = "strategies")]
mod trains;
mod traps;

use std::time::Duration;

use cohaptic_testkit::{Instant, Testbed};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

/// Returns test beds with the same hosts on both runtimes. A round trip takes 100 ms.
fn beds() -> [Testbed; 2] {
    let bed = Testbed::new(["a", "b"]).links("delay 50ms").seed(1);
    [bed.clone(), bed.on_tokio()]
}

/// Time limit for programs that wait for longer than the default limit of a test bed, such as for keep-alive.
const DAY: Duration = Duration::from_secs(86_400);

const R: Duration = Duration::from_millis(100);

const fn millis(milliseconds: u64) -> Instant {
    Instant::from_nanos(milliseconds * 1_000_000)
}

/// Returns the octet at a place of every stream. Neighbouring places differ, so that a lost, doubled or invented octet is noticed.
fn octet(at: usize) -> u8 {
    ((at * 31 + at / 251) % 251) as u8
}

/// Returns the first `count` octets of every stream. They repeat after 251², so that megabytes are copied and not computed.
fn octets(count: usize) -> Vec<u8> {
    const PERIOD: usize = 251 * 251;
    let mut octets = (0..PERIOD).map(octet).collect::<Vec<_>>().repeat(count.div_ceil(PERIOD));
    octets.truncate(count);
    octets
}

/// Writes all octets and shuts the direction.
async fn send_all(stream: &mut (impl AsyncWriteExt + Unpin), count: usize) {
    stream.write_all(&octets(count)).await.unwrap();
    stream.shutdown().await.unwrap();
}

/// Reads to the end and checks every octet.
async fn read_all(stream: &mut (impl AsyncReadExt + Unpin), count: usize) {
    let mut read = Vec::new();
    stream.read_to_end(&mut read).await.unwrap();
    assert!(read == octets(count), "{} octets of {count}, or wrong ones", read.len());
}
