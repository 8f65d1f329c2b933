//! Unix sockets and pipes. In a test bed sockets and pipes live in memory, and each host has names of its own.

use std::io;
use std::os::unix::net::SocketAddr as StdAddr;
use std::path::Path;

use cohaptic_sockets::UnixName;

pub use real::net::unix::*;

mod datagrams;
mod halves;
mod listener;
pub mod pipe;
mod socket;
mod stream;

pub use halves::{OwnedReadHalf, OwnedWriteHalf, ReadHalf, ReuniteError, WriteHalf};
pub use {datagrams::UnixDatagram, listener::UnixListener, socket::UnixSocket, stream::UnixStream};

/// Returns the error of a conversion between descriptors and the Unix sockets and pipes of a test bed.
fn refused(what: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::Unsupported,
        format!(
            "`{what}` in a test bed: Unix sockets and pipes of a test bed live in memory and have no descriptors, so that none can be passed through them either. \
             Make both ends with the functions of `tokio::net`, and hand over what they are for in messages"
        ),
    )
}

/// Returns the test bed, and refuses a descriptor there.
fn refuse_in_bed(what: &str) -> io::Result<()> {
    if super::bed()?.is_some() { Err(refused(what)) } else { Ok(()) }
}

/// Implements the traits of descriptors for a type with one field of the type `Either`.
macro_rules! no_descriptors {
    ($name:ident) => {
        impl std::os::fd::AsRawFd for $name {
            #[track_caller]
            fn as_raw_fd(&self) -> std::os::fd::RawFd {
                use std::os::fd::AsFd;
                self.as_fd().as_raw_fd()
            }
        }

        impl std::os::fd::AsFd for $name {
            #[track_caller]
            fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_fd(),
                    $crate::net::Either::Bed(_) => panic!("{}", $crate::net::unix::refused(concat!(stringify!($name), "::as_fd"))),
                }
            }
        }

        // As with the types of tokio: the state is consistent after a panic.
        impl std::panic::UnwindSafe for $name {}
        impl std::panic::RefUnwindSafe for $name {}
    };
}
use no_descriptors;

/// Implements the conversion from a socket of the standard library.
macro_rules! try_from_std {
    ($name:ident) => {
        impl TryFrom<std::os::unix::net::$name> for $name {
            type Error = std::io::Error;

            fn try_from(socket: std::os::unix::net::$name) -> std::io::Result<Self> {
                Self::from_std(socket)
            }
        }
    };
}
use try_from_std;

/// Returns the name for a path. As with tokio, a path that begins with a zero is a name of the abstract namespace of Linux.
///
/// # Errors
///
/// The errors of the standard library: the path is too long, or a zero is within it.
fn name_of(path: &Path) -> io::Result<UnixName> {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    {
        use std::os::unix::ffi::OsStrExt;
        if let Some(name) = path.as_os_str().as_bytes().strip_prefix(b"\0") {
            #[cfg(target_os = "android")]
            use std::os::android::net::SocketAddrExt;
            #[cfg(target_os = "linux")]
            use std::os::linux::net::SocketAddrExt;
            return StdAddr::from_abstract_name(name).map(|address| name_at(&SocketAddr::cohaptic_of(address)));
        }
    }
    StdAddr::from_pathname(path).map(|address| name_at(&SocketAddr::cohaptic_of(address)))
}

/// Returns the name at an address.
fn name_at(address: &SocketAddr) -> UnixName {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    if let Some(name) = address.as_abstract_name() {
        return UnixName::Abstract(name.to_owned());
    }
    // An empty path is no name.
    match address.as_pathname().filter(|path| !path.as_os_str().is_empty()) {
        Some(path) => UnixName::Path(path.to_owned()),
        None => UnixName::Unnamed,
    }
}

/// Returns the address of a name.
fn address_of(name: &UnixName) -> io::Result<SocketAddr> {
    let address = match name {
        UnixName::Unnamed => StdAddr::from_pathname(""),
        UnixName::Path(path) => StdAddr::from_pathname(path),
        #[cfg(target_os = "linux")]
        UnixName::Abstract(name) => {
            use std::os::linux::net::SocketAddrExt;
            StdAddr::from_abstract_name(name)
        }
        #[cfg(target_os = "android")]
        UnixName::Abstract(name) => {
            use std::os::android::net::SocketAddrExt;
            StdAddr::from_abstract_name(name)
        }
        #[cfg(not(any(target_os = "linux", target_os = "android")))]
        UnixName::Abstract(_) => StdAddr::from_pathname(""),
    };
    address.map(SocketAddr::cohaptic_of)
}

/// Returns the credentials of this process. The process runs the programs of all hosts.
fn own_credentials() -> io::Result<UCred> {
    use std::os::unix::fs::MetadataExt;
    // A socket belongs to the user that made it.
    let socket = std::fs::File::from(std::os::fd::OwnedFd::from(std::os::unix::net::UnixDatagram::unbound()?)).metadata()?;
    Ok(UCred::cohaptic_of(pid_t::try_from(std::process::id()).ok(), socket.uid(), socket.gid()))
}
