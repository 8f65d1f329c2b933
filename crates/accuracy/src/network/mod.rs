//! Laws of delay and models of loss: what a draw costs, and how far what is drawn is from what was asked.

use crate::{AccuracyError, Options, Row, Watch};

/// The rows of this subject.
///
/// # Errors
///
/// As [`crate::measure`].
pub fn rows(_options: Options, _watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    Ok(Vec::new())
}
