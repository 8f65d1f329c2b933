//! Files that have their name only when they are whole.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

/// Writes a file, and the folder that it lies in.
pub(crate) fn write(path: &Path, content: &str) -> Result<(), String> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let put = || -> io::Result<()> {
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let mut file = File::create(&partial)?;
        file.write_all(content.as_bytes())?;
        file.sync_all()?;
        fs::rename(&partial, path)
    };
    put().map_err(|error| {
        // It may not even be there; what is told is why the page could not be written.
        drop(fs::remove_file(&partial));
        format!("cannot write {}: {error}", path.display())
    })
}
