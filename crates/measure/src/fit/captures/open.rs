//! Reads the capture of one end.

use std::io::Read;

use super::contents::Capture;
use super::{CaptureError, End, reader, views};

impl Capture {
    /// Reads a file. With a `port`, only datagrams to this UDP port are used.
    pub(super) fn read(end: End, mut from: impl Read, port: Option<u16>) -> Result<Self, CaptureError> {
        Self::read_any(end, &mut from, port)
    }

    /// The body of [`Capture::read`], compiled once here, and not for each type of reader.
    fn read_any(end: End, from: &mut dyn Read, port: Option<u16>) -> Result<Self, CaptureError> {
        let mut capture = Self::empty();
        let ending = reader::for_each_frame(from, |frame| capture.add(&frame, port));
        let frames = capture.contents.frames;
        let ending = ending.map_err(|problem| CaptureError::Unreadable { end, frames, problem })?;
        capture.contents.cut_off = ending == reader::Ending::CutOff;
        if capture.datagrams.is_empty() {
            return Err(CaptureError::NoDatagrams { end, port, contents: Box::new(capture.contents) });
        }
        capture.datagrams.sort_by_key(|datagram| datagram.nanos);
        capture.contents.seen_again = views::merge(&mut capture);
        Ok(capture)
    }
}
