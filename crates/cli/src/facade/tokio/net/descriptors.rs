//! Descriptors. A socket of a test bed has none.

use std::io;

/// Returns the error of a real socket that is to become one of a test bed, or the other way round.
pub(super) fn refused(what: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::Unsupported,
        format!(
            "`{what}` in a test bed: its sockets are no sockets of the system and have no descriptors. Make the socket with the functions of `tokio::net`"
        ),
    )
}

/// Refuses a real socket inside a test bed.
pub(super) fn refuse_real(what: &str) -> io::Result<()> {
    if super::bed()?.is_some() { Err(refused(what)) } else { Ok(()) }
}

/// Fails the test: there is no descriptor to return.
#[cold]
#[track_caller]
pub(super) fn none(what: &str) -> ! {
    panic!("{}", refused(what))
}

/// Implements the traits of descriptors for a type with one field of the type `Either`.
macro_rules! descriptors {
    ($kind:ident) => {
        #[cfg(unix)]
        impl std::os::fd::AsRawFd for $kind {
            #[track_caller]
            fn as_raw_fd(&self) -> std::os::fd::RawFd {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_raw_fd(),
                    $crate::net::Either::Bed(_) => $crate::net::descriptors::none(concat!(stringify!($kind), "::as_raw_fd")),
                }
            }
        }

        #[cfg(unix)]
        impl std::os::fd::AsFd for $kind {
            #[track_caller]
            fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_fd(),
                    $crate::net::Either::Bed(_) => $crate::net::descriptors::none(concat!(stringify!($kind), "::as_fd")),
                }
            }
        }

        #[cfg(windows)]
        impl std::os::windows::io::AsRawSocket for $kind {
            #[track_caller]
            fn as_raw_socket(&self) -> std::os::windows::io::RawSocket {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_raw_socket(),
                    $crate::net::Either::Bed(_) => $crate::net::descriptors::none(concat!(stringify!($kind), "::as_raw_socket")),
                }
            }
        }

        #[cfg(windows)]
        impl std::os::windows::io::AsSocket for $kind {
            #[track_caller]
            fn as_socket(&self) -> std::os::windows::io::BorrowedSocket<'_> {
                match &self.0 {
                    $crate::net::Either::Real(socket) => socket.as_socket(),
                    $crate::net::Either::Bed(_) => $crate::net::descriptors::none(concat!(stringify!($kind), "::as_socket")),
                }
            }
        }

        // As the types of tokio, whose state is consistent after a panic.
        impl std::panic::UnwindSafe for $kind {}
        impl std::panic::RefUnwindSafe for $kind {}
    };
}
pub(super) use descriptors;
