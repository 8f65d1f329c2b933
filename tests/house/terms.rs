//! A page links the words that only this field has where it uses them first, to the glossary or to the page that explains them.

use std::fs;

use crate::house::{files, name, root};

/// Words and symbols of the glossary that a reader from another field does not know.
const TERMS: [&[&str]; 9] = [
    &["AP"],
    &["PD"],
    &["K_T", "KT"],
    &["mean square"],
    &["monodromy matrix"],
    &["admittance"],
    &["discrepancy"],
    &["virtual time"],
    &["release error"],
];

/// Pages for readers: not those that programs write, and not the glossary itself.
fn pages() -> Vec<(String, String)> {
    let all = files(&root().join("docs"), "md").into_iter().chain([root().join("README.md")]);
    let is_written = |page: &str| page.starts_with("docs/reference-") || page.starts_with("docs/measured");
    let pages = all.map(|path| (name(&path), fs::read_to_string(path).unwrap()));
    pages.filter(|(page, _)| !is_written(page) && page != "docs/glossary.md" && page != "docs/SUMMARY.md").collect()
}

/// The sentences and tables of a page, with the marks of links and without code, headings, comments, pictures and anchors.
fn text(page: &str) -> String {
    let mut kept = String::new();
    let (mut in_fence, mut in_comment, mut after_blank) = (false, false, true);
    for line in page.lines() {
        let inner = line.trim_start();
        if inner.starts_with("```") {
            in_fence = !in_fence;
        } else if !in_fence {
            in_comment |= inner.starts_with("<!--");
            let is_code = after_blank && line.starts_with("    ");
            if !in_comment && !is_code && !inner.starts_with(['#', '!', '<']) {
                let without_anchors = line.split("<a id=\"").map(|part| part.split_once("</a>").map_or(part, |(_, rest)| rest));
                kept.extend(without_anchors.collect::<String>().split('`').step_by(2).flat_map(|part| [part, " "]));
                kept.push('\n');
            }
            in_comment &= !inner.contains("-->");
            after_blank = inner.is_empty() || is_code;
        }
    }
    kept
}

/// Returns whether the place is within the text of a link, `[…](…)`.
fn is_in_link(text: &str, place: usize) -> bool {
    let opens = text[..place].rfind(['[', ']']).is_some_and(|bracket| text[bracket..].starts_with('['));
    opens && text[place..].find(['[', ']']).is_some_and(|bracket| text[place + bracket..].starts_with("]("))
}

/// The first place of a word, alone, outside of addresses of links.
fn first(text: &str, word: &str) -> Option<usize> {
    let is_part = |letter: char| letter.is_alphanumeric() || ['_', '/', '#', '-', '.', '·'].contains(&letter);
    text.match_indices(word).map(|(place, _)| place).find(|&place| {
        let behind = &text[place + word.len()..];
        let is_alone =
            !text[..place].ends_with(is_part) && !behind.starts_with(|letter: char| letter.is_alphanumeric() || letter == '_' || letter == '-');
        let in_address = text[..place].rfind(['(', ')']).is_some_and(|bracket| text[..=bracket].ends_with("]("));
        is_alone && !in_address
    })
}

#[test]
fn terms_are_links_where_they_come_first() {
    let mut found = Vec::new();
    for (page, whole) in pages() {
        let text = text(&whole);
        for term in TERMS {
            let place = term.iter().filter_map(|word| first(&text, word)).min();
            if let Some(place) = place.filter(|&place| !is_in_link(&text, place)) {
                let line = text[..place].rfind('\n').map_or(0, |end| end + 1);
                found.push(format!("{page}: {} in \"{}\"", term[0], text[line..].chars().take(80).collect::<String>()));
            }
        }
    }
    assert!(found.is_empty(), "not a link to docs/glossary.md, or to the page that explains it:\n{}", found.join("\n"));
}

#[test]
fn a_term_without_a_link_is_found() {
    let page = "# AP\n\n    AP\n\nWith `AP` and [PD](pd.md#AP), AP-like.\n<!-- AP -->\nThen AP, and [PD](a.md) again.\n";
    let text = text(page);
    let place = first(&text, "AP").unwrap();
    assert!(text[place..].starts_with("AP, and") && !is_in_link(&text, place));
    assert!(is_in_link(&text, first(&text, "PD").unwrap()));
    assert_eq!(first(&text, "KT"), None);
}
