//! A run in which people take part from a page.

use std::sync::Arc;

use serde_json::Value;

/// The person who asks: the one who started the run, or somebody to whom a link was handed out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// May change links, begin the run anew and compare.
    Host,
    /// May look on and move a hand.
    Guest,
}

/// A file of a run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct StageFile {
    /// Its type, such as `"text/csv"`.
    pub kind: &'static str,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// A run in which people take part from a page. Called on threads of the server, several at once; nothing here may wait for the real-time side.
pub trait Stage: Send + Sync {
    /// What a page must know of the run beyond its state: a JSON object. Its `part` changes when the run begins anew.
    fn facts(&self, role: Role) -> Value;

    /// The newest picture of everything that moves, as JSON text, and its number, which grows.
    fn frame(&self) -> (u64, Arc<str>);

    /// Takes a hand that nobody has: that one, or any. Gives its number.
    ///
    /// # Errors
    ///
    /// Why there is none, as it is shown to the user.
    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String>;

    /// The hand is there now, or has let go.
    ///
    /// # Errors
    ///
    /// Why it cannot be there.
    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String>;

    /// Lets the hand go; somebody else may take it.
    fn leave_hand(&self, hand: usize);

    /// Begins the run anew with something changed, where it stands.
    ///
    /// # Errors
    ///
    /// Why it cannot be, as it is shown to the user; nothing changes.
    fn begin_anew(&self, wish: &Value) -> Result<(), String>;

    /// Runs what was recorded in other ways, as fast as it goes, and gives what came of each: a JSON object.
    ///
    /// # Errors
    ///
    /// Why it cannot be, as it is shown to the user.
    fn compare(&self) -> Result<Value, String>;

    /// The file of that name, of what was recorded last; `None` if there is none.
    fn file(&self, name: &str) -> Option<StageFile>;
}
