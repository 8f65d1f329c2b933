//! Halves that borrow a stream.

use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::task::{Context, Poll};

use bytes::BufMut;
use tokio::io::ReadBuf;

use super::TcpStream;

/// Methods of both kinds of reading halves.
macro_rules! reading {
    () => {
        /// Like [`TcpStream::peek`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::peek`].
        pub async fn peek(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.stream().peek(buffer).await
        }

        /// Like [`TcpStream::poll_peek`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::poll_peek`].
        pub fn poll_peek(&mut self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<usize>> {
            self.stream().poll_peek(cx, buffer)
        }

        /// Like [`TcpStream::readable`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::readable`].
        pub async fn readable(&self) -> io::Result<()> {
            self.stream().readable().await
        }

        /// Like [`TcpStream::try_read`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::try_read`].
        pub fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
            self.stream().try_read(buffer)
        }

        /// Like [`TcpStream::try_read_vectored`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::try_read_vectored`].
        pub fn try_read_vectored(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
            self.stream().try_read_vectored(buffers)
        }

        /// Like [`TcpStream::try_read_buf`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::try_read_buf`].
        pub fn try_read_buf<B: BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
            self.stream().try_read_buf(buffer)
        }
    };
}

/// Methods of both kinds of writing halves.
macro_rules! writing {
    () => {
        /// Like [`TcpStream::writable`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::writable`].
        pub async fn writable(&self) -> io::Result<()> {
            self.stream().writable().await
        }

        /// Like [`TcpStream::try_write`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::try_write`].
        pub fn try_write(&self, buffer: &[u8]) -> io::Result<usize> {
            self.stream().try_write(buffer)
        }

        /// Like [`TcpStream::try_write_vectored`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::try_write_vectored`].
        pub fn try_write_vectored(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
            self.stream().try_write_vectored(buffers)
        }
    };
}

/// Methods of all halves.
macro_rules! both {
    () => {
        /// Like [`TcpStream::ready`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::ready`].
        #[cfg(feature = "tokio-net")]
        pub async fn ready(&self, interest: tokio::io::Interest) -> io::Result<tokio::io::Ready> {
            self.stream().ready(interest).await
        }

        /// Returns the address of the other end: see [`TcpStream::peer_addr`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::peer_addr`].
        pub fn peer_addr(&self) -> io::Result<SocketAddr> {
            self.stream().peer_addr()
        }

        /// Returns the address of this end: see [`TcpStream::local_addr`].
        ///
        /// # Errors
        ///
        /// The errors of [`TcpStream::local_addr`].
        pub fn local_addr(&self) -> io::Result<SocketAddr> {
            self.stream().local_addr()
        }
    };
}

pub(super) use {both, reading, writing};

/// Borrowed reading half of a stream: see [`TcpStream::split`].
#[derive(Debug)]
pub struct ReadHalf<'a>(pub(super) &'a TcpStream);

/// Borrowed writing half of a stream: see [`TcpStream::split`]. Dropping this half sends nothing.
#[derive(Debug)]
pub struct WriteHalf<'a>(pub(super) &'a TcpStream);

impl ReadHalf<'_> {
    const fn stream(&self) -> &TcpStream {
        self.0
    }
    both!();
    reading!();
}

impl WriteHalf<'_> {
    const fn stream(&self) -> &TcpStream {
        self.0
    }
    both!();
    writing!();
}

impl AsRef<TcpStream> for ReadHalf<'_> {
    fn as_ref(&self) -> &TcpStream {
        self.0
    }
}

impl AsRef<TcpStream> for WriteHalf<'_> {
    fn as_ref(&self) -> &TcpStream {
        self.0
    }
}
