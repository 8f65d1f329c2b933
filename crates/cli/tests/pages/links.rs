//! Every link of the project's Markdown leads somewhere, and the book has every page of `docs`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::pages::prose::{anchors, links};
use crate::pages::{markdown, root};

/// The table of contents of the book.
const SUMMARY: &str = "docs/SUMMARY.md";

/// Texts of the pages, by path from the folder of the project.
type Pages = BTreeMap<PathBuf, String>;

fn pages() -> Pages {
    let root = root();
    let mut found = Vec::new();
    markdown(&root, &mut found);
    found.into_iter().map(|path| (path.strip_prefix(&root).unwrap().to_owned(), fs::read_to_string(&path).unwrap())).collect()
}

/// Returns the target of a link as a path from the folder of the project, and an anchor; `None` for a web address.
fn place(page: &Path, target: &str) -> Option<(PathBuf, Option<String>)> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor.to_owned())));
    if path.is_empty() {
        return Some((page.to_owned(), anchor));
    }
    let mut whole = page.parent().unwrap_or_else(|| Path::new("")).to_owned();
    for part in Path::new(path).components() {
        if part == Component::ParentDir {
            whole.pop();
        } else if part != Component::CurDir {
            whole.push(part);
        }
    }
    Some((whole, anchor))
}

/// Returns the links without a target.
fn dead(pages: &Pages, is_there: impl Fn(&Path) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    for (page, text) in pages {
        for link in links(text) {
            let Some((path, anchor)) = place(page, &link.target) else { continue };
            let is_dead = match (pages.get(&path), anchor) {
                (None, None) => !is_there(&path),
                (None, Some(_)) => true,
                (Some(_), None) => false,
                (Some(text), Some(anchor)) => !anchors(text).contains(&anchor),
            };
            if is_dead {
                found.push(format!("{}: {}", page.display(), link.target));
            }
        }
    }
    found
}

/// Returns the pages of `docs` to which no page but the table of contents links.
fn lonely(pages: &Pages) -> Vec<String> {
    let linked: BTreeSet<PathBuf> = pages
        .iter()
        .filter(|(page, _)| *page != Path::new(SUMMARY))
        .flat_map(|(page, text)| links(text).into_iter().filter_map(move |link| Some((page, place(page, &link.target)?.0))))
        .filter_map(|(page, path)| (*page != path).then_some(path))
        .collect();
    of_the_book(pages).filter(|page| !linked.contains(*page)).map(|page| page.display().to_string()).collect()
}

/// Pages of `docs` that the table of contents does not have.
fn left_out(pages: &Pages) -> Vec<String> {
    let summary = Path::new(SUMMARY);
    let listed: BTreeSet<PathBuf> = links(&pages[summary]).into_iter().filter_map(|link| Some(place(summary, &link.target)?.0)).collect();
    of_the_book(pages).filter(|page| !listed.contains(*page)).map(|page| page.display().to_string()).collect()
}

fn of_the_book(pages: &Pages) -> impl Iterator<Item = &PathBuf> {
    pages.keys().filter(|page| page.starts_with("docs") && *page != Path::new(SUMMARY))
}

#[test]
fn every_link_leads_somewhere() {
    let dead = dead(&pages(), |path| root().join(path).exists());
    assert!(dead.is_empty(), "links that lead nowhere:\n{}", dead.join("\n"));
}

#[test]
fn every_page_is_linked_to() {
    let lonely = lonely(&pages());
    assert!(lonely.is_empty(), "no other page links to {lonely:?}");
}

#[test]
fn the_book_has_every_page() {
    let left_out = left_out(&pages());
    assert!(left_out.is_empty(), "{SUMMARY} does not have {left_out:?}");
}

#[test]
fn faults_of_links_are_found() {
    let texts = [
        ("README.md", "[book](docs/README.md) [code](crates/a.rs) [gone](crates/b.rs) [web](https://example.org/#x)"),
        ("docs/README.md", "# The book\n[one](one.md#part-one) [no part](one.md#part-two) [up](../README.md)"),
        ("docs/one.md", "## Part one\n[here](#part-one) [not here](#part-three) [a line](../crates/a.rs#L7)"),
        ("docs/two.md", "[itself](two.md) [folder](../crates)"),
        (SUMMARY, "- [one](one.md)\n- [two](two.md)\n- [three](three.md)"),
    ];
    let pages: Pages = texts.into_iter().map(|(page, text)| (PathBuf::from(page), text.to_owned())).collect();
    let dead = dead(&pages, |path| path == Path::new("crates/a.rs") || path == Path::new("crates"));
    let wanted = [
        "README.md: crates/b.rs",
        "docs/README.md: one.md#part-two",
        "docs/SUMMARY.md: three.md",
        "docs/one.md: #part-three",
        "docs/one.md: ../crates/a.rs#L7",
    ];
    assert_eq!(dead, wanted);
    assert_eq!(lonely(&pages), ["docs/two.md"]);
    assert_eq!(left_out(&pages), ["docs/README.md"]);
}
