//! The pages of reference, made from the program's own description: `--help`, the catalogue of keys that the JSON Schema is made of, and a list of the keys
//! of JSON documents, which is compared with what the commands print.
//!
//! `COHAPTIC_UPDATE_PAGES=1` writes them anew.

mod commands;
mod documents;
mod help;
mod keys;
mod links;

use std::fs;

use crate::pages::page::UPDATE;
use crate::pages::root;

/// Comment below the title of each page that these tests write.
const WRITTEN: &str = "<!-- Written by the tests in crates/cli/tests/pages/reference from what the program says of itself. Do not edit. -->";

/// Compares a page byte by byte, or writes it anew.
fn assert_page(name: &str, text: &str) {
    let path = root().join(name);
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&path, text).unwrap();
    }
    let shown = fs::read_to_string(&path).unwrap_or_default();
    let differs =
        shown.lines().zip(text.lines()).position(|(shown, now)| shown != now).unwrap_or_else(|| shown.lines().count().min(text.lines().count()));
    assert!(
        shown == text,
        "{name}:{}: the program says something else: {UPDATE}=1 writes the page anew\n  page:    {}\n  program: {}",
        differs + 1,
        shown.lines().nth(differs).unwrap_or_default(),
        text.lines().nth(differs).unwrap_or_default(),
    );
}

/// An entry of a list: a name, notes in brackets unless they are empty, and a meaning.
fn entry(name: &str, notes: &[&str], meaning: &str) -> String {
    let said: Vec<&str> = notes.iter().copied().filter(|note| !note.is_empty()).collect();
    let brackets = if said.is_empty() { String::new() } else { format!(" ({})", said.join("; ")) };
    format!("- {name}{brackets}: {meaning}\n")
}

/// Text of the program within a list: options as code, and nothing that Markdown takes for itself.
fn prose(text: &str) -> String {
    let word = |word: &str| {
        let end = word.find(|letter: char| letter != '-' && !letter.is_ascii_alphanumeric()).unwrap_or(word.len());
        if word.starts_with("--") && end > 2 { format!("`{}`{}", &word[..end], &word[end..]) } else { word.to_owned() }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ").replace('<', "&lt;").replace('*', "\\*")
}

#[test]
fn the_page_of_commands_is_what_help_says() {
    assert_page("docs/reference-commands.md", &commands::page());
}

#[test]
fn the_page_of_documents_is_their_list() {
    assert_page("docs/reference-documents.md", &documents::page());
}

#[test]
fn the_pages_of_keys_are_the_catalogue() {
    for (name, text) in keys::pages() {
        assert_page(&format!("docs/{name}"), &text);
    }
}

#[test]
fn the_page_of_links_is_the_library() {
    assert_page("docs/reference-links.md", &links::page());
}

#[test]
fn an_entry_has_the_notes_that_say_something() {
    assert_eq!(entry("`a`", &["", "default 1"], &prose("see --b, or a*b <c>")), "- `a` (default 1): see `--b`, or a\\*b &lt;c>\n");
    assert_eq!(entry("`a`", &["", ""], "b"), "- `a`: b\n");
}
