//! Writing to standard output, with every error reported.

use std::io::{self, Write as _};

/// Writes all bytes to standard output, without buffering.
///
/// # Errors
///
/// The system's error, including `EBADF` for a standard output that is not open for writing. The standard library ignores `EBADF` and drops the bytes.
#[cfg(unix)]
pub fn print(bytes: &[u8]) -> io::Result<()> {
    use std::os::fd::AsFd as _;
    let mut out = io::stdout().lock();
    // Text printed earlier with `print!` must come first.
    out.flush()?;
    // `Stdout` hides `EBADF`; a `File` on a copy of the descriptor does not.
    std::fs::File::from(out.as_fd().try_clone_to_owned()?).write_all(bytes)
}

/// Writes all bytes to standard output.
///
/// # Errors
///
/// The system's error.
#[cfg(not(unix))]
pub fn print(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()
}
