//! Standard output.

use std::io::{self, Write as _};

/// Writes to standard output, to the end.
///
/// # Errors
///
/// The error of the system, also of a standard output that is open for reading alone. The standard library takes one for a place that swallows everything.
#[cfg(unix)]
pub fn print(bytes: &[u8]) -> io::Result<()> {
    use std::os::fd::AsFd as _;
    let mut out = io::stdout().lock();
    out.flush()?;
    // The copy of the descriptor has the errors of the system.
    std::fs::File::from(out.as_fd().try_clone_to_owned()?).write_all(bytes)
}

/// Writes to standard output, to the end.
///
/// # Errors
///
/// The error of the system.
#[cfg(not(unix))]
pub fn print(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()
}
