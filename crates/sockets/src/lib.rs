//! Sockets and tasks of a test bed, as traits, and the test bed of the present thread.
//!
//! Use this crate if you write a package that stands in for a runtime or for sockets, and the package should use the sockets of the test kit wherever a test
//! bed runs.
//!
//! A package `tokio` made by `cohaptic tokio` stands in for tokio in existing programs. Each socket of the package holds a real socket, or a socket of the
//! running test bed of the thread. The package asks [`bed`] whether a test bed runs. The test kit implements the traits of this crate with its own sockets, and
//! registers each running test bed with [`enter`].
//!
//! The crate depends on nothing, so that the test kit and the package `tokio` can both depend on it without a cycle: the test kit itself is compiled against
//! the package `tokio`.
//!
//! ```
//! // Outside of a test bed sockets are real, and tasks live on no host.
//! assert!(cohaptic_sockets::bed().is_none());
//! assert!(cohaptic_sockets::host().is_none());
//! ```

mod datagrams;
mod outside;
mod settings;
mod streams;
mod tasks;
mod unix;

use std::cell::{Cell, RefCell};
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::panic::Location;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use datagrams::{DatagramOption, Datagrams, Interface, Membership, Received, Sending};
pub use outside::{Outside, catches_calls, outside};
pub use settings::{Configured, KeepaliveTimes, Setting};
pub use streams::{ByteStream, Connecting, Flag, Listener, Number, Ready, Socket, Stream};
pub use tasks::{Hold, Host, OnHost, Signals, Stop, host, on_host};
pub use unix::{UnixDatagrams, UnixListener, UnixName, UnixSocket, UnixStream};

thread_local! {
    /// `true` while a test bed runs on this thread. Beside `BED`, because a value that needs no drop is read without registering a destructor, which takes memory:
    /// layer C asks within every call of the system, on every thread.
    static IS_IN_BED: Cell<bool> = const { Cell::new(false) };
    static BED: RefCell<Option<Arc<dyn Bed>>> = const { RefCell::new(None) };
    /// Seed of the runtime of tokio that the test kit builds next on this thread.
    static RUNTIME_SEED: Cell<Option<u64>> = const { Cell::new(None) };
}

/// Sets the seed of the next runtime of tokio on this thread. The seed decides with which branch `tokio::select!` begins.
pub fn seed_next_runtime(seed: u64) {
    RUNTIME_SEED.set(Some(seed));
}

/// Returns the seed of [`seed_next_runtime`], and forgets the seed.
#[must_use]
pub fn take_runtime_seed() -> Option<u64> {
    RUNTIME_SEED.take()
}

/// Call of a program for a socket or for the addresses of a name, for messages.
#[derive(Clone, Copy, Debug)]
pub struct Call {
    /// Name of the function, such as `TcpStream::connect`.
    pub name: &'static str,
    /// Place of the call in the program; `None` for a call of the system, whose caller is not known.
    pub place: Option<&'static Location<'static>>,
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(place) => write!(f, "`{}` at {place}", self.name),
            None => write!(f, "the call `{}` of the system", self.name),
        }
    }
}

impl Call {
    /// Describes the call `name` at the place of the caller.
    #[track_caller]
    #[must_use]
    pub fn here(name: &'static str) -> Self {
        Self { name, place: Some(Location::caller()) }
    }

    /// Describes the call `name` of the system.
    #[must_use]
    pub const fn of_system(name: &'static str) -> Self {
        Self { name, place: None }
    }
}

/// Readings of the clocks of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clocks {
    /// Reading of the monotonic clock.
    pub monotonic: Instant,
    /// Time of day, as time since the beginning of 1970.
    pub day: Duration,
}

/// Version of IP.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Version {
    /// IPv4.
    Four,
    /// IPv6.
    Six,
}

/// A running test bed.
///
/// New sockets belong to the host of the polled task. A method for a new socket panics if the polled task lives on no host: a program that tries again would
/// swallow an error.
pub trait Bed: Send + Sync {
    /// Returns the addresses of `name`, a host's name or a literal address without port.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotFound`] if no host has that name.
    fn look_up(&self, name: &str, port: u16) -> io::Result<Vec<SocketAddr>>;

    /// Returns the addresses that `text` describes, such as `server:80`.
    ///
    /// # Errors
    ///
    /// As [`Bed::look_up`]; [`io::ErrorKind::InvalidInput`] if the text is no address with a port.
    fn look_up_text(&self, text: &str) -> io::Result<Vec<SocketAddr>>;

    /// Opens a TCP connection. The returned future waits until the connection is established.
    ///
    /// # Panics
    ///
    /// If the running task lives on no host.
    fn connect(&self, call: Call, to: SocketAddr) -> Connecting;

    /// Listens for TCP connections.
    ///
    /// # Errors
    ///
    /// If the address is taken, or is no address of the host.
    ///
    /// # Panics
    ///
    /// If the running task lives on no host.
    fn listen(&self, call: Call, at: SocketAddr) -> io::Result<Box<dyn Listener>>;

    /// Creates a TCP socket that is neither connected nor listening.
    ///
    /// # Errors
    ///
    /// If the host is down.
    ///
    /// # Panics
    ///
    /// If the running task lives on no host.
    fn socket(&self, call: Call, version: Version) -> io::Result<Box<dyn Socket>>;

    /// Binds a UDP socket.
    ///
    /// # Errors
    ///
    /// If the address is taken, or is no address of the host.
    ///
    /// # Panics
    ///
    /// If the running task lives on no host.
    fn bind(&self, call: Call, at: SocketAddr) -> io::Result<Box<dyn Datagrams>>;

    /// Creates a Unix socket of streams that is neither connected nor listening.
    ///
    /// # Errors
    ///
    /// If the host is down.
    ///
    /// # Panics
    ///
    /// If the running task lives on no host.
    fn unix_socket(&self, call: Call) -> io::Result<Box<dyn UnixSocket>>;

    /// Creates two connected Unix sockets of streams. Errors and panics as in [`Bed::unix_socket`].
    #[expect(clippy::missing_errors_doc, reason = "the errors of another method")]
    fn unix_pair(&self, call: Call) -> io::Result<[Box<dyn UnixStream>; 2]>;

    /// Creates a Unix socket of datagrams that is neither bound nor connected. Errors and panics as in [`Bed::unix_socket`].
    #[expect(clippy::missing_errors_doc, reason = "the errors of another method")]
    fn unix_datagrams(&self, call: Call) -> io::Result<Box<dyn UnixDatagrams>>;

    /// Creates two connected Unix sockets of datagrams. Errors and panics as in [`Bed::unix_socket`].
    #[expect(clippy::missing_errors_doc, reason = "the errors of another method")]
    fn unix_datagram_pair(&self, call: Call) -> io::Result<[Box<dyn UnixDatagrams>; 2]>;

    /// Creates a pipe: the writing end, and the reading end. Errors and panics as in [`Bed::unix_socket`].
    #[expect(clippy::missing_errors_doc, reason = "the errors of another method")]
    fn pipe(&self, call: Call) -> io::Result<[Box<dyn ByteStream>; 2]>;

    /// Returns the host of the polled task, or `None` for a task without a host.
    fn host(&self) -> Option<Arc<dyn Host>>;

    /// Returns the clocks of the standard library in this run, or `None` if the standard library reads the clocks of the system.
    fn clocks(&self) -> Option<Clocks>;

    /// Fills `bytes` with random numbers from the seed. Returns `false` if random numbers come from the system.
    fn random(&self, bytes: &mut [u8]) -> bool;

    /// Holds the virtual time until the value is dropped, for work on another thread. Such work takes no virtual time.
    fn hold(&self) -> Box<dyn Hold>;
}

impl fmt::Debug for dyn Bed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bed").finish_non_exhaustive()
    }
}

/// Guard: a test bed runs on this thread until the guard is dropped.
#[derive(Debug)]
#[must_use = "the test bed is left when the guard is dropped"]
pub struct Entered {
    before: Option<Arc<dyn Bed>>,
}

/// Declares that `bed` runs on this thread until the returned guard is dropped.
pub fn enter(bed: Arc<dyn Bed>) -> Entered {
    // Guards nest: the test bed that ran here before is in force again when the guard is dropped.
    let before = BED.with_borrow_mut(|here| here.replace(bed));
    IS_IN_BED.set(true);
    Entered { before }
}

impl Drop for Entered {
    fn drop(&mut self) {
        let before = self.before.take();
        IS_IN_BED.set(before.is_some());
        // The value is dropped after the borrow has ended, because destructors of a test bed may ask for the test bed.
        let left = BED.try_with(|bed| bed.replace(before));
        drop(left);
    }
}

/// Returns the running test bed of this thread, or `None` without a test bed or while the thread ends.
#[must_use]
pub fn bed() -> Option<Arc<dyn Bed>> {
    // `try_with` fails only while an ending thread destroys its locals. No test bed runs on that thread any more.
    BED.try_with(|bed| bed.borrow().clone()).ok().flatten()
}

/// Returns whether a test bed runs on this thread.
#[must_use]
pub fn is_in_bed() -> bool {
    IS_IN_BED.get()
}
