//! A record of the keys that readers of tables know, for tests of the catalogue.

use std::cell::RefCell;

thread_local! {
    static SEEN: RefCell<Vec<(String, Vec<&'static str>)>> = const { RefCell::new(Vec::new()) };
}

/// Records the keys that the reader of a table knows.
pub(super) fn seen(path: &str, known: &[&'static str]) {
    SEEN.with_borrow_mut(|seen| seen.push((path.to_owned(), known.to_vec())));
}

/// Takes the record of this thread: the path of each table that was read, and the keys that its reader knows.
#[must_use]
pub fn take_seen() -> Vec<(String, Vec<&'static str>)> {
    SEEN.take()
}
