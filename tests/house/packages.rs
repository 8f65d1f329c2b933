//! Packages are ready to publish, and may be: their own descriptions, and the licences of all that they are built from.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::house::metadata::{list, metadata, metadata_of, text};
use crate::house::{files, name, root};

/// The rules of the project for packages of others, which `cargo deny check` reads.
fn rules() -> toml::Table {
    fs::read_to_string(root().join("deny.toml")).unwrap().parse().unwrap()
}

/// The accepted licences.
fn accepted() -> BTreeSet<String> {
    let listed = rules()["licenses"]["allow"].as_array().unwrap().iter().map(|licence| licence.as_str().unwrap().to_owned()).collect::<BTreeSet<_>>();
    assert!(listed.contains("MIT") && listed.contains("Apache-2.0"), "{listed:?}");
    listed
}

/// Returns whether an expression of SPDX holds with the accepted licences. `A/B` is how old packages write `A OR B`.
fn is_accepted(expression: &str, listed: &BTreeSet<String>) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words = spaced.split_whitespace().peekable();
    let accepted = alternatives(&mut words, listed);
    assert!(words.next().is_none(), "{expression}");
    accepted
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn alternatives(words: &mut Words<'_>, listed: &BTreeSet<String>) -> bool {
    let mut accepted = all_of(words, listed);
    while words.next_if_eq(&"OR").is_some() {
        accepted |= all_of(words, listed);
    }
    accepted
}

fn all_of(words: &mut Words<'_>, listed: &BTreeSet<String>) -> bool {
    let mut accepted = one(words, listed);
    while words.next_if_eq(&"AND").is_some() {
        accepted &= one(words, listed);
    }
    accepted
}

fn one(words: &mut Words<'_>, listed: &BTreeSet<String>) -> bool {
    let word = words.next().unwrap_or_default();
    if word == "(" {
        let accepted = alternatives(words, listed);
        assert_eq!(words.next(), Some(")"));
        return accepted;
    }
    let exception = words.next_if_eq(&"WITH").and_then(|_| words.next()).map_or_else(String::new, |name| format!(" WITH {name}"));
    listed.contains(&format!("{word}{exception}"))
}

/// Workspaces of this project whose tests decide about a change or run at night: the folder, from the folder of the project.
const WORKSPACES: [&str; 3] = ["", "tests/programs", "fuzz"];

/// All features, because `cargo metadata` leaves out packages that only a feature needs which is off.
#[test]
fn every_licence_in_the_lock_files_is_accepted() {
    let listed = accepted();
    for workspace in WORKSPACES {
        let metadata = metadata_of(&root().join(workspace), &["--all-features"]);
        let packages = list(&metadata, "packages");
        let refused: Vec<String> = packages
            .iter()
            .filter(|package| !is_accepted(text(package, "license"), &listed))
            .map(|package| format!("{} {}: {:?}", text(package, "name"), text(package, "version"), text(package, "license")))
            .collect();
        assert!(packages.len() > 100 && refused.is_empty(), "{workspace}: of {} packages:\n{}", packages.len(), refused.join("\n"));
    }
}

/// Names and versions of the packages of others that a lock file lists.
fn locked(workspace: &str) -> BTreeSet<(String, String)> {
    let file = fs::read_to_string(root().join(workspace).join("Cargo.lock")).unwrap();
    let field = |entry: &str, key: &str| entry.split_once(&format!("\n{key} = \"")).map(|(_, rest)| rest.split('"').next().unwrap().to_owned());
    let of_others = |entry: &str| field(entry, "source").and_then(|_| Some((field(entry, "name")?, field(entry, "version")?)));
    file.split("[[package]]").filter_map(of_others).collect()
}

/// The programs of others and the fuzz targets run with the versions that the project is built from, unless the project itself does not have the package.
#[test]
fn other_workspaces_lock_the_versions_of_the_project() {
    let project = locked("");
    let is_of_project = |name: &str| project.iter().any(|package| package.0 == name);
    for workspace in WORKSPACES.into_iter().filter(|workspace| !workspace.is_empty()) {
        let own = locked(workspace);
        let other: Vec<_> = own.difference(&project).filter(|(name, _)| is_of_project(name)).collect();
        let hint = format!("`cargo update PACKAGE --precise VERSION` in {workspace} brings its Cargo.lock up to date");
        assert!(own.len() > 100 && other.is_empty(), "not in Cargo.lock of the project: {other:?}; {hint}");
    }
}

/// An advisory that is passed over names its package and says why, and is gone when the package is.
#[test]
fn every_advisory_that_is_passed_over_has_a_reason_and_its_package() {
    let (rules, locked) = (rules(), locked(""));
    for entry in rules["advisories"]["ignore"].as_array().unwrap() {
        let field = |key: &str| entry[key].as_str().unwrap();
        let (id, reason) = (field("id"), field("reason"));
        let package = reason.split('`').nth(1).unwrap_or_default();
        assert!(id.starts_with("RUSTSEC-") && reason.len() > 40, "{id}: {reason}");
        assert!(locked.iter().any(|(name, _)| name == package), "{id}: {package:?} is not in Cargo.lock: the exception can go");
    }
}

#[test]
fn expressions_of_licences_are_read() {
    let listed = accepted();
    for accepted in
        ["MIT", "GPL-3.0-only OR MIT", "MIT/Apache-2.0", "(GPL-2.0-only OR ISC) AND Zlib", "Apache-2.0 WITH LLVM-exception OR GPL-3.0-only"]
    {
        assert!(is_accepted(accepted, &listed), "{accepted}");
    }
    for refused in ["", "GPL-3.0-only", "MIT AND GPL-3.0-only", "MIT AND (GPL-3.0-only OR AGPL-3.0-only)", "Apache-2.0 WITH Classpath-exception-2.0"]
    {
        assert!(!is_accepted(refused, &listed), "{refused}");
    }
}

/// The packages of this project that may be published.
fn published(metadata: &Value) -> Vec<&Value> {
    let may = |package: &&Value| package["source"].is_null() && package["publish"].is_null();
    list(metadata, "packages").iter().filter(may).collect()
}

#[test]
fn every_package_says_what_a_registry_shows() {
    let metadata = metadata(&["--no-deps"]);
    let packages = published(&metadata);
    assert!(packages.len() > 20);
    for package in packages {
        let name = text(package, "name");
        assert!(text(package, "description").len() > 20, "{name} has no description");
        let keywords = list(package, "keywords");
        assert!((1..=5).contains(&keywords.len()), "{name}: {keywords:?}: expected one to five keywords");
        assert!(keywords.iter().all(|keyword| keyword.as_str().unwrap().len() <= 20), "{name}: {keywords:?}");
        assert!((1..=5).contains(&list(package, "categories").len()), "{name} has no categories");
        assert!(!text(package, "rust_version").is_empty() && !text(package, "license").is_empty(), "{name}");
        assert!(package["metadata"]["docs"]["rs"]["targets"].is_array(), "{name} does not say for which targets docs.rs shows it");
        let unversioned = list(package, "dependencies").iter().filter(|needed| needed["req"] == "*" && needed["kind"].is_null());
        assert_eq!(unversioned.count(), 0, "{name} has a dependency without a version");
        let folder = Path::new(text(package, "manifest_path")).parent().unwrap();
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert_eq!(fs::read(folder.join(licence)).unwrap(), fs::read(root().join(licence)).unwrap(), "{name}");
        }
    }
}

/// Libraries that are of use without the rest of the project, each with the example that its README shows. The test of the example compares its output.
const ALONE: [(&str, &str); 8] = [
    ("device", "lever"),
    ("falcon", "wall"),
    ("inverse3", "spring"),
    ("peer", "two_hands"),
    ("stability", "how_stiff"),
    ("tcp", "download"),
    ("testkit", "paid_twice"),
    ("wan", "call"),
];

#[test]
fn libraries_of_use_alone_package_a_readme_and_its_example() {
    let metadata = metadata(&["--no-deps"]);
    for (short, example) in ALONE {
        let package = format!("cohaptic-{short}");
        let told = published(&metadata).into_iter().find(|told| text(told, "name") == package).unwrap();
        assert_eq!(text(told, "readme"), "README.md", "{package}");
        let folder = root().join("crates").join(short);
        let readme = fs::read_to_string(folder.join("README.md")).unwrap();
        assert!(readme.contains(&format!("\ncargo run -p {package} --example {example}\n")), "the README of {package} does not run {example}");
        let source = fs::read_to_string(folder.join(format!("examples/{example}.rs"))).unwrap();
        assert!(source.contains("include_str!(\"../README.md\")"), "no test compares the output of {example} with the README");
        assert!(!source.contains("#[path"), "{example} needs files that are not in its package");
        let mut list = Command::new(env!("CARGO"));
        let output = list.current_dir(root()).args(["package", "--list", "--allow-dirty", "--offline", "--package", &package]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let listed = String::from_utf8(output.stdout).unwrap();
        let examples: Vec<&str> = listed.lines().filter(|file| file.starts_with("examples")).collect();
        assert_eq!(examples.iter().map(|file| file.replace('\\', "/")).collect::<Vec<_>>(), [format!("examples/{example}.rs")], "{package}");
        assert!(listed.lines().any(|file| file == "README.md"), "{package}: {listed}");
    }
}

/// Without building them: the test below looks at the files that they are built from.
#[test]
fn packages_are_made() {
    let target = tempfile::tempdir().unwrap();
    let ask = |mode: &[&str]| {
        let mut command = Command::new(env!("CARGO"));
        command.current_dir(root()).args(["package", "--workspace", "--no-verify", "--allow-dirty", "--target-dir"]).arg(target.path());
        command.args(mode).output().unwrap()
    };
    let mut output = ask(&["--offline"]);
    if !output.status.success() {
        output = ask(&[]);
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let made = target.path().join("package");
    let archives = fs::read_dir(made).unwrap().filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|end| end == "crate"));
    assert!(archives.count() > 20);
}

/// A package holds the files of its own folder alone. Unit tests may read others: they are run here.
#[test]
fn no_package_is_built_from_a_file_outside_of_its_folder() {
    let mut seen = 0;
    for folder in fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path()) {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        for path in files(&folder.join("src"), "rs") {
            let source = fs::read_to_string(&path).unwrap();
            if path.ends_with("tests.rs") {
                continue;
            }
            let own = source.split("#[cfg(test)]").next().unwrap();
            for macro_name in ["include_str!(", "include_bytes!("] {
                for rest in own.split(macro_name).skip(1) {
                    let file = rest.trim_start_matches("concat!(").strip_prefix('"').unwrap().split('"').next().unwrap();
                    let up = file.split('/').take_while(|part| *part == "..").count();
                    let from = path.strip_prefix(&folder).unwrap();
                    let to = file.split('/').nth(up).unwrap();
                    let depth = from.components().count() - 1;
                    assert!(up <= depth, "{}: {file} is not in the folder of the package", name(&path));
                    let is_in = up < depth || manifest.contains(&format!("\"/{to}")) || to == "src";
                    assert!(is_in, "{}: {file}: `include` of Cargo.toml does not name {to}", name(&path));
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 10, "{seen}");
}

/// Rustdoc shows the front page of a library first.
#[test]
fn every_front_page_says_who_needs_it_and_has_an_example() {
    let mut missing = Vec::new();
    for folder in fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path()) {
        let path = folder.join("src/lib.rs");
        let Ok(source) = fs::read_to_string(&path) else { continue };
        let page: Vec<&str> = source.lines().map_while(|line| line.strip_prefix("//!")).collect();
        let has_example = page.iter().filter(|line| **line == " ```").count() >= 2;
        if !has_example || !page.iter().any(|line| line.starts_with(" Use this crate ")) {
            missing.push(name(&path));
        }
    }
    assert!(missing.is_empty(), "{missing:?}");
}
