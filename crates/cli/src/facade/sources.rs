//! Sources of tokio, as cargo has them.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::cargo::metadata;
use super::workspace::Workspace;
use crate::failure::Failure;
use crate::file::write_file;

/// Sources of a version of tokio, and of the test kit.
#[derive(Debug)]
pub(super) struct Sources {
    /// Version of tokio.
    pub(super) version: String,
    /// Folder with the `Cargo.toml` and `src` of tokio.
    pub(super) folder: PathBuf,
    /// The test kit, as cargo describes a package.
    pub(super) kit: Value,
}

/// Returns cargo's sources of a version of tokio, which cargo downloads if it does not have them. Without a version, those of the newest version 1.
///
/// Asks about a package of its own, which depends on tokio and on the test kit alone: the workspace of the user may name the generated package, which need not exist yet.
pub(super) fn find(workspace: &Workspace, version: Option<&str>) -> Result<Sources, Failure> {
    let wanted = version.map_or_else(|| "1".to_owned(), |version| format!("={version}"));
    let folder = workspace.folder().join("sources");
    super::files::make_folder(&folder.join("src"))?;
    let manifest = format!(
        "[package]\nname = \"cohaptic-sources\"\nversion = \"0.0.0\"\nedition = \"2024\"\npublish = false\n\n[dependencies]\ntokio = \"{wanted}\"\n\
         cohaptic-testkit = {{ {}, default-features = false }}\n\n[workspace]\n",
        workspace.kit
    );
    write_file(&folder.join("Cargo.toml"), manifest)?;
    write_file(&folder.join("src/lib.rs"), "//! Cargo is asked for the sources of tokio with this package.\n")?;
    // The lock file of an earlier version would be read first.
    let _ = std::fs::remove_file(folder.join("Cargo.lock"));
    // In the folder of the workspace, whose configuration of cargo may name other registries or vendored sources.
    let path = folder.join("Cargo.toml").display().to_string();
    let purpose = format!("cargo has no sources of tokio {}", version.unwrap_or("1"));
    // A given version is first looked for offline, so that cargo needs no registry for sources that are on this machine. Without a given version only the
    // registry knows the newest version.
    let offline = version.map(|_| metadata(&workspace.root, &["--offline", "--manifest-path", &path], &purpose));
    let known = match offline {
        Some(Ok(known)) => known,
        Some(Err(_)) | None => metadata(&workspace.root, &["--manifest-path", &path], &purpose)?,
    };
    let package = |name: &str| known["packages"].as_array().and_then(|packages| packages.iter().find(|package| package["name"] == name));
    let (tokio, kit) = (package("tokio"), package("cohaptic-testkit"));
    let text = |key: &str| tokio.and_then(|tokio| tokio[key].as_str());
    let sources = text("manifest_path").and_then(|manifest| Path::new(manifest).parent()).filter(|folder| folder.join("src/lib.rs").exists());
    match (text("version"), sources) {
        (Some(version), Some(folder)) => {
            Ok(Sources { version: version.to_owned(), folder: folder.to_owned(), kit: kit.cloned().unwrap_or_default() })
        }
        _ => Err(Failure::System(format!("{purpose}: expected a folder with its src/lib.rs"))),
    }
}
