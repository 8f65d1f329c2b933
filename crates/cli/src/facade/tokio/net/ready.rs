//! Readiness of sockets of a test bed, in the types of tokio.

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
