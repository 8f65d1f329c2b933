//! Real sockets on loopback. Instants are checked from below only, because a busy machine may be late.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Instant as Clock;

use cohaptic_streams::{Control, Report, RunOptions, Streams, StreamsError};

use super::*;

/// Longest time that a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// Relay that runs on a thread.
struct Running {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    control: Sender<Control>,
    thread: JoinHandle<Report>,
}

impl Running {
    fn start(forth: &str, back: &str, to: SocketAddr) -> Self {
        let mut config = config(forth, back);
        config.proxies[0].to = to;
        let mut streams = Streams::bind(config).unwrap();
        let (address, stop) = (streams.addresses()[0], Arc::new(AtomicBool::new(false)));
        let (control, heard) = channel();
        let stopped = Arc::clone(&stop);
        let thread = thread::spawn(move || streams.run(&RunOptions::default(), &heard, &stopped, |_| ()).unwrap());
        Self { address, stop, control, thread }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    fn end(self) -> Report {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// Starts a program that sends everything back, and ends a connection after the client has ended it.
fn echo() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            thread::spawn(move || {
                let mut buffer = [0; 16_384];
                while let Ok(count @ 1..) = stream.read(&mut buffer) {
                    if stream.write_all(&buffer[..count]).is_err() {
                        return;
                    }
                }
                let _ = stream.shutdown(Shutdown::Write);
            });
        }
    });
    address
}

#[test]
fn an_answer_takes_both_delays_and_a_half_closed_connection_gets_all_of_it() {
    let relay = Running::start("delay=20ms", "delay=30ms", echo());
    let begun = Clock::now();
    let mut client = relay.connect();
    client.write_all(b"hello").unwrap();
    client.shutdown(Shutdown::Write).unwrap();
    let mut answer = Vec::new();
    client.read_to_end(&mut answer).unwrap();
    assert_eq!(answer, b"hello");
    assert!(begun.elapsed() >= Duration::from_millis(50));
    let report = relay.end();
    let proxy = &report.proxies[0];
    assert_eq!((proxy.counts.opened, proxy.counts.ended, proxy.lines[0].bytes.sent, proxy.lines[1].bytes.sent), (1, 1, 5, 5));
    assert_eq!((report.open, report.held.get(), report.release.count()), (0, 0, 2));
}

#[test]
fn many_connections_carry_their_own_bytes() {
    let relay = Running::start("delay=2ms jitter=1ms", "delay=1ms", echo());
    let clients = (0..100_u8).map(|number| {
        let mut client = relay.connect();
        thread::spawn(move || {
            let sent: Vec<u8> = (0..50_000_u32).map(|place| (place % 251) as u8 ^ number).collect();
            let mut writer = client.try_clone().unwrap();
            let bytes = sent.clone();
            let writing = thread::spawn(move || {
                writer.write_all(&bytes).unwrap();
                writer.shutdown(Shutdown::Write).unwrap();
            });
            let mut got = Vec::new();
            client.read_to_end(&mut got).unwrap();
            writing.join().unwrap();
            assert!(got == sent, "connection {number}");
        })
    });
    clients.collect::<Vec<_>>().into_iter().for_each(|client| client.join().unwrap());
    let report = relay.end();
    assert_eq!((report.proxies[0].counts.opened, report.proxies[0].counts.ended), (100, 100));
    assert_eq!(report.proxies[0].lines.map(|line| (line.bytes.sent, line.bytes.lost)), [(5_000_000, 0); 2]);
}

#[test]
fn a_client_of_a_program_that_nobody_runs_is_reset() {
    // A port that was free a moment ago.
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let relay = Running::start("delay=1ms", "", free);
    let mut client = relay.connect();
    let error = client.read(&mut [0; 9]).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::ConnectionReset);
    assert_eq!(relay.end().proxies[0].counts.refused, 1);
}

/// A client may end its stream before the program has accepted the connection. A listener whose queue is full lets the relay wait, on Linux.
#[test]
#[cfg(target_os = "linux")]
fn the_end_of_a_client_that_comes_before_the_program_accepts_arrives_after() {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).unwrap();
    socket.bind(&SocketAddr::from(([127, 0, 0, 1], 0)).into()).unwrap();
    socket.listen(0).unwrap();
    let listener = TcpListener::from(socket);
    let address = listener.local_addr().unwrap();
    // A queue of the length zero takes one connection.
    let first = TcpStream::connect(address).unwrap();
    let relay = Running::start("", "", address);
    let mut client = relay.connect();
    client.shutdown(Shutdown::Write).unwrap();
    // Long enough for the end to reach the relay, and shorter than the system's wait before it asks the full listener again.
    thread::sleep(Duration::from_millis(200));
    drop((listener.accept().unwrap(), first));
    let (mut server, _) = listener.accept().unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    server.write_all(b"greeting").unwrap();
    assert_eq!(server.read(&mut [0; 9]).unwrap(), 0);
    drop(server);
    let mut greeting = Vec::new();
    client.read_to_end(&mut greeting).unwrap();
    assert_eq!(greeting, b"greeting");
    assert_eq!(relay.end().proxies[0].counts.ended, 1);
}

#[test]
fn reset_after_resets_and_close_after_closes() {
    let relay = Running::start("reset-after=30ms", "", echo());
    let mut client = relay.connect();
    assert_eq!(client.read(&mut [0; 9]).unwrap_err().kind(), ErrorKind::ConnectionReset);
    assert_eq!(relay.end().proxies[0].counts.reset_after, 1);

    let relay = Running::start("close-after=30ms", "", echo());
    let mut client = relay.connect();
    client.write_all(b"hello").unwrap();
    let mut got = Vec::new();
    client.read_to_end(&mut got).unwrap();
    assert_eq!(got, b"hello");
    assert_eq!(relay.end().proxies[0].counts.closed_after, 1);
}

#[test]
fn the_end_of_a_client_that_is_killed_reaches_the_program_as_a_reset() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let relay = Running::start("delay=5ms", "", listener.local_addr().unwrap());
    let client = relay.connect();
    let (mut server, _) = listener.accept().unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    socket2::SockRef::from(&client).set_linger(Some(Duration::ZERO)).unwrap();
    drop(client);
    assert_eq!(server.read(&mut [0; 9]).unwrap_err().kind(), ErrorKind::ConnectionReset);
    assert_eq!(relay.end().proxies[0].counts.reset, 1);
}

/// The receiver reads nothing: the sender is stopped by what the relay holds and by the buffers of the system.
#[test]
fn a_receiver_that_does_not_read_stops_the_sender() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let relay = Running::start("buffer=100kB", "", listener.local_addr().unwrap());
    let mut client = relay.connect();
    let (mut server, _) = listener.accept().unwrap();
    client.set_write_timeout(Some(Duration::from_millis(500))).unwrap();
    let (chunk, mut written) = (vec![7; 1 << 20], 0_usize);
    // Buffers of the system are at most some 10 MB at each of the four ends.
    while written < 1 << 30 {
        match client.write(&chunk) {
            Ok(count) => written += count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(written < 1 << 30, "the sender was never stopped");
    client.shutdown(Shutdown::Write).unwrap();
    let mut got = 0;
    let mut buffer = vec![0; 1 << 16];
    while let count @ 1.. = server.read(&mut buffer).unwrap() {
        got += count;
    }
    assert_eq!(got, written);
    drop((client, server));
    relay.end();
}

#[test]
fn a_change_while_running_delays_later_bytes() {
    let relay = Running::start("", "", echo());
    let mut client = relay.connect();
    let mut ask = || {
        let begun = Clock::now();
        client.write_all(b"x").unwrap();
        client.read_exact(&mut [0]).unwrap();
        begun.elapsed()
    };
    ask();
    relay.control.send(Control { line: 0, stream: Box::new(stream("delay=60ms")) }).unwrap();
    let begun = Clock::now();
    // The message is read at the latest at the next look.
    while ask() < Duration::from_millis(60) {
        assert!(begun.elapsed() < PATIENCE);
    }
    relay.end();
}

#[test]
fn a_relay_to_itself_and_a_taken_address_are_refused() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut config = config("", "");
    config.proxies[0].listen = taken.local_addr().unwrap();
    let error = Streams::bind(config.clone()).unwrap_err();
    assert!(matches!(error, StreamsError::Listen { .. }), "{error}");
    drop(taken);
    config.proxies[0].to = config.proxies[0].listen;
    let error = Streams::bind(config).unwrap_err();
    assert!(matches!(error, StreamsError::ToItself { .. }), "{error}");
}
