//! Relay files as hosts and links.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use cohaptic_linkfile::{LinkTable, RelayChange, RelayFile};
use cohaptic_wan::LinkModel;

use super::{LinkFile, LinkFileError};
use crate::link::LinkChange;

impl LinkFile {
    /// Parses the text of a relay file or, with the feature `scenes`, of a scene file. Only a relay file has programs.
    pub(super) fn document(text: &str, path: &Path) -> Result<Self, LinkFileError> {
        #[cfg(feature = "scenes")]
        if !super::scene::is_relay(text) {
            return Self::of_scene(cohaptic_scene::Scene::parse(text, path, &[])?, path);
        }
        Ok(Self::of_relay(RelayFile::parse(text, path, &[])?))
    }

    fn of_relay(relay: RelayFile) -> Self {
        let hosts = relay.programs.into_iter().map(|program| program.name).collect();
        let change = |RelayChange { at, link }: RelayChange| LinkChange { at, from: link.from, to: link.to, link: Arc::unwrap_or_clone(link.config) };
        let changes = relay.timeline.into_iter().map(change).collect();
        Self::of_table(hosts, &relay.links, changes, relay.seed)
    }

    pub(super) fn of_table(hosts: Vec<String>, table: &LinkTable, changes: Vec<LinkChange>, seed: u64) -> Self {
        let model = |place: usize| table.configs().get(place).map_or_else(LinkModel::default, |model| (**model).clone());
        let links: BTreeMap<_, _> = table.exceptions().map(|(pair, place)| (pair, model(place))).collect();
        Self { hosts, devices: Vec::new(), every: model(table.usual()), links, changes, access: BTreeMap::new(), hits: Vec::new(), seed: Some(seed) }
    }
}
