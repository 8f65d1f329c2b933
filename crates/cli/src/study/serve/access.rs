//! Secrets of a group under way, in a file that only its owner may read. Browsers connect again after a crash because port and tokens are those of before.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use cohaptic_control::Token;
use cohaptic_study::GroupCode;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

const NAME: &str = "access.json";
/// Longest accepted file \[byte\]. Tokens of a hundred people take 30 kB.
const LARGEST: u64 = 1 << 20;

/// Access of a group under way.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(super) struct Access {
    pub(super) group: GroupCode,
    pub(super) port: u16,
    /// Token of the experimenter.
    pub(super) experimenter: String,
    /// Tokens of the people, indexed by seat.
    pub(super) people: Vec<String>,
}

/// File with the access of the group under way. The file is removed at the end of the group.
#[derive(Debug)]
pub(super) struct AccessFile(PathBuf);

impl AccessFile {
    pub(super) fn of(folder: &Path) -> Self {
        Self(folder.join(NAME))
    }

    /// Reads the file. `None` if the file does not exist, or is not one that this program wrote: then browsers must be given new addresses.
    pub(super) fn read(&self) -> Option<Access> {
        let text = cohaptic_files::read_text_up_to(&self.0, LARGEST).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// Writes the file. A crash leaves the old file or the new one.
    pub(super) fn write(&self, access: &Access) -> Result<(), Failure> {
        let text = serde_json::to_string(access).expect("numbers and texts can be written");
        let partial = self.0.with_extension("partial");
        let write = || {
            // A file that a crash left may have other permissions.
            match fs::remove_file(&partial) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                Ok(()) | Err(_) => {}
            }
            let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&partial)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()?;
            fs::rename(&partial, &self.0)
        };
        write().map_err(|error| Failure::File { verb: "write", path: self.0.clone(), error })
    }

    pub(super) fn remove(&self) {
        // A file that stays has tokens that no server knows any more.
        let _ = fs::remove_file(&self.0);
    }
}

/// Returns the tokens of the texts; `None` if one is not a token.
pub(super) fn tokens(texts: &[String]) -> Option<Vec<Token>> {
    texts.iter().map(|text| text.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn only_the_owner_reads_what_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let file = AccessFile::of(folder.path());
        assert_eq!(file.read(), None);
        let mut access =
            Access { group: GroupCode::of_index(2), port: 8080, experimenter: Token::random().unwrap().secret().to_owned(), people: Vec::new() };
        for _ in 0..2 {
            access.people.push(Token::random().unwrap().secret().to_owned());
            file.write(&access).unwrap_or_else(|error| panic!("{error:?}"));
            assert_eq!(file.read().as_ref(), Some(&access));
        }
        assert_eq!(tokens(&access.people).unwrap().len(), 2);
        assert!(tokens(&["short".to_owned()]).is_none());
        let mode = fs::metadata(folder.path().join(NAME)).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        fs::write(folder.path().join(NAME), "{\"group\":").unwrap();
        assert_eq!(file.read(), None);
        file.remove();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
