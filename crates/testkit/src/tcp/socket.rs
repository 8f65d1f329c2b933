//! Virtual TCP socket that is not connected yet.

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cohaptic_wan::NodeId;

use super::{KIND, TcpConfig, TcpListener, TcpStream};
use crate::buffers::{LEAST_RECEIVE_BUFFER, LEAST_SEND_BUFFER, doubled};
use crate::context::Call;
use crate::core::{HoldId, Shared, Sharing, unmapped};
use crate::errno::Errno;

/// TCP socket that neither is connected nor listens, with the methods of tokio's `TcpSocket` in the same meaning.
///
/// The socket belongs to the host of the task that makes it. `from_std_stream` and the methods about network devices are missing. `SO_REUSEPORT` is stored
/// without effect: connections are not distributed to listeners of one port.
pub struct TcpSocket {
    shared: Arc<Shared>,
    host: NodeId,
    is_six: bool,
    settings: Mutex<Settings>,
}

#[derive(Clone, Debug)]
struct Settings {
    config: TcpConfig,
    bound: Option<(HoldId, SocketAddr)>,
    is_shared: bool,
    is_only_six: bool,
    is_port_shared: bool,
    linger: Option<Duration>,
    type_of_service: u32,
}

fn told(size: usize) -> u32 {
    u32::try_from(size).unwrap_or(u32::MAX)
}

impl TcpSocket {
    /// Creates a socket for IPv4 on the host of the running task.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NetworkDown`] if the host is down.
    ///
    /// # Panics
    ///
    /// Outside of a running test bed, and if the task lives on no host.
    #[track_caller]
    pub fn new_v4() -> io::Result<Self> {
        Self::new(Call::here("TcpSocket::new_v4"), false)
    }

    /// Creates a socket for IPv6 on the host of the running task.
    ///
    /// # Errors
    ///
    /// As [`TcpSocket::new_v4`].
    ///
    /// # Panics
    ///
    /// As [`TcpSocket::new_v4`].
    #[track_caller]
    pub fn new_v6() -> io::Result<Self> {
        Self::new(Call::here("TcpSocket::new_v6"), true)
    }

    #[track_caller]
    fn new(call: Call, is_six: bool) -> io::Result<Self> {
        let (shared, host) = call.host("wrap the call in `Host::scope`");
        Self::new_on(shared, host, is_six)
    }

    pub(crate) fn new_on(shared: Arc<Shared>, host: NodeId, is_six: bool) -> io::Result<Self> {
        let config = shared.with(|core| {
            core.check_up(host)?;
            io::Result::Ok(core.tcp_config(host).clone())
        })?;
        let settings =
            Settings { config, bound: None, is_shared: false, is_only_six: false, is_port_shared: false, linger: None, type_of_service: 0 };
        Ok(Self { shared, host, is_six, settings: Mutex::new(settings) })
    }

    /// Returns the constants of the connections of the socket, with the options that the program has set.
    #[cfg(feature = "facade")]
    pub(crate) fn config(&self) -> io::Result<TcpConfig> {
        self.shared.check_open(self.host, KIND)?;
        Ok(self.settings().config.clone())
    }

    /// Changes the constants of the connections of the socket.
    #[cfg(feature = "facade")]
    pub(crate) fn change_config(&self, change: impl FnOnce(&mut TcpConfig)) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)?;
        change(&mut self.settings().config);
        Ok(())
    }

    fn settings(&self) -> MutexGuard<'_, Settings> {
        self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Binds the socket. Port 0 stands for a free port.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AddrInUse`] if another socket has the port and not both sockets are [shared](TcpSocket::set_reuseaddr), or if another socket listens
    /// there; [`io::ErrorKind::AddrNotAvailable`] if the host does not have the address; [`io::ErrorKind::InvalidInput`] if the socket is bound already; the
    /// error of the system (`EAFNOSUPPORT`) if the address is of the other version of IP.
    pub fn bind(&self, address: SocketAddr) -> io::Result<()> {
        let mut settings = self.settings();
        if settings.bound.is_some() || address.is_ipv6() != self.is_six {
            return if settings.bound.is_some() { Errno::InvalidInput } else { Self::of_other_version(self.is_six) }.fail();
        }
        settings.bound = Some(self.hold_port(address, &settings)?);
        Ok(())
    }

    /// Returns the error of an address of the other version of IP. Linux finds an address of IPv4 too short for a socket of IPv6.
    const fn of_other_version(is_six: bool) -> Errno {
        if is_six { Errno::InvalidInput } else { Errno::OtherVersion }
    }

    fn hold_port(&self, address: SocketAddr, settings: &Settings) -> io::Result<(HoldId, SocketAddr)> {
        let sharing = Sharing { is_shared: settings.is_shared, is_only_six: settings.is_only_six };
        self.shared.open(self.host, KIND, |core| {
            core.check_up(self.host)?;
            core.hold_port(self.host, address, sharing)
        })?
    }

    /// Opens a connection, and waits until the connection is established.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::connect`]; the error of the system (`EAFNOSUPPORT`) if the address is of the other version of IP.
    pub async fn connect(self, address: SocketAddr) -> io::Result<TcpStream> {
        self.begin_to(address)?.established().await
    }

    /// Sends the SYN. Returns the stream before the connection is established.
    pub(super) fn begin_to(&self, address: SocketAddr) -> io::Result<TcpStream> {
        if address.is_ipv6() != self.is_six {
            return Self::of_other_version(self.is_six).fail();
        }
        // A mapped address such as `::ffff:10.0.0.1` is reached over IPv4, which `IPV6_V6ONLY` excludes.
        if self.settings().is_only_six && unmapped(address).is_ipv4() {
            return Errno::NetworkUnreachable.fail();
        }
        let mut settings = self.settings();
        let stream = TcpStream::connect_on(Arc::clone(&self.shared), self.host, settings.bound, address, settings.config.clone())?;
        // The port belongs to the connection now, so dropping the socket must not release it.
        settings.bound = None;
        stream.set_linger(settings.linger)?;
        Ok(stream)
    }

    /// Listens. As with Linux, `backlog` + 1 connections may wait to be accepted. A socket that is not bound gets a free port.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AddrInUse`] if another socket listens at the address.
    pub fn listen(self, backlog: u32) -> io::Result<TcpListener> {
        let mut settings = self.settings();
        // Taken out, so that dropping the socket does not release the port of the listener.
        let held = match settings.bound.take() {
            Some(held) => held,
            None => self.hold_port(self.any(), &settings)?,
        };
        let inherited = (settings.config.clone(), settings.linger);
        TcpListener::listen(Arc::clone(&self.shared), self.host, held, usize::try_from(backlog).unwrap_or(usize::MAX), inherited)
    }

    /// Returns the address of the bound socket, or the unspecified address with port 0 for a socket that is not bound.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.shared.check_open(self.host, KIND)?;
        Ok(self.settings().bound.map_or_else(|| self.any(), |(_, address)| address))
    }

    /// Returns the unspecified address with port 0.
    fn any(&self) -> SocketAddr {
        if self.is_six { SocketAddr::from(([0; 16], 0)) } else { SocketAddr::from(([0; 4], 0)) }
    }

    /// Returns the error of the socket: always `None`, because only a connection can have an error.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        self.shared.check_open(self.host, KIND)?;
        Ok(None)
    }
}

/// Getter and setter of a stored option.
macro_rules! option {
    ($get:ident, $set:ident, $kind:ty, $what:literal, |$settings:ident| $read:expr, |$to:ident, $value:ident| $write:expr) => {
        #[doc = $what]
        ///
        /// # Errors
        ///
        /// If the run has ended, or outside of the thread of the run.
        pub fn $get(&self) -> io::Result<$kind> {
            self.shared.check_open(self.host, KIND)?;
            let $settings = self.settings();
            Ok($read)
        }

        #[doc = concat!("Sets this: ", $what)]
        ///
        /// # Errors
        ///
        /// If the run has ended, or outside of the thread of the run.
        pub fn $set(&self, $value: $kind) -> io::Result<()> {
            self.shared.check_open(self.host, KIND)?;
            let $to = &mut *self.settings();
            $write;
            Ok(())
        }
    };
}

impl TcpSocket {
    option!(
        keepalive,
        set_keepalive,
        bool,
        "Whether an idle connection is probed, at the times of Linux.",
        |settings| settings.config.keepalive.is_some(),
        |to, on| to.config.keepalive = on.then(|| to.config.keepalive.unwrap_or_default())
    );
    option!(
        reuseaddr,
        set_reuseaddr,
        bool,
        "Whether the socket shares its port with other sockets that have this option (`SO_REUSEADDR`), also while connections linger.",
        |settings| settings.is_shared,
        |to, on| to.is_shared = on
    );
    option!(
        only_v6,
        set_only_v6,
        bool,
        "Whether a socket at `[::]` leaves IPv4 to other sockets (`IPV6_V6ONLY`). With tokio this option needs `socket2`. Set the option before the bind.",
        |settings| settings.is_only_six,
        |to, on| to.is_only_six = on
    );
    option!(
        reuseport,
        set_reuseport,
        bool,
        "Whether listeners share the port of the socket (`SO_REUSEPORT`). The option is stored and has no effect: a port has one listener.",
        |settings| settings.is_port_shared,
        |to, on| to.is_port_shared = on
    );
    option!(
        nodelay,
        set_nodelay,
        bool,
        "Whether small segments leave while earlier segments are not acknowledged.",
        |settings| settings.config.nodelay,
        |to, on| to.config.nodelay = on
    );
    option!(
        tos_v4,
        set_tos_v4,
        u32,
        "The type of service of IPv4, which is stored and has no effect.",
        |settings| settings.type_of_service,
        |to, tos| to.type_of_service = tos & 0xfc
    );
    option!(
        tclass_v6,
        set_tclass_v6,
        u32,
        "The traffic class of IPv6, which is stored and has no effect.",
        |settings| settings.type_of_service,
        |to, class| to.type_of_service = class & 0xfc
    );
    option!(
        send_buffer_size,
        set_send_buffer_size,
        u32,
        "The size of the send buffer \\[byte\\]: as with Linux, twice the set size.",
        |settings| told(settings.config.least_send_buffer),
        |to, size| {
            to.config.send_buffer = doubled(size, LEAST_SEND_BUFFER);
            to.config.least_send_buffer = doubled(size, LEAST_SEND_BUFFER);
        }
    );
    option!(
        recv_buffer_size,
        set_recv_buffer_size,
        u32,
        "The size of the receive buffer \\[byte\\]: as with Linux, twice the set size. A set size stays, and is the window. The default grows \
         as the program reads.",
        |settings| told(settings.config.receive_buffer.unwrap_or(settings.config.least_receive_buffer)),
        |to, size| to.config.receive_buffer = Some(doubled(size, LEAST_RECEIVE_BUFFER))
    );
    option!(
        linger,
        set_linger,
        Option<Duration>,
        "The time to linger when the stream is dropped: see [`TcpStream::set_linger`].",
        |settings| settings.linger,
        |to, linger| to.linger = linger.map(|linger| Duration::from_secs(linger.as_secs()))
    );

    /// Makes the connection be reset when the stream is dropped.
    ///
    /// # Errors
    ///
    /// As [`TcpSocket::set_linger`].
    pub fn set_zero_linger(&self) -> io::Result<()> {
        self.set_linger(Some(Duration::ZERO))
    }
}

impl Drop for TcpSocket {
    fn drop(&mut self) {
        let bound = self.settings().bound.take();
        if let Some((hold, _)) = bound {
            self.shared.release(move |core| core.release_port(hold));
        }
    }
}

impl fmt::Debug for TcpSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TcpSocket").field("settings", &*self.settings()).finish_non_exhaustive()
    }
}
