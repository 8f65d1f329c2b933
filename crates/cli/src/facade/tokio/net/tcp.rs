//! Halves of TCP streams.

use std::net::SocketAddr;
use std::task::{Context, Poll};

use real::io::ReadBuf;

use super::TcpStream;

super::halves::halves!(TcpStream, SocketAddr, {
    /// See the method of the stream.
    pub fn poll_peek(&mut self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<usize>> {
        self.stream().poll_peek(cx, buffer)
    }

    /// See the method of the stream.
    pub async fn peek(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream().peek(buffer).await
    }
});
