//! Pipes. In a test bed `pipe` makes a pipe in memory, and pipes of the system are refused.

use std::fs::File;
use std::io::{self, IoSlice};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context, Poll};

use cohaptic_sockets::{ByteStream, Call};
use real::io::ReadBuf;

use super::no_descriptors;
use crate::net::bytes::{reads, waits, writes};
use crate::net::{Either, either};

/// See `tokio::net::unix::pipe::Sender`.
#[derive(Debug)]
pub struct Sender(Either<real::net::unix::pipe::Sender, Box<dyn ByteStream>>);

/// See `tokio::net::unix::pipe::Receiver`.
#[derive(Debug)]
pub struct Receiver(Either<real::net::unix::pipe::Receiver, Box<dyn ByteStream>>);

/// See `tokio::net::unix::pipe::pipe`.
#[track_caller]
pub fn pipe() -> io::Result<(Sender, Receiver)> {
    match crate::net::bed()? {
        None => real::net::unix::pipe::pipe().map(|(sender, receiver)| (Sender(Either::Real(sender)), Receiver(Either::Real(receiver)))),
        Some(bed) => bed.pipe(Call::here("pipe")).map(|[sender, receiver]| (Sender(Either::Bed(sender)), Receiver(Either::Bed(receiver)))),
    }
}

/// See `tokio::net::unix::pipe::OpenOptions`.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions(real::net::unix::pipe::OpenOptions);

impl OpenOptions {
    /// See `tokio::net::unix::pipe::OpenOptions::new`.
    pub fn new() -> Self {
        Self::default()
    }

    /// See `tokio::net::unix::pipe::OpenOptions::read_write`.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    pub fn read_write(&mut self, value: bool) -> &mut Self {
        self.0.read_write(value);
        self
    }

    /// See `tokio::net::unix::pipe::OpenOptions::unchecked`.
    pub fn unchecked(&mut self, value: bool) -> &mut Self {
        self.0.unchecked(value);
        self
    }

    /// See `tokio::net::unix::pipe::OpenOptions::open_receiver`.
    pub fn open_receiver<P: AsRef<Path>>(&self, path: P) -> io::Result<Receiver> {
        super::refuse_in_bed("pipe::OpenOptions::open_receiver")?;
        self.0.open_receiver(path).map(|receiver| Receiver(Either::Real(receiver)))
    }

    /// See `tokio::net::unix::pipe::OpenOptions::open_sender`.
    pub fn open_sender<P: AsRef<Path>>(&self, path: P) -> io::Result<Sender> {
        super::refuse_in_bed("pipe::OpenOptions::open_sender")?;
        self.0.open_sender(path).map(|sender| Sender(Either::Real(sender)))
    }
}

/// Conversions from files and descriptors of the system.
macro_rules! conversions {
    ($name:ident; $($function:ident($from:ty);)*) => {
        $(
            /// See the function of the same name of tokio.
            pub fn $function(from: $from) -> io::Result<Self> {
                super::refuse_in_bed(concat!("pipe::", stringify!($name), "::", stringify!($function)))?;
                real::net::unix::pipe::$name::$function(from).map(|end| Self(Either::Real(end)))
            }
        )*
    };
}
/// Implements the conversions from and to descriptors, and calls of foreign operations.
macro_rules! end {
    ($name:ident, $ready:ident) => {
        impl $name {
            conversions! {
                $name;
                from_file(File);
                from_file_unchecked(File);
                from_owned_fd(OwnedFd);
                from_owned_fd_unchecked(OwnedFd);
            }

            /// See the method of the same name of tokio.
            pub fn into_blocking_fd(self) -> io::Result<OwnedFd> {
                match self.0 {
                    Either::Real(end) => end.into_blocking_fd(),
                    Either::Bed(_) => Err(super::refused(concat!("pipe::", stringify!($name), "::into_blocking_fd"))),
                }
            }

            /// See the method of the same name of tokio.
            pub fn into_nonblocking_fd(self) -> io::Result<OwnedFd> {
                match self.0 {
                    Either::Real(end) => end.into_nonblocking_fd(),
                    Either::Bed(_) => Err(super::refused(concat!("pipe::", stringify!($name), "::into_nonblocking_fd"))),
                }
            }

            /// See the method of the same name of tokio.
            pub fn try_io<R>(&self, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
                match &self.0 {
                    Either::Real(end) => end.try_io(operation),
                    Either::Bed(end) if !end.ready()?.$ready => Err(io::ErrorKind::WouldBlock.into()),
                    Either::Bed(_) => operation(),
                }
            }

            waits!();
        }

        no_descriptors!($name);
    };
}

end!(Sender, writable);
end!(Receiver, readable);

impl Sender {
    writes!();
}

impl Receiver {
    reads!();
}

impl real::io::AsyncRead for Receiver {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        match &mut self.0 {
            Either::Real(end) => Pin::new(end).poll_read(cx, buffer),
            Either::Bed(end) => end.poll_read(cx, buffer.initialize_unfilled()).map_ok(|count| buffer.advance(count)),
        }
    }
}

impl real::io::AsyncWrite for Sender {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &[u8]) -> Poll<io::Result<usize>> {
        either!(&mut self.0, |end| Pin::new(end).poll_write(cx, buffer), end.poll_write(cx, &[IoSlice::new(buffer)]))
    }

    fn poll_write_vectored(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        either!(&mut self.0, |end| Pin::new(end).poll_write_vectored(cx, buffers), end.poll_write(cx, buffers))
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    /// As with tokio, the pipe ends when its end is dropped.
    fn poll_shutdown(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
