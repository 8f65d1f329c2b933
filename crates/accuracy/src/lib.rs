//! Speed against error: the cost and the error of every method of the program, on the same work.
//!
//! Use this crate if you choose between the methods of this project by their cost and their error. The crate needs Linux.
//!
//! [`measure`] returns [`Row`]s, one for each method at each setting. A cost is measured as processor time of the measuring thread, unless its unit says
//! otherwise, and differs from run to run. An error is computed against a reference named in the row, and is the same in every run, unless the row says that
//! the error was measured too.
//!
//! [`text`], [`csv`], [`plots`] and [`html`] present rows, and use nothing but the rows. The program `cohaptic-accuracy` of this package measures, prints and
//! writes rows.
//!
//! The crate does not rank the methods: a ranking depends on the acceptable error, and the rows show cost and error for the reader's own choice.
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

/// Amount of work of a measurement.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// Fewer settings and less work per row: under one minute for all subjects, instead of under ten minutes.
    pub quick: bool,
}

impl Options {
    fn of<T>(self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }
}

/// Measures the subjects `subjects`, in the order of [`Subject::ALL`].
///
/// # Errors
///
/// [`AccuracyError::Stopped`] if `watch` asks for the end. Any other error means that a scene of this crate cannot be read or run, which is a fault of this
/// crate, or that the system refuses to wait.
pub fn measure(subjects: &[Subject], options: Options, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut rows = Vec::new();
    for subject in Subject::ALL.into_iter().filter(|subject| subjects.contains(subject)) {
        rows.extend(match subject {
            Subject::Motion => motion::rows(options, watch),
            Subject::Rotation => rotation::rows(options, watch),
            Subject::Time => time::rows(options, watch),
            Subject::Network => network::rows(options.of(network::Effort::FULL, network::Effort::QUICK), watch),
            Subject::Analysis => analysis::rows(options.of(analysis::Effort::FULL, analysis::Effort::QUICK), watch),
            Subject::RealTime => real_time::rows(options.of(real_time::Effort::FULL, real_time::Effort::QUICK), watch),
        }?);
    }
    Ok(rows)
}
