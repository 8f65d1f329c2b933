//! Key files: made, read and refused.

use std::fs;

use cohaptic_live::client::Joining;
use cohaptic_live::{KeyFileError, SessionKey, SystemEntropy};

use crate::support::{Counting, SEAT, SESSION};

/// Returns a hello under the key with a fixed nonce. Equal keys give equal hellos; the keys themselves cannot be read from outside the crate.
fn fingerprint(key: &SessionKey) -> Vec<u8> {
    Joining::new(SESSION, SEAT, key, [0; 16]).hello().to_vec()
}

#[test]
fn a_new_key_file_is_its_owners_alone_and_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    let made = SessionKey::generate_to(&path, &mut SystemEntropy).unwrap();
    assert_eq!(fingerprint(&SessionKey::read_from(&path).unwrap()), fingerprint(&made));
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.len(), 65);
    assert!(text.trim_end().bytes().all(|digit| digit.is_ascii_hexdigit()));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
    let again = SessionKey::generate_to(&path, &mut Counting::default()).unwrap_err();
    assert!(matches!(again, KeyFileError::Exists { .. }) && again.to_string().contains("use this key, or name another file"), "{again}");
    assert_eq!(fs::read_to_string(&path).unwrap(), text);
}

#[test]
fn the_digits_are_those_of_the_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    SessionKey::generate_to(&path, &mut Counting::default()).unwrap();
    let expected = (1..=4).map(|number| format!("{number:016x}")).collect::<String>() + "\n";
    assert_eq!(fs::read_to_string(&path).unwrap(), expected);
}

#[cfg(unix)]
#[test]
fn a_file_that_others_may_read_or_write_is_refused_with_the_way_out() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    SessionKey::generate_to(&path, &mut SystemEntropy).unwrap();
    for mode in [0o640, 0o604, 0o620, 0o644, 0o666] {
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        let error = SessionKey::read_from(&path).unwrap_err().to_string();
        assert!(error.contains(&format!("(mode {mode:o})")) && error.contains("chmod 600"), "{error}");
    }
    fs::set_permissions(&path, fs::Permissions::from_mode(0o400)).unwrap();
    SessionKey::read_from(&path).unwrap();
}

#[test]
fn what_is_no_key_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    SessionKey::generate_to(&path, &mut SystemEntropy).unwrap();
    let secret = fs::read_to_string(&path).unwrap();
    for text in ["", "hello", &format!("{secret}{secret}"), &secret[1..]] {
        fs::write(&path, text).unwrap();
        let error = SessionKey::read_from(&path).unwrap_err();
        assert!(matches!(error, KeyFileError::Content { .. }), "{error}");
        assert!(!error.to_string().contains(&secret[..8]), "an error shows nothing of the file");
    }
    assert!(matches!(SessionKey::read_from(folder.path().join("none")).unwrap_err(), KeyFileError::Read { .. }));
}
