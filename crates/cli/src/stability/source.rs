//! A scene with keys left open: from arguments to a family, and from its errors to what the user typed.

use std::path::{Path, PathBuf};

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, FamilyError, KeyRange};

use super::rows_file::fingerprint;
use crate::failure::{Failure, not_analysed};
use crate::{input, output};

/// The range that an option gives to a key.
pub(super) fn range(option: &str, text: &str) -> Result<KeyRange, Failure> {
    KeyRange::parse(text).map_err(|error| Failure::Input(format!("{option}: {error}")))
}

/// Where the texts that are put into a scene come from.
pub(super) struct Said<'a> {
    pub(super) file: &'a Path,
    /// Options that leave a key open.
    pub(super) ranges: &'a [(&'static str, KeyRange)],
    /// An option that overrides keys, and what it says.
    pub(super) overrides: (&'static str, &'a [String]),
}

impl Said<'_> {
    /// What went wrong, in the words of the user's options.
    pub(super) fn failure(&self, error: FamilyError) -> Failure {
        match error {
            FamilyError::Scene(error) => {
                let text = error.diagnostic().and_then(cohaptic_scene::Diagnostic::override_text);
                match text.and_then(|text| self.option_of(text)) {
                    Some(option) => Failure::Override { option, error },
                    None => Failure::Scene(error),
                }
            }
            FamilyError::Analysis(error) => not_analysed(self.file, &error),
            error @ (FamilyError::NoNumber { .. }
            | FamilyError::Keys { .. }
            | FamilyError::Twice { .. }
            | FamilyError::Values { .. }
            | FamilyError::Outside { .. }) => {
                let about =
                    |(option, range): &&(&'static str, KeyRange)| error.to_string().starts_with(&format!("{} ", range.key)).then_some(*option);
                match self.ranges.iter().find_map(|range| about(&range)) {
                    Some(option) => Failure::Input(format!("{option}: {error}")),
                    None => Failure::Input(format!("{}: {error}", output::path(input::named(self.file)))),
                }
            }
        }
    }

    /// The option that put this `KEY=VALUE` into the scene; `None` for `--set`.
    fn option_of(&self, text: &str) -> Option<&'static str> {
        let (option, overrides) = self.overrides;
        if overrides.iter().any(|given| given == text) {
            return Some(option);
        }
        let key = text.split('=').next().unwrap_or_default();
        self.ranges.iter().find(|(_, range)| range.key == key).map(|(option, _)| *option)
    }
}

/// What tells the scene at one end of all its keys from others: everything that it says, and that files say which it names.
pub(super) fn fingerprint_of(family: &Family) -> Result<u64, FamilyError> {
    Ok(fingerprint(&format!("{:?}", at_low(family)?)))
}

/// The scene with every open key at its lower end; it does not know the name of its file.
pub(super) fn at_low(family: &Family) -> Result<Scene, FamilyError> {
    let low: Vec<f64> = family.keys().iter().map(|range| range.low).collect();
    let mut scene = family.scene(&low)?;
    scene.file = PathBuf::new();
    Ok(scene)
}
