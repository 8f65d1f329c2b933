//! Possible scenes, relay files and router files: files with names that end in `.toml`, and folders, which may hold such files.

use std::path::Path;

use super::Offer;

/// Returns the paths that begin with `typed`, sorted. Folders end in a slash. Hidden files are left out unless the name typed so far begins with a dot.
pub(super) fn offers(typed: &str) -> Vec<Offer> {
    let (folder, name) = typed.rfind('/').map_or(("", typed), |slash| typed.split_at(slash + 1));
    let Ok(entries) = std::fs::read_dir(if folder.is_empty() { Path::new(".") } else { Path::new(folder) }) else { return Vec::new() };
    let mut offers: Vec<Offer> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            // A name that is not UTF-8 cannot be compared with the typed text, and a name with a line break would read as two names.
            let own = entry.file_name().into_string().ok().filter(|own| !own.contains(char::is_control))?;
            if !own.starts_with(name) || (own.starts_with('.') && !name.starts_with('.')) {
                return None;
            }
            // `is_dir` follows symbolic links, so that a link to a folder counts as a folder.
            let is_folder = entry.path().is_dir();
            (is_folder || own.ends_with(".toml")).then(|| Offer { text: format!("{folder}{own}{}", if is_folder { "/" } else { "" }), about: "" })
        })
        .collect();
    // The order in which a system lists files is not defined.
    offers.sort_by(|a, b| a.text.cmp(&b.text));
    offers
}
