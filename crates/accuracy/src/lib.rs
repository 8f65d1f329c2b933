//! Speed against error: what every method of the program costs, and how wrong it is, on the same work.
//!
//! You need it if you choose between the methods of this project by their cost and their error. It needs Linux.
//!
//! [`measure`] gives [`Row`]s, one for each method at each setting. A cost is measured (processor time of the measuring thread, unless its unit says
//! otherwise) and differs from run to run; an error is computed against a reference that is named in the row, and is the same every time unless the row
//! says that it was measured too.
//!
//! [`text`], [`csv`], [`plots`] and [`html`] show rows, and look at nothing but them. The program `cohaptic-accuracy` of this package measures, prints and writes them.
//!
//! It does not say which method is best: that depends on the error that one can live with, and this is what the rows are for.
//! ```
//! use cohaptic_accuracy::{Options, Subject, Unwatched, measure, text};
//!
//! let rows = measure(&[Subject::Time], Options { quick: true }, &Unwatched)?;
//! let events = rows.iter().find(|row| row.method.contains("events")).expect("the method of this program is among them");
//! assert!(events.cost.is_some());
//! println!("{}", text(&rows));
//! # Ok::<(), cohaptic_accuracy::AccuracyError>(())
//! ```

pub mod analysis;
mod cost;
mod csv;
mod error;
mod groups;
mod html;
pub mod motion;
pub mod network;
mod numbers;
mod plots;
pub mod real_time;
pub mod rotation;
mod row;
mod subject;
mod text;
pub mod time;
mod watch;

pub use csv::csv;
pub use error::AccuracyError;
pub use html::{About, html};
pub use numbers::short;
pub use plots::{Plot, plots};
pub use row::Row;
pub use subject::Subject;
pub use text::text;
pub use watch::{Unwatched, Watch};

/// How closely everything is looked at.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// Fewer settings and less work a row: under a minute for everything, instead of under ten.
    pub quick: bool,
}

impl Options {
    fn of<T>(self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }
}

/// Measures those subjects, in the order of [`Subject::ALL`].
///
/// # Errors
///
/// [`AccuracyError::Stopped`] if `watch` asks for it; another one if a scene of this crate cannot be read or run, which would be a fault of this crate.
pub fn measure(subjects: &[Subject], options: Options, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut rows = Vec::new();
    for subject in Subject::ALL.into_iter().filter(|subject| subjects.contains(subject)) {
        rows.extend(subject.rows(options, watch)?);
    }
    Ok(rows)
}
