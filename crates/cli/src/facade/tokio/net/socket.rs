//! TCP sockets that are neither connected nor listening.

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_sockets::{Call, Flag, Number, Socket, Version};

use super::bed_socket::BedSocket;
use super::descriptors::{descriptors, into_placeholder, refuse_real};
use super::{Either, TcpListener, TcpStream, either};

/// See `tokio::net::TcpSocket`.
pub struct TcpSocket(Either<real::net::TcpSocket, BedSocket<Box<dyn Socket>>>);

/// Getters and setters of options.
macro_rules! options {
    ($($(#[$condition:meta])* $get:ident, $set:ident: $kind:ty = |$socket:ident| $read:expr, |$value:ident| $write:expr;)*) => {
        $(
            $(#[$condition])*
            #[doc = concat!("See `tokio::net::TcpSocket::", stringify!($get), "`.")]
            pub fn $get(&self) -> io::Result<$kind> {
                either!(&self.0, |$socket| $socket.$get(), $read)
            }

            $(#[$condition])*
            #[doc = concat!("See `tokio::net::TcpSocket::", stringify!($set), "`.")]
            pub fn $set(&self, $value: $kind) -> io::Result<()> {
                either!(&self.0, |$socket| $socket.$set($value), $write)
            }
        )*
    };
}

impl TcpSocket {
    /// See `tokio::net::TcpSocket::new_v4`.
    #[track_caller]
    pub fn new_v4() -> io::Result<Self> {
        match super::bed()? {
            Some(bed) => bed.socket(Call::here("TcpSocket::new_v4"), Version::Four).map(|socket| Self(Either::Bed(socket.into()))),
            None => real::net::TcpSocket::new_v4().map(|real| Self(Either::Real(real))),
        }
    }

    /// See `tokio::net::TcpSocket::new_v6`.
    #[track_caller]
    pub fn new_v6() -> io::Result<Self> {
        match super::bed()? {
            Some(bed) => bed.socket(Call::here("TcpSocket::new_v6"), Version::Six).map(|socket| Self(Either::Bed(socket.into()))),
            None => real::net::TcpSocket::new_v6().map(|real| Self(Either::Real(real))),
        }
    }

    options! {
        keepalive, set_keepalive: bool = |socket| socket.flag(Flag::KeepAlive), |on| socket.set_flag(Flag::KeepAlive, on);
        reuseaddr, set_reuseaddr: bool = |socket| socket.flag(Flag::ReuseAddress), |on| socket.set_flag(Flag::ReuseAddress, on);
        #[cfg(all(unix, not(any(target_os = "solaris", target_os = "illumos", target_os = "cygwin"))))]
        reuseport, set_reuseport: bool = |socket| socket.flag(Flag::ReusePort), |on| socket.set_flag(Flag::ReusePort, on);
        nodelay, set_nodelay: bool = |socket| socket.flag(Flag::NoDelay), |on| socket.set_flag(Flag::NoDelay, on);
        send_buffer_size, set_send_buffer_size: u32 = |socket| socket.number(Number::SendBuffer), |size| socket.set_number(Number::SendBuffer, size);
        recv_buffer_size, set_recv_buffer_size: u32 = |socket| socket.number(Number::ReceiveBuffer), |size| socket.set_number(Number::ReceiveBuffer, size);
    }

    //@ has net/tcp/socket.rs|pub fn tos_v4
    options! {
        #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
        tos_v4, set_tos_v4: u32 = |socket| socket.number(Number::TypeOfService), |tos| socket.set_number(Number::TypeOfService, tos);
        #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
        tclass_v6, set_tclass_v6: u32 = |socket| socket.number(Number::TypeOfService), |class| socket.set_number(Number::TypeOfService, class);
    }

    /// See `tokio::net::TcpSocket::tos`.
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
    #[deprecated(note = "use `tos_v4`")]
    #[allow(deprecated, reason = "the method of tokio is deprecated as well")]
    pub fn tos(&self) -> io::Result<u32> {
        either!(&self.0, |socket| socket.tos(), socket.number(Number::TypeOfService))
    }

    /// See `tokio::net::TcpSocket::set_tos`.
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "ios", target_os = "freebsd", windows))]
    #[deprecated(note = "use `set_tos_v4`")]
    #[allow(deprecated, reason = "the method of tokio is deprecated as well")]
    pub fn set_tos(&self, tos: u32) -> io::Result<()> {
        either!(&self.0, |socket| socket.set_tos(tos), socket.set_number(Number::TypeOfService, tos))
    }

    /// See `tokio::net::TcpSocket::linger`.
    pub fn linger(&self) -> io::Result<Option<Duration>> {
        either!(&self.0, |socket| socket.linger())
    }

    /// See `tokio::net::TcpSocket::set_linger`.
    #[allow(deprecated, reason = "newer versions of tokio deprecate the method")]
    pub fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        either!(&self.0, |socket| socket.set_linger(linger))
    }

    /// See `tokio::net::TcpSocket::set_zero_linger`.
    #[allow(deprecated, reason = "newer versions of tokio deprecate `set_linger`")]
    pub fn set_zero_linger(&self) -> io::Result<()> {
        either!(&self.0, |socket| socket.set_linger(Some(Duration::ZERO)))
    }

    /// See `tokio::net::TcpSocket::device`.
    #[cfg(any(target_os = "android", target_os = "fuchsia", target_os = "linux"))]
    pub fn device(&self) -> io::Result<Option<Vec<u8>>> {
        either!(&self.0, |socket| socket.device(), socket.local_addr().map(|_| None))
    }

    /// See `tokio::net::TcpSocket::bind_device`. A test bed has no devices.
    #[cfg(any(target_os = "android", target_os = "fuchsia", target_os = "linux"))]
    pub fn bind_device(&self, interface: Option<&[u8]>) -> io::Result<()> {
        match &self.0 {
            Either::Real(socket) => socket.bind_device(interface),
            Either::Bed(_) => Err(crate::net::no_devices()),
        }
    }

    /// See `tokio::net::TcpSocket::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.local_addr())
    }

    /// See `tokio::net::TcpSocket::take_error`.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        // Only a connection of a test bed can have an error.
        either!(&self.0, |socket| socket.take_error(), socket.local_addr().map(|_| None))
    }

    /// See `tokio::net::TcpSocket::bind`.
    pub fn bind(&self, address: SocketAddr) -> io::Result<()> {
        either!(&self.0, |socket| socket.bind(address))
    }

    /// See `tokio::net::TcpSocket::connect`.
    pub async fn connect(self, address: SocketAddr) -> io::Result<TcpStream> {
        match self.0 {
            Either::Real(socket) => {
                // A socket that `from_std_stream` has left real would connect over the network of the system.
                refuse_real("TcpSocket::from_std_stream")?;
                socket.connect(address).await.map(|stream| TcpStream(Either::Real(stream)))
            }
            Either::Bed(socket) => socket.into_inner().connect(address).await.map(|stream| TcpStream(Either::Bed(stream.into()))),
        }
    }

    /// See `tokio::net::TcpSocket::listen`.
    #[track_caller]
    pub fn listen(self, backlog: u32) -> io::Result<TcpListener> {
        match self.0 {
            Either::Real(socket) => {
                refuse_real("TcpSocket::from_std_stream")?;
                socket.listen(backlog).map(|listener| TcpListener(Either::Real(listener)))
            }
            Either::Bed(socket) => socket.into_inner().listen(backlog).map(|listener| TcpListener(Either::Bed(listener.into()))),
        }
    }

    /// See `tokio::net::TcpSocket::from_std_stream`. In a test bed a new socket becomes a socket of the test bed, with the same options. A bound or connected
    /// socket stays real, and neither connects nor listens.
    #[track_caller]
    pub fn from_std_stream(stream: std::net::TcpStream) -> Self {
        #[cfg(unix)]
        if let Some(socket) = Self::of_bed(&stream) {
            return Self(Either::Bed(socket.into()));
        }
        Self(Either::Real(real::net::TcpSocket::from_std_stream(stream)))
    }

    /// Returns the socket of the test bed for which a real socket stands.
    #[cfg(unix)]
    #[track_caller]
    fn of_bed(stream: &std::net::TcpStream) -> Option<Box<dyn Socket>> {
        use std::os::fd::AsFd;
        let (bed, fd) = (super::bed().ok()??, stream.as_fd());
        // A placeholder comes back to its own socket. Any other unbound socket becomes a new socket of the test bed.
        if let Some(socket) = cohaptic_descriptors::take(fd).ok()? {
            return Some(socket);
        }
        let socket = bed.socket(Call::here("TcpSocket::from_std_stream"), cohaptic_descriptors::unbound(fd)?).ok()?;
        cohaptic_descriptors::set_all(socket2::Type::STREAM, &*socket, fd).ok()?;
        Some(socket)
    }
}

impl fmt::Debug for TcpSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

descriptors!(TcpSocket, STREAM);

#[cfg(unix)]
impl std::os::fd::FromRawFd for TcpSocket {
    /// See `tokio::net::TcpSocket::from_raw_fd`.
    unsafe fn from_raw_fd(fd: std::os::fd::RawFd) -> Self {
        // SAFETY: the caller keeps the promises that this function asks for as well.
        let stream = unsafe { std::net::TcpStream::from_raw_fd(fd) };
        Self::from_std_stream(stream)
    }
}

#[cfg(unix)]
impl std::os::fd::IntoRawFd for TcpSocket {
    #[track_caller]
    fn into_raw_fd(self) -> std::os::fd::RawFd {
        match self.0 {
            Either::Real(socket) => socket.into_raw_fd(),
            Either::Bed(socket) => {
                let what = "TcpSocket::into_raw_fd";
                match into_placeholder::<_, std::net::TcpStream>(socket, socket2::Type::STREAM, what) {
                    Ok(stream) => stream.into_raw_fd(),
                    Err(error) => super::descriptors::none(what, &error),
                }
            }
        }
    }
}

#[cfg(windows)]
impl std::os::windows::io::FromRawSocket for TcpSocket {
    /// See `tokio::net::TcpSocket::from_raw_socket`.
    unsafe fn from_raw_socket(socket: std::os::windows::io::RawSocket) -> Self {
        // SAFETY: the caller keeps the promises that the real function asks for.
        Self(Either::Real(unsafe { real::net::TcpSocket::from_raw_socket(socket) }))
    }
}

#[cfg(windows)]
impl std::os::windows::io::IntoRawSocket for TcpSocket {
    #[track_caller]
    fn into_raw_socket(self) -> std::os::windows::io::RawSocket {
        match self.0 {
            Either::Real(socket) => socket.into_raw_socket(),
            Either::Bed(_) => panic!("{}", super::descriptors::refused("TcpSocket::into_raw_socket")),
        }
    }
}
