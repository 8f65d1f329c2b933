//! The interface of a run in which people take part from a page.

use std::sync::Arc;

use serde_json::Value;

/// Role of the person behind a request, recognised by the token.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// The person who started the run: may change links, restart the run and compare.
    Host,
    /// A person with a guest link: may watch and move a hand.
    Guest,
}

/// A file offered for download.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct StageFile {
    /// MIME type, such as `"text/csv"`.
    pub kind: &'static str,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

/// A run in which people take part from a page. The methods are called on threads of the server, possibly several at once, and must not wait for the
/// real-time side.
pub trait Stage: Send + Sync {
    /// Returns a JSON object with everything that a page must know of the run besides its state. The entry `part` changes when the run restarts.
    fn facts(&self, role: Role) -> Value;

    /// Returns the newest picture of the motion as JSON text, and the picture's number. Numbers grow from picture to picture.
    fn frame(&self) -> (u64, Arc<str>);

    /// Takes the free hand `wanted`, or any free hand for `None`. Returns the number of the hand.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the user.
    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String>;

    /// Sets the position of a hand \[m\]; `None` lets go of the object.
    ///
    /// # Errors
    ///
    /// The reason why the hand cannot be at the position.
    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String>;

    /// Gives a hand back, for somebody else to take.
    fn leave_hand(&self, hand: usize);

    /// Restarts the run, with the change described by `wish`.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the user. Nothing has changed then.
    fn begin_anew(&self, wish: &Value) -> Result<(), String>;

    /// Runs the recorded motion under other conditions, faster than real time, and returns the results as a JSON object.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the user.
    fn compare(&self) -> Result<Value, String>;

    /// Returns a file of the newest recording by its name; `None` if no such file exists.
    fn file(&self, name: &str) -> Option<StageFile>;
}
