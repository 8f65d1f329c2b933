//! Readiness of sockets of a test bed, in the types of tokio.

use std::task::Poll;

use real::io::{Interest, Ready};

/// Returns the part of a readiness for which the interest asks.
pub(super) fn ready(interest: Interest, now: cohaptic_sockets::Ready) -> Ready {
    let flag = |is_set: bool, flag| if is_set { flag } else { Ready::EMPTY };
    let mut ready = Ready::EMPTY;
    if interest.is_readable() {
        ready = ready | flag(now.readable, Ready::READABLE) | flag(now.read_closed, Ready::READ_CLOSED);
    }
    if interest.is_writable() {
        ready = ready | flag(now.writable, Ready::WRITABLE) | flag(now.write_closed, Ready::WRITE_CLOSED);
    }
    ready
}

/// Waits until a stream of a test bed is ready for something of the interest.
pub(super) async fn until(stream: &(impl cohaptic_sockets::ByteStream + ?Sized), interest: Interest) -> std::io::Result<Ready> {
    std::future::poll_fn(|cx| {
        let ready = ready(interest, stream.ready()?);
        if !ready.is_empty() {
            return Poll::Ready(Ok(ready));
        }
        // Nothing is ready, so these calls register the task.
        if interest.is_readable() {
            let _ = stream.poll_readable(cx)?;
        }
        if interest.is_writable() {
            let _ = stream.poll_writable(cx)?;
        }
        Poll::Pending
    })
    .await
}

/// Most bytes that are read at once into a buffer which may grow.
#[cfg(feature = "io-util")]
const READ: usize = 1 << 16;

/// Reads into the free space of a buffer.
#[cfg(feature = "io-util")]
pub(super) fn read_into(buffer: &mut impl bytes::BufMut, read: impl FnOnce(&mut [u8]) -> std::io::Result<usize>) -> std::io::Result<usize> {
    // The space of the real tokio, which reads into the first chunk.
    let mut bytes = vec![0; buffer.chunk_mut().len().min(buffer.remaining_mut()).min(READ)];
    let count = read(&mut bytes)?;
    buffer.put_slice(&bytes[..count]);
    Ok(count)
}
