//! Descriptions of socket addresses.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};

use crate::address::Addresses;
use crate::context;
use crate::current;

/// Description of socket addresses, in the forms of tokio's trait of this name: addresses, or the name of a host of the running test bed or a literal address,
/// with a port.
///
/// A name stands for both addresses of the host, that of IPv4 first unless [`Testbed::ipv6_first`](crate::Testbed::ipv6_first) says otherwise. The name
/// `localhost` stands for `::1` and 127.0.0.1, as with Linux. Upper and lower case are the same, and a final dot is ignored (RFC 4343). `"[server]:80"` is the
/// IPv6 address of the host alone.
///
/// Functions that bind or connect try each address in turn, and fail with the error of the last one. Functions that send take the first address.
pub trait ToSocketAddrs {
    /// Returns the socket addresses, of which there may be none.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::InvalidInput`] if the text is no address, [`io::ErrorKind::NotFound`] if no host has the name, or no test bed is running.
    fn to_socket_addrs(&self) -> io::Result<Vec<SocketAddr>>;

    /// Returns the first socket address.
    ///
    /// # Errors
    ///
    /// As [`ToSocketAddrs::to_socket_addrs`]; [`io::ErrorKind::InvalidInput`] if there is no address.
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        self.to_socket_addrs()?.first().copied().ok_or_else(none)
    }

    /// Returns the socket address if `self` is a socket address, and `None` for every other description. Sending a datagram then needs no copy of the address.
    fn as_socket_addr(&self) -> Option<&SocketAddr> {
        None
    }
}

/// Returns the error of a description without addresses, as tokio returns it.
pub(crate) fn none() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "could not resolve to any address")
}

/// Tries each of the addresses in turn. Returns the first success, or the last error.
pub(crate) fn each<T>(addresses: impl ToSocketAddrs, mut attempt: impl FnMut(SocketAddr) -> io::Result<T>) -> io::Result<T> {
    let mut failed = none();
    for address in addresses.to_socket_addrs()? {
        match attempt(address) {
            Ok(value) => return Ok(value),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

/// Implements the trait for types of a single address.
macro_rules! one_address {
    ($($kind:ty $(: $own:expr)?),*) => {
        $(
            impl ToSocketAddrs for $kind {
                fn to_socket_addrs(&self) -> io::Result<Vec<SocketAddr>> {
                    Ok(vec![(*self).into()])
                }

                #[inline]
                fn to_socket_addr(&self) -> io::Result<SocketAddr> {
                    Ok((*self).into())
                }

                $(
                    #[inline]
                    fn as_socket_addr(&self) -> Option<&SocketAddr> {
                        $own(self)
                    }
                )?
            }
        )*
    };
}

one_address!(SocketAddr: Some, SocketAddrV4, SocketAddrV6, (IpAddr, u16), (Ipv4Addr, u16), (Ipv6Addr, u16));

impl ToSocketAddrs for [SocketAddr] {
    fn to_socket_addrs(&self) -> io::Result<Vec<SocketAddr>> {
        Ok(self.to_vec())
    }
}

/// Addresses of a text. An array, because a program may send each datagram to a text.
enum Found {
    One(SocketAddr),
    Two([SocketAddr; 2]),
}

impl Found {
    fn all(self) -> Vec<SocketAddr> {
        match self {
            Self::One(address) => vec![address],
            Self::Two(addresses) => addresses.to_vec(),
        }
    }

    const fn first(self) -> SocketAddr {
        match self {
            Self::One(address) | Self::Two([address, _]) => address,
        }
    }
}

/// Returns the addresses of a name, or of a literal address.
fn of_name(name: &str, port: u16) -> io::Result<Found> {
    of_name_by(name, port, look_up)
}

/// Like [`of_name`], with another function that looks up the addresses of a host, and whether the address of IPv6 comes first.
fn of_name_by(name: &str, port: u16, look_up: impl FnOnce(&str) -> io::Result<(Addresses, bool)>) -> io::Result<Found> {
    if let Ok(address) = name.parse::<IpAddr>() {
        return Ok(Found::One((address, port).into()));
    }
    if name.strip_suffix('.').unwrap_or(name).eq_ignore_ascii_case("localhost") {
        return Ok(Found::Two([(Ipv6Addr::LOCALHOST, port).into(), (Ipv4Addr::LOCALHOST, port).into()]));
    }
    let (Addresses { v4, v6 }, six_first) = look_up(name)?;
    let mut both = [(v4, port).into(), (v6, port).into()];
    if six_first {
        both.reverse();
    }
    Ok(Found::Two(both))
}

fn of_text(text: &str) -> io::Result<Found> {
    if let Ok(address) = text.parse() {
        return Ok(Found::One(address));
    }
    let wrong = || {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("`{text}` is not an address: expected an address such as `10.0.0.1:80`, `[fd00::1]:80` or `server:80`"),
        )
    };
    // The last colon precedes the port. An address of IPv6 in brackets contains further colons.
    let (name, port) = text.rsplit_once(':').ok_or_else(wrong)?;
    let port = port.parse().map_err(|_| wrong())?;
    match name.strip_prefix('[').and_then(|name| name.strip_suffix(']')) {
        Some(name) => Ok(Found::One((look_up(name)?.0.v6, port).into())),
        None => of_name(name, port),
    }
}

/// Implements the trait for texts.
macro_rules! text {
    ($($kind:ty: |$value:ident| $found:expr;)*) => {
        $(
            impl ToSocketAddrs for $kind {
                fn to_socket_addrs(&self) -> io::Result<Vec<SocketAddr>> {
                    let $value = self;
                    $found.map(Found::all)
                }

                fn to_socket_addr(&self) -> io::Result<SocketAddr> {
                    let $value = self;
                    $found.map(Found::first)
                }
            }
        )*
    };
}

text! {
    str: |text| of_text(text);
    String: |text| of_text(text);
    (&str, u16): |pair| of_name(pair.0, pair.1);
    (String, u16): |pair| of_name(&pair.0, pair.1);
}

impl<T: ToSocketAddrs + ?Sized> ToSocketAddrs for &T {
    fn to_socket_addrs(&self) -> io::Result<Vec<SocketAddr>> {
        (**self).to_socket_addrs()
    }

    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        (**self).to_socket_addr()
    }

    #[inline]
    fn as_socket_addr(&self) -> Option<&SocketAddr> {
        (**self).as_socket_addr()
    }
}

/// Returns the addresses of a host, and whether the address of IPv6 comes first.
fn look_up(name: &str) -> io::Result<(Addresses, bool)> {
    let shared = context::shared().ok_or_else(|| context::outside(&format!("the name `{name}` of a host means something")))?;
    let found = shared.with(|core| {
        let host = shared.names().find(name)?;
        // A program of no host sees the whole network, as the test does.
        let hidden = current::host().and_then(|asking| core.hides(asking, host));
        Some(hidden.map_or_else(|| Ok((core.plan.of(host), core.settings.six_first)), Err))
    });
    found
        .map_or_else(
            || Err(shared.names().unknown(name)),
            |found| {
                found.map_err(|nat| {
                    format!(
                        "there is no host `{name}` here: the host is behind the NAT `{}`, and only hosts behind that NAT know its name",
                        shared.names()[nat.index()]
                    )
                })
            },
        )
        .map_err(|text| {
            // A program that looks up a wrong name again and again lets no time pass, so the call is counted.
            shared.note_call();
            io::Error::new(io::ErrorKind::NotFound, text)
        })
}

/// Returns the addresses of a name, or of a literal address, for a program on another thread than that of the run.
#[cfg(feature = "facade")]
pub(crate) fn elsewhere(shared: &crate::core::Shared, name: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    let unknown = || io::Error::new(io::ErrorKind::NotFound, shared.names().unknown(name));
    of_name_by(name, port, |name| shared.addresses(name).ok_or_else(unknown)).map(Found::all)
}
