//! The table of docs/exec.md: what the gateway of `cohaptic exec`, and `--loopback`, add to a bare connection, in delay and in throughput.
//!
//! ```text
//! cargo run --release -p cohaptic-exec --example gateway_table
//! ```
//!
//! A server of the machine speaks with a client, first without any network between both, then through the gateway over links of several delays. Last, client
//! and server are one command, whose packets to itself pass links. The client is this program too.
#![allow(clippy::print_stdout, clippy::disallowed_methods, reason = "time is measured, and a table is printed")]

use std::error::Error;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Command, ExitCode};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_exec::{GATEWAY, GatewayPlan, HostPlan, Output, PREFIX, Plan, Setup, host};
use cohaptic_linkfile::router::Network;
use cohaptic_linkfile::{LinkTable, link_from_keys};
use cohaptic_realtime::{Pacing, Tolerance, Wishes};

/// Argument of the client, before the address of the server. Without an address the client starts the server itself.
const CLIENT: &str = "client";
/// Questions of one byte, each asked after the answer to the last.
const QUESTIONS: usize = 1000;
/// Length of each transfer.
const TRANSFER: Duration = Duration::from_secs(3);
/// Time at the beginning of a transfer that does not count, in which the windows grow.
const BEGINNING: Duration = Duration::from_secs(1);

fn main() -> Result<ExitCode, Box<dyn Error>> {
    if let Some(ended) = cohaptic_exec::run_inside() {
        return Ok(ended);
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [role, server @ ..] = arguments.as_slice()
        && role == CLIENT
    {
        let server = server.first().map_or_else(serve, |server| Ok(server.parse()?))?;
        println!("{}", client(server)?);
        return Ok(ExitCode::SUCCESS);
    }
    let server = serve()?;
    println!("| connection | round trip, p50 [µs] | round trip, p99 [µs] | down [Gbit/s] | up [Gbit/s] |\n| --- | ---: | ---: | ---: | ---: |");
    let bare = Command::new(std::env::current_exe()?).args([CLIENT, &server.to_string()]).output()?;
    println!("| bare, over the loopback interface | {} |", String::from_utf8(bare.stdout)?.trim());
    for (name, server, delay) in [
        ("through the gateway, no delay", Some(server), "0ms"),
        ("through the gateway, 1 ms each way", Some(server), "1ms"),
        ("through the gateway, 24 ms each way", Some(server), "24ms"),
        ("with `--loopback`, no delay", None, "0ms"),
        ("with `--loopback`, 1 ms each way", None, "1ms"),
    ] {
        println!("| {name} | {} |", through(server, delay)?);
    }
    Ok(ExitCode::SUCCESS)
}

/// Starts a server on a thread of its own. The first byte of a connection says what the server does: echo, send, or receive.
fn serve() -> Result<SocketAddr, Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    thread::spawn(move || {
        while let Ok((mut stream, _)) = listener.accept() {
            thread::spawn(move || -> std::io::Result<()> {
                stream.set_nodelay(true)?;
                let (mut kind, mut buffer) = ([0], vec![0; 1 << 16]);
                stream.read_exact(&mut kind)?;
                match kind {
                    [b'e'] => loop {
                        stream.read_exact(&mut kind)?;
                        stream.write_all(&kind)?;
                    },
                    [b'd'] => loop {
                        stream.write_all(&buffer)?;
                    },
                    _ => while stream.read(&mut buffer)? > 0 {},
                }
                Ok(())
            });
        }
    });
    Ok(address)
}

/// Measures the connection to a server, and returns the cells of a row.
fn client(server: SocketAddr) -> Result<String, Box<dyn Error>> {
    let mut stream = TcpStream::connect(server)?;
    stream.set_nodelay(true)?;
    stream.write_all(b"e")?;
    let mut round_trips = Vec::with_capacity(QUESTIONS);
    for _ in 0..QUESTIONS {
        let begin = Instant::now();
        stream.write_all(b"?")?;
        stream.read_exact(&mut [0])?;
        round_trips.push(begin.elapsed());
    }
    round_trips.sort_unstable();
    let micros = |percent: usize| round_trips[round_trips.len() * percent / 100].as_micros();
    let mut buffer = vec![0; 1 << 16];
    let down = transfer(server, b'd', |stream| stream.read(&mut buffer))?;
    let data = vec![0; 1 << 16];
    let up = transfer(server, b'u', |stream| stream.write(&data))?;
    Ok(format!("{} | {} | {down:.2} | {up:.2}", micros(50), micros(99)))
}

/// Returns the throughput of a transfer \[Gbit/s\].
fn transfer(server: SocketAddr, kind: u8, mut pass: impl FnMut(&mut TcpStream) -> std::io::Result<usize>) -> Result<f64, Box<dyn Error>> {
    let mut stream = TcpStream::connect(server)?;
    stream.write_all(&[kind])?;
    let begin = Instant::now();
    let (mut bytes, mut counted_from) = (0_u64, None);
    while begin.elapsed() < BEGINNING + TRANSFER {
        let count = pass(&mut stream)?;
        if begin.elapsed() >= BEGINNING {
            counted_from.get_or_insert_with(Instant::now);
            bytes += count as u64;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "for people")]
    let bits = (bytes * 8) as f64;
    Ok(bits / 1e9 / counted_from.map_or(f64::INFINITY, |from| from.elapsed().as_secs_f64()))
}

/// Returns the cells of a row for a client beyond links with a delay. Without a server of the machine, the client has a server of its own.
fn through(server: Option<SocketAddr>, delay: &str) -> Result<String, Box<dyn Error>> {
    let setup = Setup {
        addresses: host(0).into_iter().zip(PREFIX).filter_map(|(address, prefix)| Network::new(address, prefix)).collect(),
        loopback: server.is_none(),
        ..Setup::default()
    };
    let address = server.map(|server| SocketAddr::new(GATEWAY[0], server.port()).to_string().into());
    let command = [std::env::current_exe()?.into(), CLIENT.into()].into_iter().chain(address).collect();
    let nodes = 2 + usize::from(setup.loopback);
    let plan = Plan {
        seed: 0,
        hosts: vec![HostPlan { name: CLIENT.to_owned(), setup, command, is_main: true, ready: None, output: Output::Lines }],
        gateway: Some(GatewayPlan { name: "world".to_owned(), name_server: None, listen: Vec::new() }),
        links: LinkTable::uniform(nodes, link_from_keys(&[format!("delay={delay}")])?),
        pacing: Pacing::Sleep,
        wishes: Wishes::default(),
        tolerance: Tolerance { limit: Duration::from_millis(1) },
        captures: None,
    };
    let said = Mutex::new(String::new());
    let outcome =
        cohaptic_exec::run(&plan, &|line| said.lock().unwrap_or_else(PoisonError::into_inner).push_str(&String::from_utf8_lossy(line.bytes)))?;
    if outcome.status != 0 {
        return Err(format!("the client ended with status {}", outcome.status).into());
    }
    Ok(said.into_inner().unwrap_or_else(PoisonError::into_inner))
}
