//! The program with one connection on turmoil-net, whose tasks cannot be told of which host they are.

use turmoil_net::fixture::ClientServer;
use turmoil_net::shim::tokio::net::{TcpListener, TcpStream};
use turmoil_net::{KernelConfig, Latency, rule};

use super::program::{PORT, asking, serve};
use crate::program::DELAY;

/// Asks so often on one connection.
///
/// # Panics
///
/// If the connection gives an error.
pub fn questions(count: u32) {
    // It repeats a segment that nobody answered for a number of ticks of a millisecond, three if it is not said, whatever a round trip takes.
    let bed = ClientServer::with_config(KernelConfig::default().retx_threshold(1000)).server("server", async {
        let listener = TcpListener::bind(("0.0.0.0", PORT)).await.expect("free");
        let (stream, _) = listener.accept().await.expect("it lives");
        serve(stream).await.expect("it lives");
    });
    bed.run("client", async move {
        rule(Latency::fixed(DELAY)).forget();
        let stream = TcpStream::connect(("server", PORT)).await.expect("it listens");
        asking(stream, count).await.expect("it lives");
    });
}
