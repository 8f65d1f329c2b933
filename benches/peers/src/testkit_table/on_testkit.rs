//! The program on the test kit.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::{Instant, Testbed, UdpSocket, time};

use super::program::{DELAY, Datagrams, Errors, PORT, Role, Runtime, Stream, host};
use super::seldom as now_and_then;

/// Which runtime, and whose timers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// The executor of the test kit.
    Own,
    /// Tokio, with the time of the test kit.
    Tokio,
    /// Tokio, with its own timers.
    TokioTimers,
}

impl Datagrams for UdpSocket {
    async fn send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        Self::send_to(self, bytes, to).await
    }

    async fn receive(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.recv(buffer).await
    }
}

/// The time of the test kit.
#[derive(Clone, Copy)]
struct Exact;

impl Runtime for Exact {
    type Socket = UdpSocket;

    async fn bind(self) -> io::Result<UdpSocket> {
        UdpSocket::bind(("0.0.0.0", PORT)).await
    }

    fn now(self) -> Duration {
        Duration::from_nanos(time::now().as_nanos())
    }

    async fn sleep_until(self, at: Duration) {
        time::sleep_until(Instant::ZERO + at).await;
    }
}

/// The time of tokio, since then.
#[derive(Clone, Copy)]
struct OfTokio(tokio::time::Instant);

impl Runtime for OfTokio {
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

/// Runs it on a number of hosts, each sending that to each other one.
///
/// # Panics
///
/// If a socket gives an error.
#[must_use]
pub fn run(kind: Kind, hosts: u32, stream: Stream) -> Errors {
    let bed = Testbed::new((0..hosts).map(|host| format!("host-{host}"))).links(format!("delay {}ns", DELAY.as_nanos()));
    let bed = if kind == Kind::Own { bed } else { bed.on_tokio() };
    bed.run(move |bed| async move {
        let places = bed.hosts();
        let tasks: Vec<_> = (0..hosts)
            .zip(&places)
            .map(|(me, place)| {
                let others = places.iter().filter(|other| other.ip() != place.ip()).map(|other| (other.ip(), PORT).into()).collect();
                let role = Role { me, others, stream };
                match kind {
                    Kind::Own | Kind::Tokio => place.spawn(host(Exact, role)),
                    Kind::TokioTimers => place.spawn(host(OfTokio(tokio::time::Instant::now()), role)),
                }
            })
            .collect();
        let mut errors = Errors::default();
        for task in tasks {
            errors = errors.and(task.await.expect("no host crashes").expect("sockets work"));
        }
        errors
    })
}

/// Runs the program that waits.
///
/// # Panics
///
/// If a socket gives an error.
pub fn seldom(kind: Kind, wait: Duration, count: u32) {
    let bed = Testbed::new(["client", "server"]).links(format!("delay {}ns", DELAY.as_nanos()));
    let bed = if kind == Kind::Own { bed } else { bed.on_tokio() };
    bed.run(move |bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        let addresses: [SocketAddr; 2] = [(client.ip(), PORT).into(), (server.ip(), PORT).into()];
        let done = match kind {
            Kind::Own | Kind::Tokio => {
                server.spawn(now_and_then::server(Exact, addresses[0]));
                client.spawn(now_and_then::client(Exact, addresses[1], wait, count))
            }
            Kind::TokioTimers => {
                let clock = OfTokio(tokio::time::Instant::now());
                server.spawn(now_and_then::server(clock, addresses[0]));
                client.spawn(now_and_then::client(clock, addresses[1], wait, count))
            }
        };
        done.await.expect("no host crashes").expect("sockets work");
    });
}

/// Sends a number of datagrams of 64 bytes from one socket to another, one every 10 µs, over a link of 24 ms; gives how many arrived.
///
/// # Panics
///
/// If a socket gives an error.
#[must_use]
pub fn pair(kind: Kind, count: u32) -> u32 {
    let bed = Testbed::new(["sender", "receiver"]).links("delay 24ms");
    let bed = if kind == Kind::Own { bed } else { bed.on_tokio() };
    bed.run(move |bed| async move {
        let (sender, receiver) = (bed.host("sender").bind("0.0.0.0:0").expect("free"), bed.host("receiver").bind("0.0.0.0:7").expect("free"));
        let received = bed.spawn(async move {
            let mut buffer = [0; 64];
            for _ in 0..count {
                receiver.recv_from(&mut buffer).await.expect("it lives");
            }
            count
        });
        let to = SocketAddr::from((bed.host("receiver").ip(), 7));
        for number in 0..count {
            time::sleep_until(Instant::ZERO + Duration::from_micros(10) * number).await;
            sender.send_to(&[0; 64], to).await.expect("it lives");
        }
        received.await.expect("it is not stopped")
    })
}
