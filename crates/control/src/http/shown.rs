//! Text of the newest snapshot, made once for all connections.

use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;

use crate::{Board, views};

/// Texts of a snapshot.
#[derive(Clone, Debug)]
pub(super) struct Text {
    /// Number of the snapshot.
    pub(super) number: u64,
    /// State as a line of JSON, with the end of line.
    pub(super) json: Bytes,
    /// State as a server-sent event.
    pub(super) event: Bytes,
}

/// Cache of the newest requested [`Text`]. Without the cache, each stream of events would convert the same state again, ten times per second.
#[derive(Debug, Default)]
pub(crate) struct Shown(Mutex<Option<Arc<Text>>>);

impl Shown {
    /// Returns the text of the board's newest snapshot.
    pub(super) fn latest(&self, board: &Board) -> Arc<Text> {
        let latest = board.latest();
        let mut shown = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(text) = shown.as_ref().filter(|text| text.number == latest.number) {
            return Arc::clone(text);
        }
        let head = format!("event: state\nid: {}\ndata: ", latest.number);
        // An event of several lines would need "data: " before each. JSON from serde_json is a single line.
        let event = Bytes::from(format!("{head}{}\n\n", views::state(&latest)));
        // The JSON lies inside the event, so both share the memory. The event ends in two line feeds, and the JSON keeps the first.
        let json = event.slice(head.len()..event.len() - 1);
        let text = Arc::new(Text { number: latest.number, json, event });
        *shown = Some(Arc::clone(&text));
        text
    }
}
