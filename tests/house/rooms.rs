//! The rooms of a crate are the modules at its root, each with all that lies in its folder. No two rooms use each other, not even by way of others, so that a
//! reader can understand them one after another.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::house::{files, name, root};

/// Uses of other rooms in a crate: the file that uses a room first, indexed by the using room and the used room.
type Uses = BTreeMap<String, BTreeMap<String, String>>;

/// The code of a file, without its comments and the tests at its end.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    code.lines().map(|line| line.split("//").next().unwrap()).collect::<Vec<_>>().join("\n")
}

/// The word at the begin of a text, after white space.
fn word(text: &str) -> &str {
    let text = text.trim_start();
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next().unwrap()
}

/// The names at the begin of a path: the first word, or those of a list in braces.
fn heads(path: &str) -> Vec<&str> {
    let Some(list) = path.strip_prefix('{') else { return vec![word(path)] };
    let (mut depth, mut heads) = (0, vec![word(list)]);
    for (at, letter) in list.char_indices() {
        match letter {
            '}' if depth == 0 => break,
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => heads.push(word(&list[at + 1..])),
            _ => {}
        }
    }
    heads
}

/// The names of the root of a crate that the code of a file names, where the file lies `depth` modules below the root.
fn names_of_root(code: &str, depth: usize) -> Vec<&str> {
    let roots = ["crate::".to_owned(), "super::".repeat(depth)];
    let begins = |root: &str| code.match_indices(root).map(|(at, root)| (at, at + root.len())).collect::<Vec<_>>();
    let paths = roots.iter().flat_map(|root| begins(root)).filter(|(at, _)| !code[..*at].ends_with("::"));
    paths.flat_map(|(_, end)| heads(&code[end..])).collect()
}

/// The rooms of the names that the root of a crate takes from its rooms.
fn exports(root: &str, rooms: &BTreeSet<String>) -> BTreeMap<String, String> {
    let paths = root.split(';').filter_map(|item| item.split_once("use ")).map(|(_, path)| path);
    let of_rooms = paths.filter(|path| rooms.contains(word(path)));
    let names = of_rooms.flat_map(|path| path.split([',', '{', '}']).map(move |part| (part, word(path))));
    let last = |part: &str| part.rsplit("::").next().unwrap().rsplit(" as ").next().unwrap().trim().to_owned();
    names.map(|(part, room)| (last(part), room.to_owned())).collect()
}

/// The uses of other rooms in a crate with its sources in `folder`.
fn uses(folder: &Path) -> Uses {
    let modules = |path: &Path| {
        let path = path.strip_prefix(folder).unwrap().with_extension("");
        path.iter().map(|part| part.to_str().unwrap().to_owned()).filter(|part| part != "mod").collect::<Vec<_>>()
    };
    let sources = files(folder, "rs");
    let is_root = |path: &Path| ["lib", "main", "bin"].contains(&modules(path)[0].as_str());
    let (roots, sources): (Vec<_>, Vec<_>) = sources.into_iter().partition(|path| is_root(path));
    let rooms: BTreeSet<String> = sources.iter().map(|path| modules(path)[0].clone()).collect();
    let exports: BTreeMap<String, String> = roots.iter().flat_map(|root| exports(&code(root), &rooms)).collect();
    let mut uses = Uses::new();
    for path in sources.iter().filter(|path| !modules(path).iter().any(|module| module == "tests")) {
        let (modules, code) = (modules(path), code(path));
        for used in names_of_root(&code, modules.len()).into_iter().filter_map(|name| rooms.get(name).or_else(|| exports.get(name))) {
            if *used != modules[0] {
                uses.entry(modules[0].clone()).or_default().entry(used.clone()).or_insert_with(|| name(path));
            }
        }
    }
    uses
}

/// All rooms that a room uses, by way of others too.
fn reached<'a>(uses: &'a Uses, room: &str) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut left: Vec<&'a str> = uses.get(room).into_iter().flat_map(BTreeMap::keys).map(String::as_str).collect();
    while let Some(room) = left.pop() {
        if reached.insert(room) {
            left.extend(uses.get(room).into_iter().flat_map(BTreeMap::keys).map(String::as_str));
        }
    }
    reached
}

#[test]
fn no_circle_leads_through_the_rooms_of_a_crate() {
    let manifests = files(&root(), "toml").into_iter().filter(|path| path.ends_with("Cargo.toml"));
    let folders: Vec<_> = manifests.map(|path| path.with_file_name("src")).filter(|folder| folder.is_dir()).collect();
    let mut found = BTreeMap::new();
    let mut wrong = Vec::new();
    for folder in &folders {
        let uses = uses(folder);
        for (room, used) in &uses {
            let back = used.iter().filter(|(other, _)| reached(&uses, other).contains(room.as_str()));
            wrong.extend(back.map(|(other, file)| format!("{file}: `{room}` uses `{other}`, which uses `{room}`")));
        }
        found.insert(name(folder), uses);
    }
    // Uses in three forms: by the room, by a name that the root takes from the room, and in a macro.
    let has = |package: &str, room: &str, used: &str| found[package][room].contains_key(used);
    assert!(has("crates/wan/src", "line", "stages") && has("crates/accuracy/src", "text", "row") && has("crates/harness/src", "observer", "rows"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn rooms_are_found_in_each_form_of_a_path() {
    let code = "use crate::{a::{B, C}, d, E as F};\nfn g() -> super::super::h::I { super::j() + $crate::k!() }";
    assert_eq!(names_of_root(code, 2), ["a", "d", "E", "k", "h"]);
    let rooms = ["m", "n"].map(str::to_owned).into();
    let exports = exports("mod m;\npub use m::{o::P, Q as R};\npub use n::S;\nuse other::T;", &rooms);
    let room = |name: &str| exports.get(name).map(String::as_str);
    assert_eq!(["P", "R", "S", "T"].map(room), [Some("m"), Some("m"), Some("n"), None]);
}
