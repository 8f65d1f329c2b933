//! Devices that are refused before they are opened, so that the tests need no privileges.

use std::path::Path;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::Pacing;
use cohaptic_router::{Failed, Router};

/// Opens a router between two loopback interfaces and returns the refusal. The loopback interface exists in each namespace and carries no Ethernet, so a
/// refusal for another reason shows that the interface was not opened.
fn refused(left: &str, right: &str) -> (Side, Failed) {
    let text = format!("router = {{ default = \"pass\" }}\nleft = {{ interface = \"lo\"{left} }}\nright = {{ interface = \"lo\"{right} }}\n");
    let file = RouterFile::parse(&text, Path::new("router.toml"), &[]).unwrap();
    let error = Router::open(&file, Pacing::Sleep).unwrap_err();
    (error.side, error.failed)
}

#[test]
fn one_device_is_refused_by_whatever_name_its_namespace_is_called() {
    let here = [", namespace = \"/proc/self/ns/net\"", ", namespace = \"/proc/thread-self/ns/net\"", ""];
    for (left, right) in [(here[0], here[1]), (here[0], here[2]), (here[2], here[1])] {
        let (side, failed) = refused(left, right);
        assert!(side == Side::Right && matches!(failed, Failed::SameDevice), "{left} {right}: {failed}");
    }
    // The message names a namespace that cannot be opened, and no device is opened.
    let (_, failed) = refused("", ", namespace = \"/no/such/namespace\"");
    assert!(matches!(failed, Failed::System { .. }) && failed.to_string().contains("/no/such/namespace"), "{failed}");
}
