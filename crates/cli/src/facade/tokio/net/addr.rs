//! Descriptions of addresses.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};

use sealed::{Described, Target};

/// See `tokio::net::ToSocketAddrs`. The trait is this package's own, because the real trait gives away addresses only, and never the name.
pub trait ToSocketAddrs: Described {}

pub(super) mod sealed {
    use std::net::SocketAddr;

    /// Address or addresses described by a value.
    #[derive(Debug)]
    pub enum Target {
        /// One address.
        One(SocketAddr),
        /// Several addresses, to be tried in turn.
        Many(Vec<SocketAddr>),
        /// A text such as `server:80`.
        Text(String),
        /// A name, or an address without port, and a port.
        Name(String, u16),
    }

    pub trait Described {
        fn describe(&self) -> Target;
    }
}

/// Calls a function of the real tokio with the description of a target.
#[cfg(feature = "net")]
macro_rules! with_real {
    ($target:expr, |$address:ident| $call:expr) => {
        match $target {
            $crate::net::addr::sealed::Target::One($address) => $call,
            $crate::net::addr::sealed::Target::Many(list) => {
                let $address = &list[..];
                $call
            }
            $crate::net::addr::sealed::Target::Text(text) => {
                let $address = text.as_str();
                $call
            }
            $crate::net::addr::sealed::Target::Name(name, port) => {
                let $address = (name.as_str(), port);
                $call
            }
        }
    };
}
#[cfg(feature = "net")]
pub(super) use with_real;

#[cfg(feature = "net")]
impl Target {
    /// Returns the addresses in a test bed.
    pub(super) fn addresses(self, bed: &dyn cohaptic_sockets::Bed) -> std::io::Result<Vec<SocketAddr>> {
        match self {
            Self::One(address) => Ok(vec![address]),
            Self::Many(addresses) => Ok(addresses),
            Self::Text(text) => bed.look_up_text(&text),
            Self::Name(name, port) => bed.look_up(&name, port),
        }
    }
}

/// Returns the error of the real tokio for a target without addresses.
#[cfg(feature = "net")]
pub(super) fn no_address(text: &str) -> std::io::Error {
    std::io::Error::new(std::io::ErrorKind::InvalidInput, text)
}

macro_rules! described {
    ($($kind:ty: |$value:ident| $target:expr;)*) => {
        $(
            impl ToSocketAddrs for $kind {}

            impl Described for $kind {
                fn describe(&self) -> Target {
                    let $value = self;
                    $target
                }
            }
        )*
    };
}

described! {
    SocketAddr: |address| Target::One(*address);
    SocketAddrV4: |address| Target::One((*address).into());
    SocketAddrV6: |address| Target::One((*address).into());
    (IpAddr, u16): |address| Target::One((*address).into());
    (Ipv4Addr, u16): |address| Target::One((*address).into());
    (Ipv6Addr, u16): |address| Target::One((*address).into());
    &[SocketAddr]: |addresses| Target::Many(addresses.to_vec());
}

#[cfg(feature = "net")]
described! {
    str: |text| text.parse().map_or_else(|_| Target::Text(text.to_owned()), Target::One);
    String: |text| text.as_str().describe();
    (&str, u16): |pair| pair.0.parse::<IpAddr>().map_or_else(|_| Target::Name(pair.0.to_owned(), pair.1), |ip| Target::One((ip, pair.1).into()));
    (String, u16): |pair| (pair.0.as_str(), pair.1).describe();
}

impl<T: ToSocketAddrs + ?Sized> ToSocketAddrs for &T {}

impl<T: Described + ?Sized> Described for &T {
    fn describe(&self) -> Target {
        (**self).describe()
    }
}
