//! Packages are ready to publish, and may be: their own descriptions, and the licences of all that they are built from.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::house::metadata::{list, metadata, text};
use crate::house::{files, name, root};

/// Licences that ask for no more than that they are named. `MIT-0` and `CC0-1.0` do not even ask for that, and only tests and build scripts have them.
const ACCEPTED: [&str; 13] = [
    "MIT",
    "MIT-0",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "Zlib",
    "Unicode-3.0",
    "0BSD",
    "BSL-1.0",
    "CC0-1.0",
    "Unlicense",
];

/// Whether an expression of SPDX holds with the accepted licences. `A/B` is how old packages write `A OR B`.
fn is_accepted(expression: &str) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words = spaced.split_whitespace().peekable();
    let accepted = alternatives(&mut words);
    assert!(words.next().is_none(), "{expression}");
    accepted
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn alternatives(words: &mut Words<'_>) -> bool {
    let mut accepted = all_of(words);
    while words.next_if_eq(&"OR").is_some() {
        accepted |= all_of(words);
    }
    accepted
}

fn all_of(words: &mut Words<'_>) -> bool {
    let mut accepted = one(words);
    while words.next_if_eq(&"AND").is_some() {
        accepted &= one(words);
    }
    accepted
}

fn one(words: &mut Words<'_>) -> bool {
    let word = words.next().unwrap_or_default();
    if word == "(" {
        let accepted = alternatives(words);
        assert_eq!(words.next(), Some(")"));
        return accepted;
    }
    let exception = words.next_if_eq(&"WITH").and_then(|_| words.next()).map_or_else(String::new, |name| format!(" WITH {name}"));
    ACCEPTED.contains(&format!("{word}{exception}").as_str())
}

#[test]
fn every_licence_in_the_lock_file_is_accepted() {
    let metadata = metadata(&[]);
    let packages = list(&metadata, "packages");
    let refused: Vec<String> = packages
        .iter()
        .filter(|package| !is_accepted(text(package, "license")))
        .map(|package| format!("{} {}: {:?}", text(package, "name"), text(package, "version"), text(package, "license")))
        .collect();
    assert!(packages.len() > 100 && refused.is_empty(), "of {} packages:\n{}", packages.len(), refused.join("\n"));
}

#[test]
fn expressions_of_licences_are_read() {
    for accepted in
        ["MIT", "GPL-3.0-only OR MIT", "MIT/Apache-2.0", "(GPL-2.0-only OR ISC) AND Zlib", "Apache-2.0 WITH LLVM-exception OR GPL-3.0-only"]
    {
        assert!(is_accepted(accepted), "{accepted}");
    }
    for refused in ["", "GPL-3.0-only", "MIT AND GPL-3.0-only", "MIT AND (GPL-3.0-only OR AGPL-3.0-only)", "Apache-2.0 WITH Classpath-exception-2.0"]
    {
        assert!(!is_accepted(refused), "{refused}");
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
        if !has_example || !page.iter().any(|line| line.starts_with(" You need it if ")) {
            missing.push(name(&path));
        }
    }
    assert!(missing.is_empty(), "{missing:?}");
}
