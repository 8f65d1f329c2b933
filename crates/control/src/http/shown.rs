//! The last snapshot as text, made once for all connections that show it.

use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;

use crate::{Board, views};

/// A snapshot as text.
#[derive(Clone, Debug)]
pub(super) struct Text {
    /// The number of the snapshot.
    pub(super) number: u64,
    /// The state as JSON, with the end of its line.
    pub(super) json: Bytes,
    /// The state as an event of a stream.
    pub(super) event: Bytes,
}

/// The newest [`Text`] that somebody asked for. Without it the same state would be written again for each stream of events, ten times a second.
#[derive(Debug, Default)]
pub(crate) struct Shown(Mutex<Option<Arc<Text>>>);

impl Shown {
    /// The last snapshot of the board.
    pub(super) fn latest(&self, board: &Board) -> Arc<Text> {
        let latest = board.latest();
        let mut shown = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(text) = shown.as_ref().filter(|text| text.number == latest.number) {
            return Arc::clone(text);
        }
        let head = format!("event: state\nid: {}\ndata: ", latest.number);
        // JSON is one line, so it is one line of data.
        let event = Bytes::from(format!("{head}{}\n\n", views::state(&latest)));
        let json = event.slice(head.len()..event.len() - 1);
        let text = Arc::new(Text { number: latest.number, json, event });
        *shown = Some(Arc::clone(&text));
        text
    }
}
