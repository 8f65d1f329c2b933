//! Names of links of the library: `starlink@1/down`.

use core::fmt;
use core::str::FromStr;

use super::{Direction, Profile, names, profile};
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
        let (name, version) = text.split_once('@').map_or((text, None), |(name, version)| (name, Some(version)));
        let Some(profile) = profile(name) else {
            return Err(NameError(format!("no link of the library is called {}: expected {}", crate::document::quote(name), one_of(names(), name))));
        };
        // There is one version of each profile so far. A further version gets a file of its own, and stands beside the first one for ever.
        if version.is_some_and(|version| version.parse() != Ok(profile.version)) {
            let version = crate::document::quote(version.unwrap_or_default());
            return Err(NameError(format!("{name} has no version {version}: expected {}", profile.title())));
        }
        Ok(Self { profile, direction })
    }
}

impl ProfileName {
    /// Returns the direction of the name. A name without direction stands for both directions of a symmetric profile.
    ///
    /// # Errors
    ///
    /// [`NameError`] if the name has no direction and the directions of the profile differ.
    pub fn one_direction(&self) -> Result<Direction, NameError> {
        let name = &self.profile.name;
        match self.direction {
            Some(direction) => Ok(direction),
            // Either direction is right for a symmetric profile, and the answer must not depend on which one a caller prefers.
            None if self.profile.is_symmetric() => Ok(Direction::Down),
            None => Err(NameError(format!("{name} differs by direction: expected {name}/down, towards the user, or {name}/up"))),
        }
    }
}
