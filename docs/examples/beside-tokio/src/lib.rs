//! A client of a time server, for production over tokio's sockets.

use std::io;
use std::time::Duration;

use net::UdpSocket;
use tokio::time::timeout;

/// The sockets of this program: tokio's in production, those of the test kit in its tests.
mod net {
    #[cfg(test)]
    pub(crate) use cohaptic_testkit::UdpSocket;
    #[cfg(not(test))]
    pub(crate) use tokio::net::UdpSocket;
}

/// Asks a server for its time, at most five times.
///
/// # Errors
///
/// Of kind [`TimedOut`](io::ErrorKind::TimedOut) if the server did not answer, or an error of the socket.
pub async fn ask(server: &str) -> io::Result<u64> {
    let socket = UdpSocket::bind("0.0.0.0:0").await?;
    socket.connect(server).await?;
    let mut answer = [0; 8];
    for _ in 0..5 {
        socket.send(b"time?").await?;
        if let Ok(length) = timeout(Duration::from_millis(500), socket.recv(&mut answer)).await {
            length?;
            return Ok(u64::from_be_bytes(answer));
        }
    }
    Err(io::ErrorKind::TimedOut.into())
}

#[cfg(test)]
mod tests {
    use cohaptic_testkit::proptest::prelude::*;
    use cohaptic_testkit::strategies::{LinkBounds, links_like};
    use cohaptic_testkit::{Bed, Testbed, UdpSocket};

    use super::ask;

    async fn one_question(bed: Bed) {
        bed.host("server").spawn(async {
            let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
            let mut question = [0; 5];
            while let Ok((_, from)) = socket.recv_from(&mut question).await {
                socket.send_to(&2015_u64.to_be_bytes(), from).await.unwrap();
            }
        });
        let client = bed.host("client").spawn(ask("server:7"));
        assert_eq!(client.await.unwrap().unwrap(), 2015);
    }

    proptest! {
        #[test]
        fn a_phone_gets_the_time(link in links_like(LinkBounds::phone())) {
            Testbed::new(["client", "server"]).links(link).on_tokio().run(one_question);
        }
    }

    #[test]
    fn two_lost_questions_are_asked_again() {
        Testbed::new(["client", "server"]).links("delay 100ms").hit("client", "server", "drop packets 1 2").on_tokio().run(one_question);
    }
}
