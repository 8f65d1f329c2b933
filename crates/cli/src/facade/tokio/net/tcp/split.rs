//! Halves that borrow a stream, and the methods that all halves have.

use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};

use real::io::{AsyncRead, AsyncWrite, Interest, ReadBuf, Ready};

use super::super::TcpStream;

/// Methods of both halves.
macro_rules! both {
    () => {
        /// See the method of the stream.
        pub async fn ready(&self, interest: Interest) -> io::Result<Ready> {
            self.stream().ready(interest).await
        }

        /// See the method of the stream.
        pub fn peer_addr(&self) -> io::Result<SocketAddr> {
            self.stream().peer_addr()
        }

        /// See the method of the stream.
        pub fn local_addr(&self) -> io::Result<SocketAddr> {
            self.stream().local_addr()
        }
    };
}

/// Methods of the half that reads.
macro_rules! reading {
    () => {
        /// See the method of the stream.
        pub fn poll_peek(&mut self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<usize>> {
            self.stream().poll_peek(cx, buffer)
        }

        /// See the method of the stream.
        pub async fn peek(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.stream().peek(buffer).await
        }

        /// See the method of the stream.
        pub async fn readable(&self) -> io::Result<()> {
            self.stream().readable().await
        }

        /// See the method of the stream.
        pub fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
            self.stream().try_read(buffer)
        }

        /// See the method of the stream.
        pub fn try_read_vectored(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
            self.stream().try_read_vectored(buffers)
        }

        /// See the method of the stream.
        #[cfg(feature = "io-util")]
        pub fn try_read_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
            self.stream().try_read_buf(buffer)
        }
    };
}

/// Methods of the half that writes.
macro_rules! writing {
    () => {
        /// See the method of the stream.
        pub async fn writable(&self) -> io::Result<()> {
            self.stream().writable().await
        }

        /// See the method of the stream.
        pub fn try_write(&self, buffer: &[u8]) -> io::Result<usize> {
            self.stream().try_write(buffer)
        }

        /// See the method of the stream.
        pub fn try_write_vectored(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
            self.stream().try_write_vectored(buffers)
        }
    };
}
pub(super) use {both, reading, writing};

/// See `tokio::net::tcp::ReadHalf`.
#[derive(Debug)]
pub struct ReadHalf<'a>(pub(in crate::net) &'a TcpStream);

/// See `tokio::net::tcp::WriteHalf`.
#[derive(Debug)]
pub struct WriteHalf<'a>(pub(in crate::net) &'a TcpStream);

impl ReadHalf<'_> {
    fn stream(&self) -> &TcpStream {
        self.0
    }
    both!();
    reading!();
}

impl WriteHalf<'_> {
    fn stream(&self) -> &TcpStream {
        self.0
    }
    both!();
    writing!();
}

impl AsyncRead for ReadHalf<'_> {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.0.poll_read_shared(cx, buffer)
    }
}

impl AsyncWrite for WriteHalf<'_> {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &[u8]) -> Poll<io::Result<usize>> {
        self.0.poll_write_shared(cx, buffer)
    }

    fn poll_write_vectored(self: Pin<&mut Self>, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.0.poll_write_vectored_shared(cx, buffers)
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(self.0.shut_down_shared())
    }
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
