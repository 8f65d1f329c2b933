//! Scene files as hosts and links.

use std::path::Path;
use std::sync::Arc;

use cohaptic_linkfile::mesh::pairs;
use cohaptic_scene::{ChangeKind, Scene};
use cohaptic_wan::{LinkConfig, LinkModel};

use super::{LinkFile, LinkFileError};
use crate::access::AccessLines;
use crate::link::LinkChange;

/// Returns whether a text is a relay file. A text that is no TOML counts as a scene file, because the parser of scenes reports the place of the error.
pub(super) fn is_relay(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("programs") || table.contains_key("relay"))
}

/// Returns whether a line may copy packets.
fn may_copy(line: &LinkModel) -> bool {
    let copies = |config: &LinkConfig| !config.duplication.is_never();
    match line {
        LinkModel::Fixed(config) => copies(config),
        LinkModel::Modulated(modulated) => modulated.configs().iter().any(copies),
        LinkModel::Replay(_) | LinkModel::Kernel(_) => true,
    }
}

impl LinkFile {
    pub(super) fn of_scene(scene: Scene, path: &Path) -> Result<Self, LinkFileError> {
        let refused = |what: String| Err(LinkFileError::NotLinks { path: path.to_path_buf(), what });
        // The numbers of copies assume that a single line of a path copies: the link.
        let copied = |line: &Option<Arc<LinkModel>>| line.as_deref().is_some_and(may_copy);
        if let Some(peer) = scene.peers.iter().find(|peer| copied(&peer.uplink) || copied(&peer.downlink)) {
            return refused(format!(
                "an access line of peer `{}` copies packets; expected an access line without duplicate, netem and replay",
                peer.name
            ));
        }
        if scene.topology.is_some() {
            return refused(
                "the scene has a [topology], and a test bed has links from each host to every other host; expected kind = \"full\"".to_owned(),
            );
        }
        let mut changes = Vec::new();
        for change in scene.timeline {
            let at = change.at;
            match change.what {
                ChangeKind::Link(link) => changes.push(LinkChange { at, from: link.from, to: link.to, link: Arc::unwrap_or_clone(link.config) }),
                // A test bed changes links one by one, so one change becomes a change of every pair.
                ChangeKind::AllLinks(table) => changes.extend(pairs(table.peers()).map(|(from, to)| {
                    let link = table.between(from, to).clone();
                    LinkChange { at, from, to, link }
                })),
                // These changes concern the peers at the ends of the links. A test bed has programs there.
                ChangeKind::Contact { .. }
                | ChangeKind::Hand { .. }
                | ChangeKind::HandTorque { .. }
                | ChangeKind::Coordination(_)
                | ChangeKind::RotationalGains(_)
                | ChangeKind::Parameters(_)
                | ChangeKind::SendWhen(_) => {}
            }
        }
        let model = |line: &Option<Arc<LinkModel>>| line.as_deref().cloned();
        let lines = scene.peers.iter().map(|peer| AccessLines { uplink: model(&peer.uplink), downlink: model(&peer.downlink) });
        let access = lines.enumerate().filter(|(_, lines)| *lines != AccessLines::default()).collect();
        let hosts = scene.peers.into_iter().map(|peer| peer.name).collect();
        Ok(Self { access, ..Self::of_table(hosts, &scene.links, changes, scene.seed) })
    }
}
