//! The program on turmoil.

use std::cell::Cell;
use std::io;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;

use turmoil::net::UdpSocket;

use super::program::{DELAY, Datagrams, Errors, PORT, Role, Runtime, Stream, host};
use super::seldom as now_and_then;

impl Datagrams for UdpSocket {
    async fn send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        Self::send_to(self, bytes, to).await
    }

    async fn receive(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.recv_from(buffer).await.map(|(len, _)| len)
    }
}

/// The clock of a host, since it began: turmoil runs hosts on tokio's paused clock.
#[derive(Clone, Copy)]
struct OfHost(tokio::time::Instant);

impl Runtime for OfHost {
    type Socket = UdpSocket;

    async fn bind(self) -> io::Result<UdpSocket> {
        UdpSocket::bind(("0.0.0.0", PORT)).await
    }

    fn now(self) -> Duration {
        self.0.elapsed()
    }

    async fn sleep_until(self, at: Duration) {
        tokio::time::sleep_until(self.0 + at).await;
    }
}

/// Runs it on a number of hosts, each sending that to each other one, stepped by such ticks. Gives the errors, and how long turmoil says it was.
///
/// # Panics
///
/// If turmoil gives an error.
#[must_use]
pub fn run(tick: Duration, hosts: u32, stream: Stream) -> (Errors, Duration) {
    // Twice as long as it should take.
    let mut sim = simulation(tick, stream.length() * 2 + Duration::from_secs(1));
    let addresses: Vec<SocketAddr> = (0..hosts).map(|host| (sim.lookup(format!("host-{host}")), PORT).into()).collect();
    let errors = Rc::new(Cell::new(Errors::default()));
    for (me, address) in (0..hosts).zip(&addresses) {
        let others = addresses.iter().filter(|other| *other != address).copied().collect();
        let (role, errors) = (Role { me, others, stream }, Rc::clone(&errors));
        sim.client(format!("host-{me}"), async move {
            let seen = host(OfHost(tokio::time::Instant::now()), role).await?;
            errors.set(errors.get().and(seen));
            Ok(())
        });
    }
    sim.run().expect("the program ends");
    (errors.get(), sim.elapsed())
}

/// Runs the program that waits.
///
/// # Panics
///
/// If turmoil gives an error.
pub fn seldom(tick: Duration, wait: Duration, count: u32) {
    let mut sim = simulation(tick, (DELAY * 2 + wait) * count * 2 + Duration::from_secs(1));
    let [client, server]: [SocketAddr; 2] = ["client", "server"].map(|name| (sim.lookup(name), PORT).into());
    sim.host("server", move || async move { Ok(now_and_then::server(OfHost(tokio::time::Instant::now()), client).await?) });
    sim.client("client", async move { Ok(now_and_then::client(OfHost(tokio::time::Instant::now()), server, wait, count).await?) });
    sim.run().expect("the program ends");
}

/// Links of the same delay always, and buffers that do not fill.
fn simulation<'a>(tick: Duration, longest: Duration) -> turmoil::Sim<'a> {
    turmoil::Builder::new()
        .tick_duration(tick)
        .min_message_latency(DELAY)
        .max_message_latency(DELAY)
        .udp_capacity(1024)
        .rng_seed(1)
        .simulation_duration(longest)
        .build()
}
