//! `cohaptic link --list` and `cohaptic link NAME --show`: links of the library, and the source of each number.

use cohaptic_answers::library;
use cohaptic_linkfile::library::{ProfileName, profiles};

use crate::arguments::LinkArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::output;

/// Prints all links of the library, or the one that is named.
pub(super) fn answer(arguments: &LinkArguments) -> Result<(), Failure> {
    if arguments.list {
        return output::answer(arguments.json, DocumentSchema::PROFILES, &library::document(profiles()), library::list, output::NO_FILES);
    }
    let [name] = &arguments.spec[..] else {
        return Err(Failure::Input("--show is for one link of the library: expected a name such as starlink (cohaptic link --list)".to_owned()));
    };
    let name: ProfileName = name.parse().map_err(|error| Failure::Input(format!("--show: {error}")))?;
    let words = || library::words(&name.profile);
    output::answer(arguments.json, DocumentSchema::PROFILES, &library::document([name.profile.clone()]), words, output::NO_FILES)
}
