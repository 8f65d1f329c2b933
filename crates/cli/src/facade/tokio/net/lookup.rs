//! Names.

use std::io;
use std::net::SocketAddr;

use super::ToSocketAddrs;
use super::addr::with_real;

/// See `tokio::net::lookup_host`. In a test bed the names are those of its hosts.
pub async fn lookup_host<T: ToSocketAddrs>(host: T) -> io::Result<impl Iterator<Item = SocketAddr>> {
    let target = host.describe();
    drop(host);
    let found: Vec<SocketAddr> = match super::bed()? {
        Some(bed) => target.addresses(&*bed)?,
        None => with_real!(target, |address| real::net::lookup_host(address).await?.collect()),
    };
    Ok(found.into_iter())
}
