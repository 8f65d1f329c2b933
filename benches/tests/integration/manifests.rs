//! What Cargo knows of a package.

use std::fs;

use toml::Table;

use crate::root;

/// The packages whose programs write pages: name, folder.
pub(crate) const PACKAGES: [(&str, &str); 3] =
    [("cohaptic-benches", "benches"), ("cohaptic-benches-realtime", "benches/realtime"), ("cohaptic-benches-peers", "benches/peers")];

fn manifest(folder: &str) -> Table {
    fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap().parse().unwrap()
}

/// The programs of a package.
pub(crate) fn programs(folder: &str) -> Vec<String> {
    let manifest = manifest(folder);
    let programs = manifest["bin"].as_array().unwrap();
    programs
        .iter()
        .map(|program| {
            let path = root().join(folder).join(program["path"].as_str().unwrap());
            assert!(path.is_file(), "{}", path.display());
            program["name"].as_str().unwrap().to_owned()
        })
        .collect()
}

/// The program that `cargo run` means.
pub(crate) fn default_program(folder: &str) -> String {
    let manifest = manifest(folder);
    manifest["package"]["default-run"].as_str().unwrap_or_else(|| panic!("{folder} has no default-run")).to_owned()
}

#[test]
fn the_packages_are_called_that() {
    for (name, folder) in PACKAGES {
        assert_eq!(manifest(folder)["package"]["name"].as_str(), Some(name));
    }
}
