//! Limits the rate of WebSocket frames, counted in the bytes of the stream.
//!
//! A reader of messages does not see the frames inside a message, and a message may have any number of empty frames. So this module counts frames in the
//! bytes below the WebSocket library.

use core::pin::Pin;
use core::task::{Context, Poll, ready};
use core::time::Duration;
use std::io;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::Instant;

/// Accepted frames per second: half as many again as a 240 Hz screen sends positions.
pub(super) const MOST_A_SECOND: u32 = 360;

/// Position of the next byte in a frame (RFC 6455, section 5.2).
#[derive(Clone, Copy, Debug)]
enum At {
    /// First byte of the head.
    First,
    /// Second byte of the head: the mask bit, and the length or the kind of the extended length.
    Second,
    /// Extended length, most significant byte first: bytes left, value so far, and length of the mask \[byte\].
    Length(u8, u64, u64),
    /// Bytes of mask and content left, at least one.
    Content(u64),
}

/// Parser of frame boundaries, and nothing else of a frame.
#[derive(Clone, Copy, Debug)]
struct Frames(At);

impl Frames {
    /// Returns the number of frames beginning in `bytes`, which continue the bytes of the call before.
    fn begun_in(&mut self, mut bytes: &[u8]) -> u32 {
        let mut begun = 0;
        while let Some((byte, rest)) = bytes.split_first() {
            self.0 = match self.0 {
                At::First => {
                    begun += 1;
                    At::Second
                }
                At::Second => {
                    // The mask bit is read and not required: the WebSocket library refuses frames without a mask.
                    let mask = if byte & 0x80 == 0 { 0 } else { 4 };
                    match byte & 0x7f {
                        // 126 and 127 announce an extended length of 16 or 64 bits.
                        126 => At::Length(2, 0, mask),
                        127 => At::Length(8, 0, mask),
                        length => content(u64::from(length).saturating_add(mask)),
                    }
                }
                At::Length(left, length, mask) => {
                    let length = length << 8 | u64::from(*byte);
                    // The length of a frame does not contain the mask. A length near 2⁶⁴ saturates: nobody can send as many bytes.
                    if left > 1 { At::Length(left - 1, length, mask) } else { content(length.saturating_add(mask)) }
                }
                At::Content(left) => {
                    // The content is skipped at once, not byte by byte. `here` is at least 1, so the loop makes progress.
                    let here = usize::try_from(left).unwrap_or(usize::MAX).min(bytes.len());
                    bytes = &bytes[here..];
                    self.0 = content(left - here as u64);
                    continue;
                }
            };
            bytes = rest;
        }
        begun
    }
}

/// Returns the state with `left` bytes of content to come; without content the next frame begins.
const fn content(left: u64) -> At {
    if left == 0 { At::First } else { At::Content(left) }
}

/// Frame counter of the present second.
#[derive(Clone, Copy, Debug)]
struct Rate {
    began: Instant,
    count: u32,
}

impl Rate {
    /// Counts `frames` more at `now`. Returns whether the second is within its limit.
    fn admits(&mut self, now: Instant, frames: u32) -> bool {
        // Fixed seconds need no memory of single frames. Around a border, a second may see twice the limit, with little harm.
        if now.duration_since(self.began) >= Duration::from_secs(1) {
            *self = Self { began: now, count: 0 };
        }
        self.count = self.count.saturating_add(frames);
        self.count <= MOST_A_SECOND
    }
}

/// Stream wrapper whose reads fail after more than [`MOST_A_SECOND`] frames in a second.
#[derive(Debug)]
pub(super) struct Counted<S> {
    stream: S,
    frames: Frames,
    rate: Rate,
}

impl<S> Counted<S> {
    pub(super) fn new(stream: S) -> Self {
        Self { stream, frames: Frames(At::First), rate: Rate { began: Instant::now(), count: 0 } }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Counted<S> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        // The buffer may hold earlier bytes, which were counted before.
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(cx, buffer))?;
        let begun = self.frames.begun_in(&buffer.filled()[before..]);
        if self.rate.admits(Instant::now(), begun) { Poll::Ready(Ok(())) } else { Poll::Ready(Err(io::Error::other("too many frames"))) }
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Counted<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_page_that_says_too_much_is_told_apart_from_a_fast_screen() {
        let begin = Instant::now();
        let mut rate = Rate { began: begin, count: 0 };
        for second in 0..3 {
            assert!((0..240).all(|_| rate.admits(begin + Duration::from_secs(second), 1)), "240 a second");
        }
        let admitted = (0..1000).filter(|_| rate.admits(begin + Duration::from_secs(9), 1)).count();
        assert_eq!(admitted, MOST_A_SECOND as usize);
        assert!(!rate.admits(begin + Duration::from_secs(10), MOST_A_SECOND + 1), "at once, as one at a time");
    }

    /// Returns a frame with or without a mask. `way` chooses the short or an extended form of the length.
    fn frame(length: usize, is_masked: bool, way: u8) -> Vec<u8> {
        let mask = if is_masked { 0x80 } else { 0 };
        let mut frame = vec![0x00];
        match way {
            0 if length < 126 => frame.push(mask | u8::try_from(length).unwrap()),
            0 | 1 => {
                frame.push(mask | 126);
                frame.extend(u16::try_from(length).unwrap().to_be_bytes());
            }
            _ => {
                frame.push(mask | 127);
                frame.extend((length as u64).to_be_bytes());
            }
        }
        frame.resize(frame.len() + length + if is_masked { 4 } else { 0 }, 0x81);
        frame
    }

    properties! {
        /// Each frame counts once, at its first byte, however the bytes are cut.
        #[test]
        fn frames_are_counted_whatever_their_bytes_are_cut_into(
            frames in prop::collection::vec((0..300_usize, any::<bool>(), 0..3_u8), 0..20),
            cut in prop::collection::vec(1..40_usize, 1..20),
        ) {
            let bytes: Vec<u8> = frames.iter().flat_map(|(length, is_masked, way)| frame(*length, *is_masked, *way)).collect();
            let mut count = Frames(At::First);
            let (mut rest, mut begun) = (bytes.as_slice(), 0);
            for length in cut.iter().cycle() {
                let (now, later) = rest.split_at(rest.len().min(*length));
                begun += count.begun_in(now);
                rest = later;
                if rest.is_empty() {
                    break;
                }
            }
            prop_assert_eq!(begun as usize, frames.len());
        }

        #[test]
        fn no_bytes_are_too_much_for_it(bytes in prop::collection::vec(any::<u8>(), 0..500)) {
            let begun = Frames(At::First).begun_in(&bytes);
            prop_assert!(begun as usize <= bytes.len());
        }
    }
}
