//! Workspace of the user: the version of tokio, and the source of the test kit.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::cargo::metadata;
use crate::failure::Failure;
use crate::file::read_text;

/// Folder for all files written by these commands.
const FOLDER: &str = "target/cohaptic";

/// Folder in which the workspace with the tests is looked for.
const SIM: &str = "sim";

/// Environment variable with the folder of the test kit, for workspaces that do not depend on the test kit.
const KIT: &str = "COHAPTIC_TESTKIT";

/// Minor version of the oldest tokio 1 that the package can replace.
const OLDEST: u32 = 47;

/// Workspace whose programs are tested.
#[derive(Debug)]
pub(super) struct Workspace {
    /// Folder of the workspace.
    pub(super) root: PathBuf,
    /// Folder of the workspace with the tests. May be equal to `root`.
    sim: PathBuf,
    /// Source of the test kit, as keys of an inline table of TOML.
    pub(super) kit: String,
    /// Sources of the packages beside the test kit on which the package `tokio` depends.
    pub(super) beside: Beside,
}

/// Sources of packages beside the test kit, equal to the source of the test kit, as keys of an inline table of TOML.
#[derive(Default, Debug)]
pub(super) struct Beside {
    pub(super) sockets: String,
    pub(super) descriptors: String,
    pub(super) libc: String,
    /// `true` if calls of the system are caught, by the feature `symbols` of `cohaptic-libc`.
    pub(super) catches_calls: bool,
}

impl Workspace {
    /// Finds the workspace of the current folder. `sim` is the folder of the workspace with the tests, below the current folder.
    pub(super) fn here(sim: Option<&Path>) -> Result<Self, Failure> {
        let here = std::env::current_dir().map_err(|error| Failure::System(format!("the current folder cannot be found: {error}")))?;
        let own = metadata(&here, &["--no-deps"], "the workspace cannot be read")?;
        let root = PathBuf::from(own["workspace_root"].as_str().unwrap_or_default());
        let sim = match sim {
            Some(sim) => here.join(sim),
            None if root.join(SIM).join("Cargo.toml").exists() => root.join(SIM),
            None => root.clone(),
        };
        // `cargo metadata` takes a noticeable time, so one workspace is read once.
        let tests = if sim == root { own } else { metadata(&sim, &["--no-deps"], "the workspace with the tests cannot be read")? };
        let sim = PathBuf::from(tests["workspace_root"].as_str().unwrap_or_default());
        let named = std::env::var(KIT).ok().map(|path| json!({ "path": path, "features": ["facade"], "uses_default_features": true }));
        let Some(kit) = dependency(&tests, "cohaptic-testkit").or(named.as_ref()) else {
            return Err(Failure::Input(format!(
                "no package of {} depends on cohaptic-testkit: expected it among the [dev-dependencies] of the package with the tests, with features = [\"facade\"]; \
                 --sim FOLDER names another workspace, and the variable {KIT} the folder of the test kit for tests that know of no test bed",
                sim.display()
            )));
        };
        if !has_feature(kit, "facade") {
            return Err(Failure::Input(format!(
                "the dependency on cohaptic-testkit in {} lacks its feature `facade`: expected features = [\"facade\"]",
                sim.display()
            )));
        }
        // The feature `libc` of the test kit is a default feature without code, so that calls of the system are caught unless a workspace leaves the default
        // features out. A feature that switches the calls off would not do, because cargo adds up the features of all dependents.
        let catches_calls = kit["uses_default_features"] != false || has_feature(kit, "libc");
        let beside =
            Beside { sockets: source(kit, "../sockets")?, descriptors: source(kit, "../descriptors")?, libc: source(kit, "../libc")?, catches_calls };
        Ok(Self { root, sim, kit: source(kit, ".")?, beside })
    }

    /// Returns the folder for all written files.
    pub(super) fn folder(&self) -> PathBuf {
        self.root.join(FOLDER)
    }

    /// Returns the path of the package for the manifest of the workspace with the tests.
    pub(super) fn patch(&self, package: &Path) -> String {
        match (self.sim.strip_prefix(&self.root), package.strip_prefix(&self.root)) {
            (Ok(down), Ok(package)) => down.components().map(|_| PathBuf::from("..")).collect::<PathBuf>().join(package),
            _ => package.to_owned(),
        }
        .display()
        .to_string()
        .replace('\\', "/")
    }

    pub(super) fn lock_file(&self) -> PathBuf {
        self.root.join("Cargo.lock")
    }

    /// Returns the version of tokio in `Cargo.lock`, or `None` without a `Cargo.lock`.
    pub(super) fn tokio(&self) -> Result<Option<String>, Failure> {
        let path = self.lock_file();
        if !path.exists() {
            return Ok(None);
        }
        let lock: toml::Table = read_text(&path)?.parse().map_err(|error| Failure::Input(format!("{} cannot be read: {error}", path.display())))?;
        let text = |package: &toml::Value, key: &str| package.get(key).and_then(toml::Value::as_str).map(str::to_owned);
        // A lock file may name several major versions of tokio. Only version 1 can be replaced.
        let packages = lock.get("package").and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
        let found = packages.iter().find(|package| {
            text(package, "name").as_deref() == Some("tokio") && text(package, "version").is_some_and(|version| version.starts_with("1."))
        });
        let Some(found) = found else {
            return Err(Failure::Input(format!("{} names no tokio 1: expected a program that depends on it", path.display())));
        };
        // A package without a source is the package generated by this program.
        if let Some(source) = text(found, "source").filter(|source| !source.starts_with("registry+") && !source.starts_with("sparse+")) {
            return Err(Failure::Input(format!("tokio comes from {source}: expected a version of a registry")));
        }
        let version = text(found, "version").unwrap_or_default();
        // The major version is 1, as searched for above.
        let minor = version.split('.').nth(1).and_then(|minor| minor.parse::<u32>().ok());
        if minor.is_none_or(|minor| minor < OLDEST) {
            return Err(Failure::Input(format!(
                "tokio {version} cannot be replaced: expected 1.{OLDEST} or later, which cargo update -p tokio brings"
            )));
        }
        Ok(Some(version))
    }
}

/// Returns the dependency of a package of a workspace on the package `name`.
fn dependency<'a>(workspace: &'a Value, name: &str) -> Option<&'a Value> {
    let packages = workspace["packages"].as_array()?;
    packages.iter().filter_map(|package| package["dependencies"].as_array()).flatten().find(|dependency| dependency["name"] == name)
}

fn has_feature(kit: &Value, name: &str) -> bool {
    kit["features"].as_array().is_some_and(|features| features.iter().any(|feature| feature == name))
}

/// Returns the source of a package beside the test kit, as keys of an inline table of TOML. `folder` is the path from the test kit to the package. Both come
/// from the same source, because two copies of `cohaptic-sockets` would not know of each other.
fn source(kit: &Value, folder: &str) -> Result<String, Failure> {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    if let Some(path) = kit["path"].as_str() {
        let package = Path::new(path).join(folder);
        let package = package
            .canonicalize()
            .map_err(|error| Failure::Input(format!("cohaptic-testkit lies in {path}, but {} cannot be found: {error}", package.display())))?;
        return Ok(format!("path = {}", quoted(&package.display().to_string())));
    }
    match kit["source"].as_str().and_then(|source| source.strip_prefix("git+")) {
        Some(git) => {
            let (url, which) = git.split_once('?').unwrap_or((git, ""));
            // The query of the address, such as `rev=abc` or `branch=main`, has the form of the key that cargo reads in a manifest.
            let which = which.split_once('=').map_or_else(String::new, |(key, value)| format!(", {key} = {}", quoted(value)));
            Ok(format!("git = {}{which}", quoted(url)))
        }
        None => Ok(format!("version = {}", quoted(kit["req"].as_str().unwrap_or("*")))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sockets_come_from_where_the_test_kit_comes_from() {
        let sockets = |kit: Value| source(&kit, "../sockets");
        assert_eq!(sockets(json!({ "source": "git+https://example.org/c?rev=abc" })).unwrap(), r#"git = "https://example.org/c", rev = "abc""#);
        assert_eq!(sockets(json!({ "source": "git+https://example.org/c" })).unwrap(), r#"git = "https://example.org/c""#);
        assert_eq!(
            sockets(json!({ "source": "registry+https://github.com/rust-lang/crates.io-index", "req": "^0.1" })).unwrap(),
            r#"version = "^0.1""#
        );
        let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testkit");
        assert!(sockets(json!({ "path": kit })).unwrap().ends_with("sockets\""));
        assert!(source(&json!({ "path": kit }), ".").unwrap().ends_with("testkit\""));
        assert!(sockets(json!({ "path": "/nowhere/testkit" })).is_err());
    }

    #[test]
    fn the_path_of_the_patch_begins_in_the_workspace_with_the_tests() {
        let workspace = |sim: &str| Workspace { root: "/code".into(), sim: sim.into(), kit: String::new(), beside: Beside::default() };
        let package = Path::new("/code/target/cohaptic/tokio");
        assert_eq!(workspace("/code/sim").patch(package), "../target/cohaptic/tokio");
        assert_eq!(workspace("/code").patch(package), "target/cohaptic/tokio");
        assert_eq!(workspace("/elsewhere").patch(package), "/code/target/cohaptic/tokio");
    }
}
