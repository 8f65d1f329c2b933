//! Output of piped commands, line by line, and the wake-ups of the watching thread.

use std::io::{self, BufRead as _, BufReader, PipeReader, PipeWriter, Read, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Scope};

use super::Plan;
use crate::host::{Failed, Host};

/// Line of a command's output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Line<'a> {
    /// Index of the host in [`Plan::hosts`].
    pub host: usize,
    /// Stream of the line.
    pub stream: Stream,
    /// Bytes of the line, without the line break.
    pub bytes: &'a [u8],
}

/// Stream of a command's output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stream {
    /// Standard output.
    Output,
    /// Standard error.
    Error,
}

/// Pipe of a stream of a host.
type Pipe = (usize, Stream, Box<dyn Read + Send>);

/// Outputs of all hosts.
pub(super) struct Outputs {
    /// Pipes still to be read, with host and stream.
    pipes: Mutex<Vec<Pipe>>,
    /// Texts to be searched for in the output, indexed by host.
    wanted: Vec<Option<Vec<u8>>>,
    /// `true` after the text of the host has come, indexed by host.
    ready: Vec<AtomicBool>,
    has_network_ended: AtomicBool,
    /// Pipe that becomes readable with each wake-up.
    woken: PipeReader,
    wakes: PipeWriter,
}

impl Outputs {
    pub(super) fn new(hosts: &mut [Host], plan: &Plan) -> io::Result<Self> {
        let (woken, wakes) = io::pipe()?;
        let mut pipes: Vec<Pipe> = Vec::new();
        for (place, host) in hosts.iter_mut().enumerate() {
            let (output, error) = host.output();
            pipes.extend(output.map(|pipe| (place, Stream::Output, Box::new(pipe) as _)));
            pipes.extend(error.map(|pipe| (place, Stream::Error, Box::new(pipe) as _)));
        }
        let wanted = plan.hosts.iter().map(|host| host.ready.as_ref().map(|text| text.clone().into_bytes())).collect();
        let ready = plan.hosts.iter().map(|_| AtomicBool::new(false)).collect();
        Ok(Self { pipes: Mutex::new(pipes), wanted, ready, has_network_ended: AtomicBool::new(false), woken, wakes })
    }

    /// Reads all outputs, each on a thread of its own, until their commands end.
    pub(super) fn read<'scope>(&'scope self, scope: &'scope Scope<'scope, '_>, hear: &'scope (dyn Fn(Line<'_>) + Sync)) -> Result<(), Failed> {
        let pipes = core::mem::take(&mut *self.pipes.lock().unwrap_or_else(PoisonError::into_inner));
        for (host, stream, pipe) in pipes {
            let reader = thread::Builder::new().name("output".to_owned()).spawn_scoped(scope, move || self.pass(host, stream, pipe, hear));
            reader.map_err(|error| Failed::own(format!("the system gives the output no thread: {error}")))?;
        }
        Ok(())
    }

    fn pass(&self, host: usize, stream: Stream, pipe: impl Read, hear: &(dyn Fn(Line<'_>) + Sync)) {
        let mut lines = BufReader::new(pipe);
        let mut line = Vec::new();
        // An error is the end too: nothing more can be read.
        while lines.read_until(b'\n', &mut line).is_ok_and(|count| count > 0) {
            let bytes = line.strip_suffix(b"\n").unwrap_or(&line);
            hear(Line { host, stream, bytes });
            let is_ready = self.wanted[host].as_ref().is_some_and(|text| bytes.windows(text.len().max(1)).any(|part| part == text));
            if is_ready && !self.ready[host].swap(true, Ordering::Relaxed) {
                self.wake();
            }
            line.clear();
        }
    }

    /// Wakes the watching thread.
    fn wake(&self) {
        let _ = (&self.wakes).write_all(b"w");
    }

    pub(super) fn is_ready(&self, host: usize) -> bool {
        self.ready[host].load(Ordering::Relaxed)
    }

    pub(super) fn network_has_ended(&self) {
        self.has_network_ended.store(true, Ordering::Relaxed);
        self.wake();
    }

    pub(super) fn has_network_ended(&self) -> bool {
        self.has_network_ended.load(Ordering::Relaxed)
    }

    pub(super) fn as_fd(&self) -> BorrowedFd<'_> {
        self.woken.as_fd()
    }

    /// Takes a wake-up from the pipe.
    pub(super) fn take_wake(&self) -> io::Result<()> {
        (&self.woken).read_exact(&mut [0])
    }
}
