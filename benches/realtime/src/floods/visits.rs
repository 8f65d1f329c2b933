//! The two sides of a flood over TCP: the many connections that make it, and the host's page, which is asked for meanwhile.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// The behaviour of a connection of a flood after its opening bytes.
#[derive(Clone, Debug)]
pub(crate) enum Then {
    /// Reads all answers, and sends nothing more.
    Listen,
    /// Reads nothing.
    Ignore,
    /// Sends these bytes again and again, as fast as the server takes them, and reads all answers.
    Repeat(Vec<u8>),
}

/// A flood: a number of connections at once, each of which is opened again when the server ends it.
#[derive(Clone, Debug)]
pub(crate) struct Flood {
    pub(crate) name: &'static str,
    pub(crate) connections: usize,
    pub(crate) opening: Vec<u8>,
    pub(crate) then: Then,
}

/// How much of a flood there was.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Offered {
    pub(crate) connections: u64,
    pub(crate) bytes: u64,
}

impl Flood {
    /// Goes on until it is told to stop.
    pub(crate) fn run(&self, address: SocketAddr, stop: &AtomicBool) -> Offered {
        let mut offered = Offered::default();
        let mut open: Vec<Option<TcpStream>> = (0..self.connections).map(|_| None).collect();
        while !stop.load(Ordering::Relaxed) {
            let before = offered;
            for place in &mut open {
                let stream = place.take().map_or_else(|| self.open(address, &mut offered), Ok);
                // A connection that the server ended is opened again in the next round.
                *place = stream.and_then(|mut stream| self.attend(&mut stream, &mut offered).map(|()| stream)).ok();
            }
            if (before.connections, before.bytes) == (offered.connections, offered.bytes) {
                sleep(Duration::from_millis(1));
            }
        }
        offered
    }

    fn open(&self, address: SocketAddr, offered: &mut Offered) -> io::Result<TcpStream> {
        let mut stream = TcpStream::connect_timeout(&address, Duration::from_secs(1))?;
        offered.connections += 1;
        stream.set_nonblocking(true)?;
        stream.write_all(&self.opening)?;
        offered.bytes += self.opening.len() as u64;
        Ok(stream)
    }

    /// Reads and writes as far as that needs no waiting; an error if the connection has ended.
    fn attend(&self, stream: &mut TcpStream, offered: &mut Offered) -> io::Result<()> {
        if let Then::Repeat(bytes) = &self.then {
            offered.bytes += now(stream.write(bytes))?.unwrap_or(0) as u64;
        }
        if matches!(self.then, Then::Ignore) {
            // Without reading, an ended connection is seen by its error alone.
            return stream.take_error()?.map_or(Ok(()), Err);
        }
        let mut buffer = [0; 1 << 14];
        match now(stream.read(&mut buffer))? {
            Some(0) => Err(ErrorKind::UnexpectedEof.into()),
            Some(_) | None => Ok(()),
        }
    }
}

/// `None` if there was nothing to do just now.
fn now(result: io::Result<usize>) -> io::Result<Option<usize>> {
    match result {
        Ok(count) => Ok(Some(count)),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
        Err(error) => Err(error),
    }
}

/// How long the host waited for its page.
#[derive(Clone, Debug, Default)]
pub(crate) struct Answers {
    /// Each time from the first connection to the last byte, in any order.
    pub(crate) waited: Vec<Duration>,
    /// Connections that were ended before the answer was whole; the page was asked for again.
    pub(crate) again: u64,
}

/// The host asks that often.
const EVERY: Duration = Duration::from_millis(20);
/// An answer that takes longer is one that does not come.
const PATIENCE: Duration = Duration::from_secs(10);

/// Asks for a page over and over again for that time, each time over a connection of its own.
pub(crate) fn ask(address: SocketAddr, request: &str, span: Duration) -> Answers {
    let mut answers = Answers::default();
    let end = Instant::now() + span;
    while Instant::now() < end {
        let begun = Instant::now();
        while once(address, request).is_err() && begun.elapsed() < PATIENCE {
            answers.again += 1;
        }
        answers.waited.push(begun.elapsed());
        sleep(EVERY.saturating_sub(begun.elapsed()));
    }
    answers
}

fn once(address: SocketAddr, request: &str) -> io::Result<()> {
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.write_all(request.as_bytes())?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    if answer.starts_with(b"HTTP/1.1 200 ") { Ok(()) } else { Err(ErrorKind::InvalidData.into()) }
}
