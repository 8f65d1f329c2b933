//! The test bed of the present thread for a package `tokio` that stands in for tokio: implements the traits of `cohaptic-sockets`.
//!
//! `cohaptic tokio` writes the package. Programs with tokio's sockets and tasks then run on a test bed unchanged: the package asks `cohaptic-sockets` for the
//! test bed of the thread, and `crate::runtime` registers the test bed of each run.

mod host;
mod settings;
mod unix;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_sockets::{
    Bed, ByteStream, Call, Clocks, Connecting, Datagrams, Hold, Host, Listener, Socket, Stream, UnixDatagrams, UnixSocket, UnixStream, Version,
};

use cohaptic_units::Instant;

use crate::context;
use crate::core::Shared;
use crate::current;
use crate::origin;
use crate::resolve::ToSocketAddrs;
use crate::socket::UdpSocket;
use crate::task::OtherTasks;
use crate::tcp::socket::TcpSocket;
use crate::tcp::{TcpListener, TcpStream};

/// Advice for a task without a host. The program uses the package in place of tokio, and the task was started outside of all hosts.
const HOW: &str = "wrap the call, or the task that `tokio::spawn` started on no host, in `Host::scope`";

/// A run in the form for `cohaptic-sockets`.
pub(crate) struct BedOfThread {
    pub(crate) shared: Arc<Shared>,
    pub(crate) others: Arc<OtherTasks>,
}

impl Bed for BedOfThread {
    fn look_up(&self, name: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
        (name, port).to_socket_addrs()
    }

    fn look_up_text(&self, text: &str) -> io::Result<Vec<SocketAddr>> {
        text.to_socket_addrs()
    }

    fn connect(&self, call: Call, to: SocketAddr) -> Connecting {
        let (shared, host) = context::Call::from(call).host(HOW);
        let config = shared.with(|core| core.tcp_config(host).clone());
        let begun = TcpStream::connect_on(shared, host, None, to, config);
        Box::pin(async move { Ok(Box::new(begun?.established().await?) as Box<dyn Stream>) })
    }

    fn listen(&self, call: Call, at: SocketAddr) -> io::Result<Box<dyn Listener>> {
        let (shared, host) = context::Call::from(call).host(HOW);
        Ok(Box::new(TcpListener::bind_on(shared, host, at)?))
    }

    fn socket(&self, call: Call, version: Version) -> io::Result<Box<dyn Socket>> {
        let (shared, host) = context::Call::from(call).host(HOW);
        Ok(Box::new(TcpSocket::new_on(shared, host, version == Version::Six)?))
    }

    fn bind(&self, call: Call, at: SocketAddr) -> io::Result<Box<dyn Datagrams>> {
        let (shared, host) = context::Call::from(call).host(HOW);
        Ok(Box::new(UdpSocket::bind_on(shared, host, at)?))
    }

    fn unix_socket(&self, call: Call) -> io::Result<Box<dyn UnixSocket>> {
        let (shared, host) = context::Call::from(call).host(HOW);
        let id = unix::open(&shared, host, |core| core.unix_stream(host))?;
        Ok(Box::new(unix::Stream::new(shared, host, id)))
    }

    fn unix_pair(&self, call: Call) -> io::Result<[Box<dyn UnixStream>; 2]> {
        let (shared, host) = context::Call::from(call).host(HOW);
        let ends = unix::open(&shared, host, |core| core.unix_pair(host))?;
        Ok(ends.map(|id| Box::new(unix::Stream::new(Arc::clone(&shared), host, id)) as _))
    }

    fn unix_datagrams(&self, call: Call) -> io::Result<Box<dyn UnixDatagrams>> {
        let (shared, host) = context::Call::from(call).host(HOW);
        let id = unix::open(&shared, host, |core| core.unix_datagrams(host))?;
        Ok(Box::new(unix::Datagrams::new(shared, host, id)))
    }

    fn unix_datagram_pair(&self, call: Call) -> io::Result<[Box<dyn UnixDatagrams>; 2]> {
        let (shared, host) = context::Call::from(call).host(HOW);
        let sockets = unix::open(&shared, host, |core| core.unix_datagram_pair(host))?;
        Ok(sockets.map(|id| Box::new(unix::Datagrams::new(Arc::clone(&shared), host, id)) as _))
    }

    fn pipe(&self, call: Call) -> io::Result<[Box<dyn ByteStream>; 2]> {
        let (shared, host) = context::Call::from(call).host(HOW);
        let ends = unix::open(&shared, host, |core| core.pipe(host))?;
        Ok(ends.map(|id| Box::new(unix::Stream::new(Arc::clone(&shared), host, id)) as _))
    }

    fn host(&self) -> Option<Arc<dyn Host>> {
        let host = current::host()?;
        Some(Arc::new(host::OfBed { host, shared: Arc::clone(&self.shared), others: Arc::clone(&self.others) }))
    }

    fn clocks(&self) -> Option<Clocks> {
        if !self.shared.standard.clocks {
            return None;
        }
        let passed = self.shared.any_now().saturating_duration_since(Instant::ZERO);
        Some(Clocks { monotonic: self.shared.origin() + passed, day: origin::DAY + passed })
    }

    fn random(&self, bytes: &mut [u8]) -> bool {
        // A state that answers now cannot be asked, and the program gets numbers of the system, as before the run.
        self.shared.standard.random && self.shared.try_with(|core| core.entropy(current::host()).fill(bytes)).is_some()
    }

    fn hold(&self) -> Box<dyn Hold> {
        Box::new(self.shared.hold())
    }
}
