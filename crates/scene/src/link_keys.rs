//! Keys of the links of a scene, for programs that show and change the keys.

use std::path::Path;

use cohaptic_linkfile::document::Sources;
use cohaptic_linkfile::mesh::LinkClasses;
use cohaptic_linkfile::reading::with_text;
use cohaptic_linkfile::{FileError, KeysOfLinks, LinkSelector};
use cohaptic_units::Instant;

use crate::read::parse_scene;

/// Returns the keys of every directed link at the beginning of a scene file. The keys of an entry `[[links]]` are laid over the keys of `[link]`.
///
/// # Errors
///
/// As [`Scene::read_live`](crate::Scene::read_live).
pub fn link_keys(path: &Path, overrides: &[String]) -> Result<KeysOfLinks, FileError> {
    with_text(path, |text| link_keys_of_text(text, path, overrides))
}

/// Like [`link_keys`], for a scene in a text; `file` as in [`Scene::parse`](crate::Scene::parse).
///
/// # Errors
///
/// As [`Scene::parse_live`](crate::Scene::parse_live).
pub fn link_keys_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<KeysOfLinks, FileError> {
    let mut keys = KeysOfLinks::new();
    let mut beginning = true;
    parse_scene(Sources { file, text, overrides }, true, &mut |_, selector, links: &LinkClasses| {
        // The first call has the links of the beginning. Later calls are changes of the timeline.
        if core::mem::take(&mut beginning) {
            keys = links.keys(selector);
        }
    })?;
    Ok(keys)
}

/// Returns the changes of links in the timeline of a scene: the instant of each change, and all keys of each changed link. In order of time, as in
/// [`Scene::timeline`](crate::Scene::timeline). A change of a live session between two changes of the timeline has no influence on these keys.
///
/// # Errors
///
/// As [`Scene::parse_live`](crate::Scene::parse_live).
pub fn link_key_changes_of_text(text: &str, file: &Path, overrides: &[String]) -> Result<Vec<(Instant, KeysOfLinks)>, FileError> {
    let mut changes = Vec::new();
    let mut beginning = true;
    parse_scene(Sources { file, text, overrides }, true, &mut |at, selector: LinkSelector, links: &LinkClasses| {
        // The first call has the links of the beginning, which are no change.
        if !core::mem::take(&mut beginning) {
            changes.push((at, links.keys(selector)));
        }
    })?;
    Ok(changes)
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::Scene;

    /// A scene with as few keys as possible, to which a test adds links.
    const AROUND: &str = "scene = { duration = \"1s\", count = 2 }\nobject = { mass = 1.0 }\n\
        coordination = { strategy = \"average-position\", stiffness = 1.0, damping = 1.0, update = \"1ms\" }\n\
        peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\n";

    /// The keys of each link make the model of the link in the scene, also after the keys were printed and read back. The scene has links of every kind.
    #[test]
    fn the_keys_of_a_scene_make_its_links() {
        let text = format!(
            "{AROUND}{}",
            r#"
            modulators = [{ name = "cell", states = [{ name = "good", sojourn = "5s", next = "bad" }, { name = "bad", sojourn = "1s", next = "good" }] }]
            [link]
            delay = "24ms"
            jitter = { sd = "2ms", distribution = "pareto" }
            loss = { gilbert-elliott = { p = 0.01, r = 1e-1 } }
            rate = "1Mbit"
            [[links]]
            from = "peer1"
            to = "peer2"
            netem = "delay 20ms 5ms 25% distribution normal loss gemodel 1% 10%"
            [[links]]
            from = "peer2"
            to = "peer1"
            modulated = { by = "cell", good = { delay = "10ms" }, bad = { loss = "50%" } }
            [[links]]
            from = "peer3"
            to = "peer1"
            loss = { packets = [3, "10-19"], every = 100 }
        "#
        )
        .replace("count = 2", "count = 3");
        let overrides = ["links.peer1.peer3.delay=7ms".to_owned()];
        let file = Path::new("x.toml");
        let scene = Scene::parse(&text, file, &overrides).unwrap_or_else(|error| panic!("{error}"));
        let keys = link_keys_of_text(&text, file, &overrides).unwrap();
        assert_eq!(keys.len(), 6);
        for ((from, to), keys) in &keys {
            let folder = Path::new("");
            let expected = scene.links.between(*from, *to);
            assert_eq!(&keys.model(folder).unwrap_or_else(|error| panic!("{error}")), expected, "{from} {to}: {keys}");
            let again = keys.read(&keys.to_string()).unwrap();
            assert_eq!(&again.model(folder).unwrap(), expected, "{keys}");
            assert_eq!(&again, keys);
        }
        assert_eq!(keys[&(0, 2)].get("delay"), Some("\"7ms\""));
        assert_eq!(keys[&(1, 2)].iter().map(|(key, _)| key).collect::<Vec<_>>(), ["delay", "jitter", "loss", "rate"]);
    }

    /// The keys of the timeline make the links that the timeline makes, change after change, also if the file is not in order of time.
    #[test]
    fn the_keys_of_a_timeline_make_its_links() {
        let text = format!(
            "{AROUND}{}",
            r#"
            [link]
            delay = "24ms"
            loss = "1%"
            [[timeline]]
            at = "800ms"
            link = { from = "peer2", to = "peer1" }
            set = { netem = "delay 3ms loss 2%" }
            [[timeline]]
            at = "100ms"
            link = "all"
            set = { delay = "8ms", rate = "1Mbit" }
            [[timeline]]
            at = "500ms"
            peer = "peer1"
            set = { contact = "none" }
        "#
        );
        let file = Path::new("x.toml");
        let scene = Scene::parse(&text, file, &[]).unwrap_or_else(|error| panic!("{error}"));
        let changes = link_key_changes_of_text(&text, file, &[]).unwrap();
        let linked: Vec<_> = scene.timeline.iter().filter(|change| !matches!(change.what, crate::ChangeKind::Contact { .. })).collect();
        assert_eq!((changes.len(), linked.len()), (2, 2));
        for ((at, links), change) in changes.iter().zip(linked) {
            assert_eq!(*at, change.at);
            match &change.what {
                crate::ChangeKind::AllLinks(table) => {
                    assert_eq!(links.len(), 2);
                    assert!(links.iter().all(|((from, to), keys)| keys.model(Path::new("")).unwrap() == *table.between(*from, *to)));
                }
                crate::ChangeKind::Link(link) => {
                    assert_eq!(links.len(), 1);
                    assert_eq!(links[&(link.from, link.to)].model(Path::new("")).unwrap(), *link.config);
                }
                crate::ChangeKind::Contact { .. }
                | crate::ChangeKind::Hand { .. }
                | crate::ChangeKind::HandTorque { .. }
                | crate::ChangeKind::Coordination(_)
                | crate::ChangeKind::RotationalGains(_)
                | crate::ChangeKind::Parameters(_)
                | crate::ChangeKind::SendWhen(_) => panic!("{change:?}"),
            }
        }
    }
}
