//! Version of a service, and the words that depend on the version.

use core::fmt;

/// Major and minor version of an Inverse Service.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Version {
    /// Major version.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
}

impl Version {
    /// Returns the version of a response to `GET /version`, head and body together. `None` without a readable `project_version`.
    ///
    /// The key is searched in the text: whether the body is chunked, and which keys surround the version, differs between services.
    #[must_use]
    pub fn of_response(text: &str) -> Option<Self> {
        let (_, rest) = text.split_once("\"project_version\"")?;
        let mut parts = rest.split_once(':')?.1.trim_start().strip_prefix('"')?.split('"').next()?.split('.');
        let mut number = || parts.next()?.trim_start_matches('v').parse().ok();
        Some(Self { major: number()?, minor: number()? })
    }

    /// Returns the words of this version.
    #[must_use]
    pub fn format(self) -> Format {
        if self < (Self { major: 3, minor: 5 }) { Format::V31 } else { Format::V35 }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// Words that depend on the version of a service.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Format {
    /// Before 3.5: a force is in `values`, and a device has no preset.
    V31,
    /// From 3.5 on: a force is in `vector`, and a preset sets the origin.
    #[default]
    V35,
}

impl Format {
    /// Returns the key of a force in a command.
    #[must_use]
    pub const fn force_key(self) -> &'static str {
        match self {
            Self::V31 => "values",
            Self::V35 => "vector",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_found_in_responses() {
        let response = "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n{\"project_version\": \"3.5.2\", \"build\": 7}";
        assert_eq!(Version::of_response(response), Some(Version { major: 3, minor: 5 }));
        assert_eq!(Version::of_response("{\"data\":{\"project_version\":\"v3.1\"}}"), Some(Version { major: 3, minor: 1 }));
        for text in ["", "{}", "\"project_version\"", "\"project_version\": 3", "\"project_version\": \"new\"", "\"project_version\": \"3\""] {
            assert_eq!(Version::of_response(text), None, "{text}");
        }
    }

    #[test]
    fn words_change_with_3_5() {
        let words = |major, minor| Version { major, minor }.format().force_key();
        assert_eq!([words(3, 0), words(3, 4), words(3, 5), words(3, 10), words(4, 0)], ["values", "values", "vector", "vector", "vector"]);
    }
}
