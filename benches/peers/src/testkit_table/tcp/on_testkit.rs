//! The programs on the test kit.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_benches_common::machine::field;
use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::tcp::TcpConfig;
use cohaptic_testkit::{Host, Instant, TcpListener, TcpStream, Testbed, time};

use super::program::{Net, PORT, answer, ask, crowd, feed, give, swallow, take};
use crate::program::DELAY;

impl Net for Host {
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
        time::sleep(span).await;
    }

    fn spawn(&self, task: impl Future<Output = io::Result<()>> + 'static) -> impl Future<Output = io::Result<()>> + 'static {
        let task = Self::spawn(self, task);
        async { task.await.map_err(io::Error::other)? }
    }
}

/// A client and a server, on the executor of the test kit or on tokio.
fn bed(on_tokio: bool, links: &str) -> Testbed {
    let bed = Testbed::new(["client", "server"]).links(links);
    if on_tokio { bed.on_tokio() } else { bed }
}

fn delayed(on_tokio: bool) -> Testbed {
    bed(on_tokio, &format!("delay {}ns", DELAY.as_nanos()))
}

/// Asks so often on one connection.
///
/// # Panics
///
/// If the connection gives an error.
pub fn questions(on_tokio: bool, count: u32) {
    delayed(on_tokio).run(|bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        server.spawn(answer(server.clone()));
        client.spawn(ask::<Host>((server.ip(), PORT).into(), count)).await.expect("no host crashes").expect("it lives");
    });
}

/// Asks a number of times on each of a number of connections.
///
/// # Panics
///
/// If a connection gives an error.
pub fn connections(on_tokio: bool, count: u32, questions: u32) {
    delayed(on_tokio).run(|bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        server.spawn(answer(server.clone()));
        let asking = crowd(client.clone(), (server.ip(), PORT).into(), count, questions);
        client.spawn(asking).await.expect("no host crashes").expect("they live");
    });
}

/// Hosts that each write a number of octets to one server.
///
/// # Panics
///
/// If a connection gives an error.
pub fn fan_in(on_tokio: bool, clients: u32, delay: Duration, octets: usize) {
    let names: Vec<String> = (0..clients).map(|number| format!("client{number}")).collect();
    let bed = Testbed::new(names.iter().map(String::as_str).chain(["server"])).links(format!("delay {}ns", delay.as_nanos()));
    let bed = if on_tokio { bed.on_tokio() } else { bed };
    bed.run(|bed| async move {
        let server = bed.host("server");
        server.spawn(swallow(server.clone()));
        let tasks: Vec<_> = names.iter().map(|name| bed.host(name).spawn(feed::<Host>((server.ip(), PORT).into(), octets))).collect();
        for task in tasks {
            task.await.expect("no host crashes").expect("it lives");
        }
    });
}

/// The instants at which 40 octets in 100, and all of them, have come from the server.
///
/// # Panics
///
/// If the connection gives an error.
pub fn bulk(on_tokio: bool, links: &str, octets: usize) -> [Instant; 2] {
    taken(bed(on_tokio, links), octets)
}

/// As [`bulk`], with these constants of TCP.
///
/// # Panics
///
/// If the connection gives an error.
pub fn transfer(config: TcpConfig, links: &str, octets: usize) -> [Instant; 2] {
    taken(bed(false, links).tcp(config), octets)
}

/// As [`bulk`], where the server's every n-th packet is lost.
///
/// # Panics
///
/// If the connection gives an error.
pub fn sawtooth(config: TcpConfig, links: &str, every: u64, octets: usize) -> [Instant; 2] {
    let lossy = move |number: u64| if number % every == every - 1 { Verdict::Drop } else { Verdict::Pass };
    taken(bed(false, links).tcp(config).on_packet("server", "client", move |packet| lossy(packet.number)), octets)
}

fn taken(bed: Testbed, octets: usize) -> [Instant; 2] {
    bed.run(|bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        server.spawn(give(server.clone(), octets));
        let mut stream = client.connect((server.ip(), PORT)).await.expect("it listens");
        let begin = octets / 5 * 2;
        take(&mut stream, begin).await.expect("it lives");
        let middle = time::now();
        take(&mut stream, octets - begin).await.expect("it lives");
        [middle, time::now()]
    })
}

/// By how much the memory of this process grows for each end of a number of idle connections \[byte\]; `None` where the system does not say it.
///
/// # Panics
///
/// If a connection gives an error.
pub fn idle(count: u32) -> Option<f64> {
    let resident = || field("/proc/self/status", "VmRSS")?.strip_suffix(" kB")?.parse::<u32>().ok();
    delayed(false).run(|bed| async move {
        let (client, server) = (bed.host("client"), bed.host("server"));
        let listener = server.listen(("0.0.0.0", PORT)).expect("free");
        let mut ends = Vec::new();
        let before = resident();
        for _ in 0..count {
            ends.push(client.connect((server.ip(), PORT)).await.expect("it listens"));
            ends.push(listener.accept().await.expect("it lives").0);
        }
        Some(f64::from(resident()?.checked_sub(before?)?) * 1024.0 / f64::from(2 * count))
    })
}
