//! Connections of TCP over loopback: directly, through a forwarder without a network, and through the relay.

use std::error::Error;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cohaptic_linkfile::TcpRelayFile;
use cohaptic_realtime::Lateness;
use cohaptic_streams::{RunOptions, Streams};

/// Bytes of a question and of its answer.
const QUESTION: usize = 64;

/// Bytes of one write of the sender.
const CHUNK: usize = 64 * 1024;

/// Program between client and server.
pub(crate) enum Between {
    Nothing,
    /// `tokio::io::copy_bidirectional`: forwards, and does no more.
    Forwarder,
    /// The relay with these keys in both directions.
    Relay(&'static str),
}

impl Between {
    pub(crate) const ALL: [Self; 6] = [
        Self::Nothing,
        Self::Forwarder,
        Self::Relay(""),
        Self::Relay("delay = \"5ms\""),
        Self::Relay("delay = \"5ms\", jitter = \"1ms\""),
        Self::Relay("delay = \"5ms\", rate = \"100Mbit\""),
    ];

    pub(crate) fn name(&self) -> String {
        match self {
            Self::Nothing => "nothing".to_owned(),
            Self::Forwarder => "`tokio::io::copy_bidirectional`".to_owned(),
            Self::Relay("") => "relay".to_owned(),
            Self::Relay(keys) => format!("relay, `{keys}`"),
        }
    }

    /// Delay of a question and its answer that the keys ask for.
    pub(crate) fn asked(&self) -> Duration {
        if matches!(self, Self::Relay(keys) if keys.contains("5ms")) { Duration::from_millis(10) } else { Duration::ZERO }
    }

    /// Begins to stand before `server`, and returns the address for clients.
    fn begin(&self, server: SocketAddr) -> Result<(SocketAddr, Standing), Box<dyn Error>> {
        match self {
            Self::Nothing => Ok((server, Standing::Nothing)),
            Self::Forwarder => {
                let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
                let listener = runtime.block_on(tokio::net::TcpListener::bind("127.0.0.1:0"))?;
                let address = listener.local_addr()?;
                runtime.spawn(async move {
                    while let Ok((mut client, _)) = listener.accept().await {
                        tokio::spawn(async move {
                            let Ok(mut server) = tokio::net::TcpStream::connect(server).await else { return };
                            let _ = (client.set_nodelay(true), server.set_nodelay(true));
                            let _ = tokio::io::copy_bidirectional(&mut client, &mut server).await;
                        });
                    }
                });
                Ok((address, Standing::Forwarder(runtime)))
            }
            Self::Relay(keys) => {
                let text = format!("proxies = [{{ name = \"p\", listen = \"127.0.0.1:0\", to = \"{server}\", forth = {{ {keys} }} }}]");
                let mut streams = Streams::bind(TcpRelayFile::parse(&text, "table.toml".as_ref(), &[])?.into())?;
                let (address, stop) = (streams.addresses()[0], Arc::new(AtomicBool::new(false)));
                let stopped = Arc::clone(&stop);
                let (_say, heard) = channel();
                let thread = thread::spawn(move || streams.run(&RunOptions::default(), &heard, &stopped, |_| ()).map(drop));
                Ok((address, Standing::Relay(stop, Some(thread))))
            }
        }
    }
}

/// Running program between client and server, which ends when it is dropped.
enum Standing {
    Nothing,
    #[expect(dead_code, reason = "dropped at the end of the run")]
    Forwarder(tokio::runtime::Runtime),
    Relay(Arc<AtomicBool>, Option<JoinHandle<Result<(), cohaptic_streams::StreamsError>>>),
}

impl Drop for Standing {
    fn drop(&mut self) {
        if let Self::Relay(stop, thread) = self {
            stop.store(true, Ordering::Relaxed);
            // A relay that failed has closed its connections, which the measurement has noticed.
            let _ = thread.take().map(JoinHandle::join);
        }
    }
}

/// Asks 64 bytes and waits for the answer, again and again for `span`. Returns the times.
pub(crate) fn round_trips(between: &Between, span: Duration) -> Result<Lateness, Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let (address, _standing) = between.begin(listener.local_addr()?)?;
    let mut client = TcpStream::connect(address)?;
    client.set_nodelay(true)?;
    let mut server = listener.accept()?.0;
    server.set_nodelay(true)?;
    let answering = thread::spawn(move || {
        let mut buffer = [0; QUESTION];
        while server.read_exact(&mut buffer).and_then(|()| server.write_all(&buffer)).is_ok() {}
    });
    let (begun, mut times, mut buffer) = (Instant::now(), Lateness::new(), [0; QUESTION]);
    while begun.elapsed() < span {
        let asked = Instant::now();
        client.write_all(&buffer)?;
        client.read_exact(&mut buffer)?;
        times.record(asked.elapsed());
    }
    client.shutdown(Shutdown::Both)?;
    drop(client);
    let _ = answering.join();
    Ok(times)
}

/// Sends as much as passes for `span`. Returns the bytes a second that the server has read.
pub(crate) fn throughput(between: &Between, span: Duration) -> Result<f64, Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let (address, _standing) = between.begin(listener.local_addr()?)?;
    let mut client = TcpStream::connect(address)?;
    let mut server = listener.accept()?.0;
    let reading = thread::spawn(move || {
        let (mut buffer, mut first, mut count) = (vec![0; CHUNK], None, 0_usize);
        // The time counts from the first byte, so that a delay does not make the rate lower.
        while let Ok(read @ 1..) = server.read(&mut buffer) {
            let begun = *first.get_or_insert_with(Instant::now);
            count += read;
            if begun.elapsed() >= span {
                return count as f64 / begun.elapsed().as_secs_f64();
            }
        }
        0.0
    });
    let chunk = vec![7; CHUNK];
    // The reader closes its socket at the end, and a write then fails.
    while client.write_all(&chunk).is_ok() {}
    Ok(reading.join().unwrap_or(0.0))
}
