//! Scene files and relay files as hosts and links.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use cohaptic_scene::{ChangeKind, LinkTable, RelayFile, Scene};
use cohaptic_wan::LinkModel;

use super::{LinkChange, LinkFile, LinkFileError};

impl LinkFile {
    /// Reads the text of a scene file or of a relay file, which has programs.
    pub(super) fn document(text: &str, path: &Path) -> Result<Self, LinkFileError> {
        // What is no TOML at all is refused as a scene, with the place.
        let is_relay = text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("programs") || table.contains_key("relay"));
        if is_relay { Ok(Self::of_relay(RelayFile::parse(text, path, &[])?)) } else { Self::of_scene(Scene::parse(text, path, &[])?, path) }
    }

    fn of_relay(relay: RelayFile) -> Self {
        let hosts = relay.programs.into_iter().map(|program| program.name).collect();
        let change = |change: cohaptic_scene::RelayChange| LinkChange {
            at: change.at,
            from: change.link.from,
            to: change.link.to,
            link: Arc::unwrap_or_clone(change.link.config),
        };
        let changes = relay.timeline.into_iter().map(change).collect();
        Self::of_table(hosts, &relay.links, changes, relay.seed)
    }

    fn of_scene(scene: Scene, path: &Path) -> Result<Self, LinkFileError> {
        let refused = |what: String| Err(LinkFileError::NotLinks { path: path.to_path_buf(), what });
        if let Some(peer) = scene.peers.iter().find(|peer| peer.uplink.is_some() || peer.downlink.is_some()) {
            return refused(format!("peer `{}` has an access line, which a test bed's hosts have not; expected links alone", peer.name));
        }
        let mut changes = Vec::new();
        for change in scene.timeline {
            let at = change.at;
            match change.what {
                ChangeKind::Link(link) => changes.push(LinkChange { at, from: link.from, to: link.to, link: Arc::unwrap_or_clone(link.config) }),
                ChangeKind::AllLinks(table) => changes.extend(pairs(table.peers()).map(|(from, to)| {
                    let link = table.between(from, to).clone();
                    LinkChange { at, from, to, link }
                })),
                // They change what is at the ends of the links.
                ChangeKind::Contact { .. } | ChangeKind::Hand { .. } | ChangeKind::Coordination(_) => {}
            }
        }
        let hosts = scene.peers.into_iter().map(|peer| peer.name).collect();
        Ok(Self::of_table(hosts, &scene.links, changes, scene.seed))
    }

    fn of_table(hosts: Vec<String>, table: &LinkTable, changes: Vec<LinkChange>, seed: u64) -> Self {
        let model = |place: usize| table.configs().get(place).map_or_else(LinkModel::default, |model| (**model).clone());
        let links: BTreeMap<_, _> = table.exceptions().map(|(pair, place)| (pair, model(place))).collect();
        Self { hosts, every: model(table.usual()), links, changes, seed: Some(seed) }
    }
}

fn pairs(hosts: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..hosts).flat_map(move |from| (0..hosts).filter(move |to| *to != from).map(move |to| (from, to)))
}
