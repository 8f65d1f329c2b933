//! Error numbers of the system on which the test runs. Programs compare the numbers by [`io::Error::raw_os_error`].

use std::io;

/// Error of a call, by the names of the system.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(not(feature = "facade"), allow(dead_code, reason = "some are of TCP or of Unix sockets alone"))]
pub(crate) enum Errno {
    /// `EPERM`.
    NotPermitted,
    /// `ENOENT`.
    NoEntry,
    /// `EAGAIN`.
    TryAgain,
    /// `EPIPE`.
    BrokenPipe,
    /// `EACCES`.
    PermissionDenied,
    /// `ENODEV`.
    NoDevice,
    /// `EINVAL`.
    InvalidInput,
    /// `EDESTADDRREQ`.
    NoDestination,
    /// `EMSGSIZE`.
    TooLong,
    /// `EPROTOTYPE`.
    WrongType,
    /// `ENOPROTOOPT`.
    NoSuchOption,
    /// `EOPNOTSUPP`.
    NotSupported,
    /// `EAFNOSUPPORT`.
    OtherVersion,
    /// `EADDRINUSE`.
    AddrInUse,
    /// `EADDRNOTAVAIL`.
    AddrNotAvailable,
    /// `ENETUNREACH`.
    NetworkUnreachable,
    /// `ECONNRESET`.
    ConnectionReset,
    /// `ENOTCONN`.
    NotConnected,
    /// `ETIMEDOUT`.
    TimedOut,
    /// `ECONNREFUSED`.
    ConnectionRefused,
    /// `EHOSTUNREACH`.
    HostUnreachable,
}

impl Errno {
    /// Returns the number.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    const fn number(self) -> i32 {
        match self {
            Self::NotPermitted => 1,
            Self::NoEntry => 2,
            Self::TryAgain => 11,
            Self::PermissionDenied => 13,
            Self::NoDevice => 19,
            Self::InvalidInput => 22,
            Self::BrokenPipe => 32,
            Self::NoDestination => 89,
            Self::TooLong => 90,
            Self::WrongType => 91,
            Self::NoSuchOption => 92,
            Self::NotSupported => 95,
            Self::OtherVersion => 97,
            Self::AddrInUse => 98,
            Self::AddrNotAvailable => 99,
            Self::NetworkUnreachable => 101,
            Self::ConnectionReset => 104,
            Self::NotConnected => 107,
            Self::TimedOut => 110,
            Self::ConnectionRefused => 111,
            Self::HostUnreachable => 113,
        }
    }

    /// Returns the number. macOS and the systems that descend from BSD have equal numbers.
    #[cfg(not(any(target_os = "linux", target_os = "android", windows)))]
    const fn number(self) -> i32 {
        match self {
            Self::NotPermitted => 1,
            Self::NoEntry => 2,
            Self::PermissionDenied => 13,
            Self::NoDevice => 19,
            Self::InvalidInput => 22,
            Self::BrokenPipe => 32,
            Self::TryAgain => 35,
            Self::NoDestination => 39,
            Self::TooLong => 40,
            Self::WrongType => 41,
            Self::NoSuchOption => 42,
            Self::NotSupported => 45,
            Self::OtherVersion => 47,
            Self::AddrInUse => 48,
            Self::AddrNotAvailable => 49,
            Self::NetworkUnreachable => 51,
            Self::ConnectionReset => 54,
            Self::NotConnected => 57,
            Self::TimedOut => 60,
            Self::ConnectionRefused => 61,
            Self::HostUnreachable => 65,
        }
    }

    /// Returns the number of Winsock. `ERROR_ACCESS_DENIED`, `ERROR_FILE_NOT_FOUND` and `ERROR_BROKEN_PIPE` are of the system, since Winsock has none of them.
    #[cfg(windows)]
    const fn number(self) -> i32 {
        match self {
            Self::NoEntry => 2,
            // Windows answers an unknown interface as an address that is not available.
            Self::NoDevice => 10_049,
            Self::NotPermitted => 5,
            Self::BrokenPipe => 109,
            Self::TryAgain => 10_035,
            Self::WrongType => 10_041,
            Self::PermissionDenied => 10_013,
            Self::InvalidInput => 10_022,
            Self::NoDestination => 10_039,
            Self::TooLong => 10_040,
            Self::NoSuchOption => 10_042,
            Self::NotSupported => 10_045,
            Self::OtherVersion => 10_047,
            Self::AddrInUse => 10_048,
            Self::AddrNotAvailable => 10_049,
            Self::NetworkUnreachable => 10_051,
            Self::ConnectionReset => 10_054,
            Self::NotConnected => 10_057,
            Self::TimedOut => 10_060,
            Self::ConnectionRefused => 10_061,
            Self::HostUnreachable => 10_065,
        }
    }

    /// Fails with this error. Such an error has no text of its own: the standard library keeps either a number or a text.
    #[cold]
    pub(crate) fn fail<T>(self) -> io::Result<T> {
        Err(self.into())
    }
}

impl From<Errno> for io::Error {
    fn from(errno: Errno) -> Self {
        Self::from_raw_os_error(errno.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard library knows the numbers of its system.
    #[test]
    fn numbers_have_the_kinds_of_the_standard_library() {
        for (errno, kind) in [
            (Errno::BrokenPipe, io::ErrorKind::BrokenPipe),
            (Errno::NotPermitted, io::ErrorKind::PermissionDenied),
            (Errno::NoEntry, io::ErrorKind::NotFound),
            (Errno::TryAgain, io::ErrorKind::WouldBlock),
            (Errno::PermissionDenied, io::ErrorKind::PermissionDenied),
            (Errno::InvalidInput, io::ErrorKind::InvalidInput),
            (Errno::AddrInUse, io::ErrorKind::AddrInUse),
            (Errno::AddrNotAvailable, io::ErrorKind::AddrNotAvailable),
            (Errno::NetworkUnreachable, io::ErrorKind::NetworkUnreachable),
            (Errno::ConnectionReset, io::ErrorKind::ConnectionReset),
            (Errno::NotConnected, io::ErrorKind::NotConnected),
            (Errno::TimedOut, io::ErrorKind::TimedOut),
            (Errno::ConnectionRefused, io::ErrorKind::ConnectionRefused),
            (Errno::HostUnreachable, io::ErrorKind::HostUnreachable),
        ] {
            assert_eq!(io::Error::from(errno).kind(), kind, "{errno:?}");
        }
    }
}
