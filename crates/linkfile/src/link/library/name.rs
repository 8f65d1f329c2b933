//! Names of links of the library: `starlink@1/down`.

use core::fmt;
use core::str::FromStr;

use super::{Direction, FILES, File, Profile, find, names};
use crate::document::quote;
use crate::reading::one_of;

/// Name of a profile, perhaps with a version and a direction, such as `starlink`, `starlink/up` or `wpt/cable@1/down`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ProfileName {
    /// Profile with this name and version.
    pub profile: Profile,
    /// Direction, if the name has one.
    pub direction: Option<Direction>,
}

/// Reason for which a name is refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NameError(String);

impl fmt::Display for NameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl core::error::Error for NameError {}

impl FromStr for ProfileName {
    type Err = NameError;

    fn from_str(text: &str) -> Result<Self, NameError> {
        // Only the last part can be a direction: the names of tools' tables have a slash too.
        let (text, direction) = match text.rsplit_once('/') {
            Some((rest, "down")) => (rest, Some(Direction::Down)),
            Some((rest, "up")) => (rest, Some(Direction::Up)),
            _ => (text, None),
        };
        let profile = version_of(&FILES, text)?;
        Ok(Self { profile, direction })
    }
}

/// Returns the profile of a name with or without a version. A bare name is version 1 for ever.
fn version_of(files: &[File<'_>], text: &str) -> Result<Profile, NameError> {
    let (name, version) = text.split_once('@').unwrap_or((text, "1"));
    if let Some(profile) = version.parse().ok().and_then(|version| find(files, name, version)) {
        return Ok(profile);
    }
    let known: Vec<String> = files.iter().filter(|(known, ..)| *known == name).map(|(name, version, _)| format!("{name}@{version}")).collect();
    if known.is_empty() {
        return Err(NameError(format!("no link of the library is called {}: expected {}", quote(name), one_of(names(), name))));
    }
    Err(NameError(format!("{name} has no version {}: expected {}", quote(version), known.join(" or "))))
}

/// Returns a note on a newer version of a profile, if there is one.
fn note_of(files: &[File<'_>], profile: &Profile) -> Option<String> {
    let newest = files.iter().filter(|(name, ..)| *name == profile.name).map(|(_, version, _)| *version).max()?;
    let Profile { name, .. } = profile;
    (newest > profile.version)
        .then(|| format!("there is a newer version, {name}@{newest}; this is {}, and {name} alone is always {name}@1", profile.title()))
}

impl Profile {
    /// Returns a note on a newer version of the profile, or `None` if this is the newest one.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        note_of(&FILES, self)
    }
}

impl ProfileName {
    /// Returns the direction of the name. A name without direction stands for both directions of a symmetric profile.
    ///
    /// # Errors
    ///
    /// [`NameError`] if the name has no direction and the directions of the profile differ.
    pub(crate) fn one_direction(&self) -> Result<Direction, NameError> {
        let name = &self.profile.name;
        match self.direction {
            Some(direction) => Ok(direction),
            // Either direction is right for a symmetric profile, and the answer must not depend on which one a caller prefers.
            None if self.profile.is_symmetric() => Ok(Direction::Down),
            None => Err(NameError(format!("{name} differs by direction: expected {name}/down, towards the user, or {name}/up"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A library whose link has got a second version: a bare name is the first one, and a note tells of the second.
    #[test]
    fn a_bare_name_is_the_first_version_and_a_note_tells_of_newer_ones() {
        let [(name, version, text)] = FILES.into_iter().filter(|(name, ..)| *name == "cable").collect::<Vec<_>>()[..] else { panic!() };
        let second = text.replace("version = 1", "version = 2");
        let files = [(name, version, text), (name, 2, second.as_str())];
        let title = |text: &str| version_of(&files, text).map(|profile| profile.title());
        assert_eq!(
            (title("cable"), title("cable@1"), title("cable@2")),
            (Ok("cable@1".to_owned()), Ok("cable@1".to_owned()), Ok("cable@2".to_owned()))
        );
        assert_eq!(title("cable@3").unwrap_err().to_string(), "cable has no version \"3\": expected cable@1 or cable@2");
        let note = |text: &str| note_of(&files, &version_of(&files, text).unwrap());
        assert_eq!(note("cable").as_deref(), Some("there is a newer version, cable@2; this is cable@1, and cable alone is always cable@1"));
        assert_eq!(note("cable@2"), None);
    }

    #[test]
    fn files_have_the_versions_of_the_list() {
        for (name, version, _) in FILES {
            assert_eq!(find(&FILES, name, version).unwrap().title(), format!("{name}@{version}"));
        }
    }
}
