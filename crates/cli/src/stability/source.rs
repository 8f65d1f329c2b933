//! Parses the ranges of open keys from arguments, and translates errors of a family of scenes to the user's options.

use std::path::{Path, PathBuf};

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, FamilyError, KeyRange};

use super::rows_file::fingerprint;
use crate::failure::{Failure, not_analysed};
use crate::{input, output};

/// Parses the range of a key from the text of `option`. The failure names the option.
pub(super) fn range(option: &str, text: &str) -> Result<KeyRange, Failure> {
    KeyRange::parse(text).map_err(|error| Failure::Input(format!("{option}: {error}")))
}

/// Origins of the texts in a scene: the file and the options of the user.
pub(super) struct Said<'a> {
    pub(super) file: &'a Path,
    /// Options with an open key, each with the parsed range.
    pub(super) ranges: &'a [(&'static str, KeyRange)],
    /// Option of the overrides, with the `KEY=VALUE` texts.
    pub(super) overrides: (&'static str, &'a [String]),
}

impl Said<'_> {
    /// Converts an error of the family to a failure with the name of the user's option, or of the scene file if no option is the cause.
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
            | FamilyError::Outside { .. }
            | _) => {
                // Errors about a range begin with the key of the range, so that the key finds the option.
                let about =
                    |(option, range): &&(&'static str, KeyRange)| error.to_string().starts_with(&format!("{} ", range.key)).then_some(*option);
                match self.ranges.iter().find_map(|range| about(&range)) {
                    Some(option) => Failure::Input(format!("{option}: {error}")),
                    None => Failure::Input(format!("{}: {error}", output::path(input::named(self.file)))),
                }
            }
        }
    }

    /// Returns the option of the `KEY=VALUE` text; `None` for `--set`.
    fn option_of(&self, text: &str) -> Option<&'static str> {
        let (option, overrides) = self.overrides;
        if overrides.iter().any(|given| given == text) {
            return Some(option);
        }
        let key = text.split('=').next().unwrap_or_default();
        self.ranges.iter().find(|(_, range)| range.key == key).map(|(option, _)| *option)
    }
}

/// Returns a fingerprint of the scene with every open key at its lower end. The fingerprint covers all parsed values, content of named files included.
pub(super) fn fingerprint_of(family: &Family) -> Result<u64, FamilyError> {
    Ok(fingerprint(&format!("{:?}", at_low(family)?)))
}

/// Returns the scene with every open key at its lower end. The path of the scene's file is cleared, so that the file's place does not change fingerprints.
pub(super) fn at_low(family: &Family) -> Result<Scene, FamilyError> {
    let low: Vec<f64> = family.keys().iter().map(|range| range.low).collect();
    let mut scene = family.scene(&low)?;
    scene.file = PathBuf::new();
    Ok(scene)
}
