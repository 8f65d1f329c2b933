//! The answers of `cargo metadata`.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

use crate::house::root;

/// Without the network if all packages are on this machine.
pub(crate) fn metadata(options: &[&str]) -> Value {
    let ask = |mode: &[&str]| {
        let mut command = Command::new(env!("CARGO"));
        command.current_dir(root()).args(["metadata", "--format-version", "1", "--locked"]).args(mode).args(options).output().unwrap()
    };
    let mut output = ask(&["--offline"]);
    if !output.status.success() {
        output = ask(&[]);
    }
    assert!(output.status.success(), "cargo metadata {options:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

pub(crate) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

pub(crate) fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// Which packages a build of each package takes: those of its tests and examples are left out.
pub(crate) struct Tree {
    names: BTreeMap<String, String>,
    edges: BTreeMap<String, Vec<String>>,
}

impl Tree {
    pub(crate) fn new(metadata: &Value) -> Self {
        let names = list(metadata, "packages").iter().map(|package| (text(package, "id").to_owned(), text(package, "name").to_owned())).collect();
        let is_built = |edge: &&Value| list(edge, "dep_kinds").iter().any(|kind| kind["kind"].is_null() || kind["kind"] == "build");
        let edges = |node: &Value| list(node, "deps").iter().filter(is_built).map(|edge| text(edge, "pkg").to_owned()).collect();
        let edges = list(&metadata["resolve"], "nodes").iter().map(|node| (text(node, "id").to_owned(), edges(node))).collect();
        Self { names, edges }
    }

    /// The names of all packages that a build of this one takes, itself among them.
    pub(crate) fn of(&self, package: &str) -> BTreeSet<&str> {
        let mut left: Vec<&str> = self.names.iter().filter(|(_, name)| *name == package).map(|(id, _)| id.as_str()).collect();
        assert_eq!(left.len(), 1, "{package}");
        let mut found = BTreeSet::new();
        while let Some(id) = left.pop() {
            if found.insert(id) {
                left.extend(self.edges[id].iter().map(String::as_str));
            }
        }
        found.into_iter().map(|id| self.names[id].as_str()).collect()
    }
}
