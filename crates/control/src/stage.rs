//! The interfaces of runs in which people take part from a page: a stage, on which everybody tries things out, and a study, which leads people from trial to
//! trial.

use core::time::Duration;
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

/// Hands that pages move over WebSockets. The methods are called on threads of the server, possibly several at once, and must not wait for the real-time side.
pub trait Hands: Send + Sync {
    /// Returns the newest picture of the motion as JSON text, and the picture's number. Numbers grow from picture to picture. `hand`: hand of the page;
    /// `None` for a page that only watches.
    fn frame(&self, hand: Option<usize>) -> (u64, Arc<str>);

    /// Returns whether hands can be taken yet. A page that connects before is refused with status 503, and connects again. Without an own method: always.
    fn has_begun(&self) -> bool {
        true
    }

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

    /// Returns news for the page of a hand, as the text of a JSON object, with the number of the news. `None` if the page has shown the news of the number
    /// `shown` already. Numbers begin with 1.
    fn news(&self, _hand: usize, _shown: u64) -> Option<(u64, String)> {
        None
    }

    /// Takes a word of the page of a hand that is not a position.
    ///
    /// # Errors
    ///
    /// The reason why the page must not say the word. The connection ends then.
    fn hear(&self, _hand: usize, _word: &str) -> Result<(), String> {
        Err("expected a position".to_owned())
    }

    /// Returns the time between two measurements of a page's round trip; `None` if nobody wants round trips.
    fn measures_round_trips(&self) -> Option<Duration> {
        None
    }

    /// Takes a measured round trip: the time from a ping of the server to the answer of the browser.
    fn round_trip(&self, _hand: usize, _took: Duration) {}
}

/// A run in which people take part from a page. The methods are called on threads of the server, possibly several at once, and must not wait for the
/// real-time side.
pub trait Stage: Hands {
    /// Returns a JSON object with everything that a page must know of the run besides its state. The entry `part` changes when the run restarts.
    fn facts(&self, role: Role) -> Value;

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

/// A run that leads the people of a group from page to page, and has an experimenter. Person number N has the token number N of the
/// [`Guests`](crate::Guests), and moves hand number N. The methods are called on threads of the server, possibly several at once, and must not wait for the
/// real-time side.
pub trait Study: Hands {
    /// Returns the content of the experimenter's page, as a JSON object.
    fn overview(&self) -> Value;

    /// Carries out a command of the experimenter.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the experimenter. Nothing has changed then.
    fn command(&self, wish: &Value) -> Result<(), String>;

    /// Takes a word or answers from a person's page, such as consent or answers to questions.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the person. Nothing has changed then.
    fn tell(&self, person: usize, said: &Value) -> Result<(), String>;
}
