//! Descriptors. A socket of a test bed gives the descriptor of its placeholder: see `cohaptic-descriptors`.

use std::io;

use super::bed_socket::BedSocket;

/// Returns the error of a conversion between real sockets and sockets of a test bed.
pub(super) fn refused(what: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::Unsupported,
        format!(
            "`{what}` in a test bed: this socket belongs to the system, since it was bound or connected before the run, on another thread, or where \
             calls of the standard library are not caught. Make the socket with the functions of `tokio::net`, or give `TcpSocket::from_std_stream` a new socket and bind it afterwards"
        ),
    )
}

/// Refuses a real socket inside a test bed.
pub(super) fn refuse_real(what: &str) -> io::Result<()> {
    if super::bed()?.is_some() { Err(refused(what)) } else { Ok(()) }
}

/// Returns the socket of a test bed for which the socket `real` stands.
#[cfg(unix)]
#[track_caller]
pub(super) fn from_placeholder<T>(real: impl Into<std::os::fd::OwnedFd>, what: &str) -> io::Result<BedSocket<std::sync::Arc<T>>>
where
    T: cohaptic_descriptors::Kind + ?Sized,
{
    let (socket, placeholder) = cohaptic_descriptors::find(real.into())?.ok_or_else(|| refused(what))?;
    Ok(BedSocket::with(socket, placeholder))
}

#[cfg(not(unix))]
pub(super) fn from_placeholder<T: ?Sized>(_: impl Sized, what: &str) -> io::Result<BedSocket<std::sync::Arc<T>>> {
    Err(refused(what))
}

/// Returns the placeholder of a socket of a test bed, which keeps the socket until the placeholder comes back.
#[cfg(unix)]
pub(super) fn into_placeholder<P, S>(socket: BedSocket<P>, kind: socket2::Type, _: &str) -> io::Result<S>
where
    P: cohaptic_descriptors::Pointer,
    P::Target: cohaptic_sockets::Configured,
    S: From<std::os::fd::OwnedFd>,
{
    socket.into_descriptor(kind).map(S::from)
}

#[cfg(not(unix))]
pub(super) fn into_placeholder<B, S>(_: B, _: socket2::Type, what: &str) -> io::Result<S> {
    Err(refused(what))
}

/// Fails the test: the system gives no descriptor.
#[cold]
#[track_caller]
pub(super) fn none(what: &str, error: &io::Error) -> ! {
    panic!("`{what}` in a test bed: no placeholder can be made for the descriptor: {error}")
}

/// Implements the traits of descriptors for a type with one field of the type `Either`. `$type` is the type of a placeholder.
macro_rules! descriptors {
    ($kind:ident, $type:ident) => {
        #[cfg(unix)]
        impl std::os::fd::AsRawFd for $kind {
            #[track_caller]
            fn as_raw_fd(&self) -> std::os::fd::RawFd {
                use std::os::fd::AsFd;
                self.as_fd().as_raw_fd()
            }
        }

        #[cfg(unix)]
        impl std::os::fd::AsFd for $kind {
            #[track_caller]
            fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_fd(),
                    $crate::net::Either::Bed(socket) => match socket.descriptor(socket2::Type::$type) {
                        Ok(descriptor) => descriptor,
                        Err(error) => $crate::net::descriptors::none(concat!(stringify!($kind), "::as_fd"), &error),
                    },
                }
            }
        }

        #[cfg(windows)]
        impl std::os::windows::io::AsRawSocket for $kind {
            #[track_caller]
            fn as_raw_socket(&self) -> std::os::windows::io::RawSocket {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_raw_socket(),
                    $crate::net::Either::Bed(_) => {
                        let what = concat!(stringify!($kind), "::as_raw_socket");
                        $crate::net::descriptors::none(what, &$crate::net::descriptors::refused(what))
                    }
                }
            }
        }

        #[cfg(windows)]
        impl std::os::windows::io::AsSocket for $kind {
            #[track_caller]
            fn as_socket(&self) -> std::os::windows::io::BorrowedSocket<'_> {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_socket(),
                    $crate::net::Either::Bed(_) => {
                        let what = concat!(stringify!($kind), "::as_socket");
                        $crate::net::descriptors::none(what, &$crate::net::descriptors::refused(what))
                    }
                }
            }
        }

        // As with the types of tokio: the state is consistent after a panic.
        impl std::panic::UnwindSafe for $kind {}
        impl std::panic::RefUnwindSafe for $kind {}
    };
}
pub(super) use descriptors;
