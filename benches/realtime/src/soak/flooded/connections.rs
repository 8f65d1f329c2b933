//! A flood of TCP connections, as strangers make them: without a token, with no request, and such as say nothing.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a connection waits for its answer. A server that is full lets connections wait.
const PATIENCE: Duration = Duration::from_millis(500);

/// The number of connections that say nothing and are kept open; live control closes each after 10 s.
const SILENT: usize = 8;

/// The flood, on a thread of its own.
#[derive(Debug)]
pub(super) struct Connections {
    end: Arc<AtomicBool>,
    thread: JoinHandle<Connected>,
}

/// Counts of the flood of connections.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Connected {
    /// Connections that were made.
    pub made: u64,
    /// Connections that the server answered.
    pub answered: u64,
    /// Connections that the server let in without a token: none, or the server is open to anybody.
    pub let_in: u64,
    /// For how long.
    pub elapsed: Duration,
}

impl Connections {
    /// Begins to connect to `targets` in turn, one connection after another, at most `rate` a second.
    pub(super) fn start(targets: Vec<SocketAddr>, rate: u32) -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&end);
        let thread = std::thread::spawn(move || {
            let (begin, mut connected, mut silent) = (Instant::now(), Connected::default(), std::collections::VecDeque::new());
            let mut turn = targets.iter().cycle();
            while let (false, Some(target)) = (is_over.load(Ordering::Acquire), turn.next()) {
                connect(*target, &mut connected, &mut silent);
                std::thread::sleep(Duration::from_secs(1) / rate);
            }
            Connected { elapsed: begin.elapsed(), ..connected }
        });
        Self { end, thread }
    }

    pub(super) fn end(self) -> Result<Connected, String> {
        self.end.store(true, Ordering::Release);
        self.thread.join().map_err(|_| "the flood of connections panicked".to_owned())
    }
}

/// Opens a connection of one of the three kinds, in turn.
fn connect(target: SocketAddr, connected: &mut Connected, silent: &mut std::collections::VecDeque<TcpStream>) {
    let Ok(mut stream) = TcpStream::connect_timeout(&target, PATIENCE) else { return };
    connected.made += 1;
    let request = format!("GET /api/state HTTP/1.1\r\nHost: {target}\r\nConnection: close\r\n\r\n");
    // The targets come in turn, too: a step of three kinds for each round of targets would give each target one kind.
    let said = match connected.made / 2 % 3 {
        0 => request.as_bytes(),
        1 => &[0xff; 300][..],
        _ => {
            silent.push_back(stream);
            if silent.len() > SILENT {
                silent.pop_front();
            }
            return;
        }
    };
    let mut answer = [0; 256];
    let asked = stream.set_read_timeout(Some(PATIENCE)).and_then(|()| stream.write_all(said)).and_then(|()| stream.read(&mut answer));
    if let Ok(length @ 1..) = asked {
        connected.answered += 1;
        connected.let_in += u64::from(answer[..length].starts_with(b"HTTP/1.1 200"));
    }
}
