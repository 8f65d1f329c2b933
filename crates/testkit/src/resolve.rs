//! Descriptions of socket addresses.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use crate::address::Addresses;
use crate::context;

/// Description of a socket address: the address itself, or the name of a host of the running test bed or a literal address, with a port.
///
/// A name stands for the IPv4 address of the host; `"[server]:80"` for the IPv6 address.
pub trait ToSocketAddrs {
    /// Returns the socket address.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::InvalidInput`] if the text is no address, [`io::ErrorKind::NotFound`] if there is no host of that name, or no test bed is running.
    fn to_socket_addr(&self) -> io::Result<SocketAddr>;
}

impl ToSocketAddrs for SocketAddr {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        Ok(*self)
    }
}

impl ToSocketAddrs for (IpAddr, u16) {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        Ok((*self).into())
    }
}

impl ToSocketAddrs for (Ipv4Addr, u16) {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        Ok((*self).into())
    }
}

impl ToSocketAddrs for (Ipv6Addr, u16) {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        Ok((*self).into())
    }
}

impl ToSocketAddrs for (&str, u16) {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        let (name, port) = *self;
        let address = match name.parse::<IpAddr>() {
            Ok(address) => address,
            Err(_) => look_up(name)?.v4.into(),
        };
        Ok((address, port).into())
    }
}

impl ToSocketAddrs for (String, u16) {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        (&*self.0, self.1).to_socket_addr()
    }
}

impl ToSocketAddrs for str {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        if let Ok(address) = self.parse() {
            return Ok(address);
        }
        let wrong = || {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                format!("`{self}` is not an address; expected one like `10.0.0.1:80`, `[fd00::1]:80` or `server:80`"),
            )
        };
        let (name, port) = self.rsplit_once(':').ok_or_else(wrong)?;
        let port = port.parse().map_err(|_| wrong())?;
        match name.strip_prefix('[').and_then(|name| name.strip_suffix(']')) {
            Some(name) => Ok((look_up(name)?.v6, port).into()),
            None => (name, port).to_socket_addr(),
        }
    }
}

impl ToSocketAddrs for String {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        (**self).to_socket_addr()
    }
}

impl<T: ToSocketAddrs + ?Sized> ToSocketAddrs for &T {
    fn to_socket_addr(&self) -> io::Result<SocketAddr> {
        (**self).to_socket_addr()
    }
}

fn look_up(name: &str) -> io::Result<Addresses> {
    let shared = context::shared().ok_or_else(|| context::outside(&format!("the name `{name}` of a host means something")))?;
    let found = shared.with(|core| core.plan.addresses(name));
    found.ok_or_else(|| {
        // A program that looks up a wrong name again and again lets no time pass, so the call is counted.
        shared.note_call();
        io::Error::new(io::ErrorKind::NotFound, shared.names().unknown(name))
    })
}
