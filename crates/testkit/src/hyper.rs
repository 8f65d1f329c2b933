//! Unmodified clients and servers of hyper, HTTP/1 and HTTP/2.
//!
//! A stream wrapped in [`TokioIo`] is a connection for hyper on both sides. [`Connector`] opens connections for the client of `hyper-util`.
//! [`Executor`] runs futures spawned by hyper as tasks of a host, on both runtimes.
//!
//! A server of HTTP/1 or 2 adds a `Date` header, which reads the time of day: two runs differ by the header. Turn the header off (`auto_date_header(false)`),
//! or set the header in the response: hyper keeps a header that is set.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use hyper::Uri;
use hyper::body::Body;
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::{Connected, Connection};
use hyper_util::rt::TokioIo;

use crate::{Host, TcpStream};

/// Creates a client of `hyper-util` on a host, with a pool of connections from the host. `B` is the body of the requests.
#[must_use]
pub fn client<B>(host: &Host) -> Client<Connector, B>
where
    B: Body + Send,
    B::Data: Send,
{
    Client::builder(Executor::new(host)).build(Connector::new(host))
}

/// Connector for connections from a host to the authorities of URIs: names of hosts, or addresses. Without a port the connector uses 443 for `https`, and 80
/// otherwise. The connector does not encrypt; a connector around this connector can.
#[derive(Clone, Debug)]
pub struct Connector(Host);

impl Connector {
    /// Creates a connector whose connections come from `host`.
    #[must_use]
    pub fn new(host: &Host) -> Self {
        Self(host.clone())
    }
}

impl tower_service::Service<Uri> for Connector {
    type Response = TokioIo<TcpStream>;
    type Error = io::Error;
    type Future = Pin<Box<dyn Future<Output = io::Result<Self::Response>> + Send>>;

    fn poll_ready(&mut self, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, uri: Uri) -> Self::Future {
        let host = self.0.clone();
        Box::pin(async move {
            let name = uri.host().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, format!("`{uri}` names no host")))?;
            let port = uri.port_u16().unwrap_or_else(|| if uri.scheme_str() == Some("https") { 443 } else { 80 });
            host.connect(format!("{name}:{port}")).await.map(TokioIo::new)
        })
    }
}

impl Connection for TcpStream {
    fn connected(&self) -> Connected {
        Connected::new()
    }
}

/// Executor for futures as tasks of a host. Futures that come while the host is down are dropped.
#[derive(Clone, Debug)]
pub struct Executor(Host);

impl Executor {
    /// Creates an executor whose tasks live on `host`.
    #[must_use]
    pub fn new(host: &Host) -> Self {
        Self(host.clone())
    }
}

impl<F> hyper::rt::Executor<F> for Executor
where
    F: Future + 'static,
    F::Output: 'static,
{
    fn execute(&self, future: F) {
        if self.0.is_up() {
            drop(self.0.spawn(future));
        }
    }
}
