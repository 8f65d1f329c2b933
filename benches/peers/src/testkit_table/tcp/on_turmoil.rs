//! The programs on turmoil.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use turmoil::Sim;
use turmoil::net::{TcpListener, TcpStream};

use super::program::{Net, PORT, answer, ask, crowd, feed, swallow};
use crate::program::DELAY;

/// The host that runs.
#[derive(Clone)]
struct Here;

impl Net for Here {
    type Stream = TcpStream;
    type Listener = TcpListener;

    async fn listen(&self) -> io::Result<TcpListener> {
        TcpListener::bind(("0.0.0.0", PORT)).await
    }

    async fn accept(listener: &TcpListener) -> io::Result<TcpStream> {
        listener.accept().await.map(|(stream, _)| stream)
    }

    async fn connect(server: SocketAddr) -> io::Result<TcpStream> {
        TcpStream::connect(server).await
    }

    async fn sleep(span: Duration) {
        tokio::time::sleep(span).await;
    }

    fn spawn(&self, task: impl Future<Output = io::Result<()>> + 'static) -> impl Future<Output = io::Result<()>> + 'static {
        let task = tokio::task::spawn_local(task);
        async { task.await? }
    }
}

/// Asks so often on one connection.
///
/// # Panics
///
/// If turmoil gives an error.
pub fn questions(count: u32) {
    let (mut sim, server) = simulation(DELAY * 4 * count);
    sim.client("client", async move { Ok(ask::<Here>(server, count).await?) });
    sim.run().expect("the program ends");
}

/// Asks a number of times on each of a number of connections.
///
/// # Panics
///
/// If turmoil gives an error.
pub fn connections(count: u32, questions: u32) {
    let (mut sim, server) = simulation(DELAY * 4 * questions);
    sim.client("client", async move { Ok(crowd(Here, server, count, questions).await?) });
    sim.run().expect("the program ends");
}

/// Hosts that each write a number of octets to one server.
///
/// # Panics
///
/// If turmoil gives an error.
pub fn fan_in(clients: u32, delay: Duration, octets: usize) {
    let (mut sim, server) = simulated(delay, Duration::from_secs(60));
    sim.host("server", || async { Ok(swallow(Here).await?) });
    for number in 0..clients {
        sim.client(format!("client{number}"), async move { Ok(feed::<Here>(server, octets).await?) });
    }
    sim.run().expect("the program ends");
}

/// Links of [`DELAY`], and the server that answers.
fn simulation<'a>(longest: Duration) -> (Sim<'a>, SocketAddr) {
    let (mut sim, server) = simulated(DELAY, longest);
    sim.host("server", || async { Ok(answer(Here).await?) });
    (sim, server)
}

/// Links of the same delay always and queues that do not fill, and the address of the server.
fn simulated<'a>(delay: Duration, longest: Duration) -> (Sim<'a>, SocketAddr) {
    let sim = turmoil::Builder::new()
        .min_message_latency(delay)
        .max_message_latency(delay)
        .tcp_capacity(1024)
        .rng_seed(1)
        .simulation_duration(longest + Duration::from_secs(1))
        .build();
    let server = (sim.lookup("server"), PORT).into();
    (sim, server)
}
