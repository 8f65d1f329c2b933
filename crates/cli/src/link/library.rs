//! `cohaptic link NAME --show`: a link of the library with its sources.

use cohaptic_answers::library;
use cohaptic_linkfile::library::ProfileName;

use crate::failure::Failure;

/// Returns the link of the library that `spec` names, with the source of each number.
pub(super) fn shown(spec: &[String]) -> Result<String, Failure> {
    let [name] = spec else {
        return Err(Failure::Input("--show is for one link of the library: expected a name such as starlink (cohaptic link --list)".to_owned()));
    };
    let name: ProfileName = name.parse().map_err(|error| Failure::Input(format!("--show: {error}")))?;
    Ok(library::words(&name.profile))
}
