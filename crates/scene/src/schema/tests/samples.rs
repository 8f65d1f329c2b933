//! Sample files in which every table of the catalogue occurs.

use std::path::{Path, PathBuf};

use cohaptic_linkfile::router::RouterFile;
use cohaptic_linkfile::{ExecFile, RelayFile, TcpRelayFile};

use crate::schema::FileSchema;
use crate::{Scene, SceneError, scene_files};

/// Files with every table and every key that the shipped scenes leave out. `python/tests/test_schema.py` reads them too, and takes the kind of a file from
/// the begin of its name.
const TEXTS: [(FileSchema, &str); 10] = [
    (FileSchema::Scene, include_str!("samples/scene-parts.toml")),
    (FileSchema::Scene, include_str!("samples/scene-links.toml")),
    (FileSchema::Scene, include_str!("samples/scene-tables.toml")),
    (FileSchema::Scene, include_str!("samples/scene-turning.toml")),
    (FileSchema::Scene, include_str!("samples/scene-path.toml")),
    (FileSchema::Relay, include_str!("samples/relay.toml")),
    (FileSchema::RelayTcp, include_str!("samples/relay-tcp.toml")),
    (FileSchema::Router, include_str!("samples/router-tun.toml")),
    (FileSchema::Router, include_str!("samples/router-interfaces.toml")),
    (FileSchema::Exec, include_str!("samples/exec.toml")),
];

/// A text of a kind of file, and the path under which the text is read.
pub(super) struct Sample {
    pub(super) kind: FileSchema,
    pub(super) path: PathBuf,
    pub(super) text: String,
}

pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the texts above, the data of the integration tests of this crate, and every shipped scene.
pub(super) fn samples() -> Vec<Sample> {
    let of = |(kind, text): (FileSchema, &str)| Sample { kind, path: root().join("scenarios/network/sample.toml"), text: text.to_owned() };
    let mut samples: Vec<Sample> = TEXTS.map(of).into();
    let mut files = scene_files(&root().join("scenarios")).unwrap();
    files.push(root().join("crates/scene/tests/integration/data/every-key.toml"));
    samples.extend(files.into_iter().map(|path| Sample { kind: FileSchema::Scene, text: std::fs::read_to_string(&path).unwrap(), path }));
    samples
}

/// Reads a sample and returns its content as text. Samples with equal content give equal texts.
pub(super) fn read(sample: &Sample, overrides: &[String]) -> Result<String, SceneError> {
    let (text, path) = (&sample.text, &sample.path);
    match sample.kind {
        FileSchema::Scene => Scene::parse(text, path, overrides).map(|scene| format!("{scene:?}")),
        FileSchema::Relay => RelayFile::parse(text, path, overrides).map(|relay| format!("{relay:?}")),
        FileSchema::Exec => ExecFile::parse(text, path, overrides).map(|exec| format!("{exec:?}")),
        FileSchema::RelayTcp => TcpRelayFile::parse(text, path, overrides).map(|relay| {
            // Configurations of the streams, not their keys as written, which a relay keeps for live control.
            let streams: Vec<_> =
                relay.proxies.iter().map(|proxy| (&proxy.name, proxy.listen, proxy.to, &proxy.forth.config, &proxy.back.config)).collect();
            format!("{:?} {:?} {:?} {:?} {streams:?}", relay.title, relay.seed, relay.most_bytes, relay.tolerance)
        }),
        FileSchema::Router => RouterFile::parse(text, path, overrides).map(|router| {
            // The models of the links, not their keys as written, which a router keeps for live control.
            let links: Vec<_> = router.links.iter().map(|link| (&link.name, &link.model)).collect();
            format!("{:?} {:?} {:?} {:?} {links:?} {:?} {:?}", router.seed, router.memory, router.left, router.right, router.rules, router.default)
        }),
    }
}
