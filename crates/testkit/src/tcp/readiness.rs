//! Methods of streams that wait for readiness, and methods that do not wait.

use std::future::poll_fn;
use std::io::{self, IoSlice, IoSliceMut};
use std::task::{Context, Poll};

use bytes::BufMut;

use super::TcpStream;

impl TcpStream {
    /// Waits until bytes can be read, or the connection is over.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run. The next call returns an error of the connection itself.
    pub async fn readable(&self) -> io::Result<()> {
        poll_fn(|cx| self.poll_read_ready(cx)).await
    }

    /// Returns ready when bytes can be read, or the connection is over.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::readable`].
    pub fn poll_read_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.open(|core| {
            if core.is_ready(self.id)[0] {
                return Poll::Ready(Ok(()));
            }
            core.wait_to_read_from(self.id, cx.waker());
            Poll::Pending
        })?
    }

    /// Waits until bytes can be written, or the connection is over.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run. The next call returns an error of the connection itself.
    pub async fn writable(&self) -> io::Result<()> {
        poll_fn(|cx| self.poll_write_ready(cx)).await
    }

    /// Returns ready when bytes can be written, or the connection is over.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::writable`].
    pub fn poll_write_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.open(|core| {
            if core.is_ready(self.id)[1] {
                return Poll::Ready(Ok(()));
            }
            core.wait_to_write_to(self.id, cx.waker());
            Poll::Pending
        })?
    }

    /// Reads received bytes. Returns the number of bytes read; 0 is the end of the stream.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::WouldBlock`] if there are no received bytes; the error that ended the connection.
    pub fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.try_read_vectored(&mut [IoSliceMut::new(buffer)])
    }

    /// Reads received bytes into one buffer after the other. Returns the number of bytes read.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::try_read`].
    pub fn try_read_vectored(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        self.open(|core| core.read(self.id, buffers))?
    }

    /// Reads received bytes into the free space of a buffer. Returns the number of bytes read.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::try_read`].
    pub fn try_read_buf<B: BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        // Tokio, too, fills only the contiguous free space of a growing buffer.
        let room = buffer.chunk_mut().len().min(buffer.remaining_mut());
        // The temporary memory is no longer than the received bytes. One byte at least, so that an empty stream answers with its end or `WouldBlock`.
        let unread = self.open(|core| core.connection(self.id).info().unread)?;
        let mut read = vec![0; room.min(unread.max(1))];
        let count = self.try_read(&mut read)?;
        buffer.put_slice(&read[..count]);
        Ok(count)
    }

    /// Writes as many bytes as the send buffer takes. Returns the number of bytes written.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::WouldBlock`] if the send buffer is full; the error that ended the connection.
    pub fn try_write(&self, buffer: &[u8]) -> io::Result<usize> {
        self.try_write_vectored(&[IoSlice::new(buffer)])
    }

    /// Writes one buffer after the other, until the send buffer is full. Returns the number of bytes written.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::try_write`].
    pub fn try_write_vectored(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
        self.open(|core| core.write(self.id, buffers))?
    }

    /// Waits until the stream is ready for one of the interests.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run. The next call returns an error of the connection itself.
    #[cfg(feature = "tokio-net")]
    pub async fn ready(&self, interest: tokio::io::Interest) -> io::Result<tokio::io::Ready> {
        poll_fn(|cx| {
            let ready = self.readiness(interest)?;
            if !ready.is_empty() {
                return Poll::Ready(Ok(ready));
            }
            self.open(|core| {
                if interest.is_readable() {
                    core.wait_to_read_from(self.id, cx.waker());
                }
                if interest.is_writable() {
                    core.wait_to_write_to(self.id, cx.waker());
                }
            })?;
            Poll::Pending
        })
        .await
    }

    /// Returns the interests for which the stream is ready now.
    #[cfg(feature = "tokio-net")]
    fn readiness(&self, interest: tokio::io::Interest) -> io::Result<tokio::io::Ready> {
        use tokio::io::Ready;
        self.open(|core| {
            let [can_read, can_write, read_closed, write_closed] = core.readiness(self.id);
            let flag = |is_set: bool, flag| if is_set { flag } else { Ready::EMPTY };
            let readable = flag(can_read, Ready::READABLE) | flag(read_closed, Ready::READ_CLOSED);
            let writable = flag(can_write, Ready::WRITABLE) | flag(write_closed, Ready::WRITE_CLOSED);
            flag(interest.is_readable(), readable) | flag(interest.is_writable(), writable)
        })
    }

    /// Tries an operation of the caller, such as [`TcpStream::try_read`].
    ///
    /// # Errors
    ///
    /// Errors of the operation; [`io::ErrorKind::WouldBlock`] if the stream is ready for none of the interests.
    #[cfg(feature = "tokio-net")]
    pub fn try_io<R>(&self, interest: tokio::io::Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        if self.readiness(interest)?.is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        operation()
    }

    /// Performs an operation of the caller. After an operation that would have blocked, waits until the stream is ready, and repeats the operation.
    ///
    /// # Errors
    ///
    /// Errors of the operation, except [`io::ErrorKind::WouldBlock`].
    #[cfg(feature = "tokio-net")]
    pub async fn async_io<R>(&self, interest: tokio::io::Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        loop {
            self.ready(interest).await?;
            match operation() {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                outcome => return outcome,
            }
        }
    }

    /// Copies received bytes and leaves the bytes in the stream. Returns the number of bytes. Without bytes, the task is woken when bytes arrive.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::peek`].
    #[cfg(feature = "tokio")]
    pub fn poll_peek(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<usize>> {
        let polled = self.poll_peek_into(cx, buffer.initialize_unfilled());
        if let Poll::Ready(Ok(count)) = polled {
            buffer.advance(count);
        }
        polled
    }
}
