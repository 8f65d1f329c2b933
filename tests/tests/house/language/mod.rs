//! The language of pages, comments and messages: phrases that are not used, and the length of sentences.
//!
//! A finding names file, line, the words and the reason. The rules are in `rules`; where a phrase is right all the same, `RIGHT` there lists it.

mod markdown;
mod rules;
mod source;

use std::fs;

use crate::{files, name, root};
use markdown::{Block, Kind, blocks};
use rules::{Finding, of_phrases, of_sentences};

/// Pages that programs write.
fn is_written_by_a_program(page: &str) -> bool {
    page.ends_with("-speed.md") || page.starts_with("docs/reference-") || ["docs/measured.md", "docs/soak.md"].contains(&page)
}

/// Pages of the project, apart from those that programs write and the list of changes.
fn pages() -> Vec<(String, String)> {
    let all = files(&root(), "md").into_iter().map(|path| (name(&path), fs::read_to_string(path).unwrap()));
    all.filter(|(page, _)| !is_written_by_a_program(page) && page != "CHANGELOG.md").collect()
}

fn report(mut findings: Vec<Finding>) {
    findings.sort_by(|left, right| (&left.file, left.line).cmp(&(&right.file, right.line)));
    let lines: Vec<String> = findings.iter().map(ToString::to_string).collect();
    assert!(lines.is_empty(), "{}\n{} findings", lines.join("\n"), lines.len());
}

fn in_blocks(file: &str, blocks: &[Block]) -> Vec<Finding> {
    blocks.iter().flat_map(|block| of_phrases(file, block).into_iter().chain(of_sentences(file, block))).collect()
}

#[test]
fn pages_keep_to_the_language() {
    let pages = pages();
    assert!(pages.len() > 10);
    report(pages.iter().flat_map(|(page, text)| in_blocks(page, &blocks(text))).collect());
}

#[test]
fn sentences_of_a_page_have_25_words_on_average() {
    let mut long = Vec::new();
    for (page, text) in pages() {
        let lengths: Vec<usize> = blocks(&text).iter().filter(|block| block.kind == Kind::Prose).flat_map(rules::sentence_lengths).collect();
        let words: usize = lengths.iter().sum();
        if words > rules::MEAN_WORDS * lengths.len() {
            long.push(format!("{page}: {words} words in {} sentences", lengths.len()));
        }
    }
    assert!(long.is_empty(), "the sentences of these pages have more than {} words on average:\n{}", rules::MEAN_WORDS, long.join("\n"));
}

#[test]
fn comments_and_messages_keep_to_the_language() {
    let mut findings = Vec::new();
    let sources: Vec<_> =
        ["crates", "benches"].into_iter().flat_map(|folder| files(&root().join(folder), "rs")).map(|path| (name(&path), path)).collect();
    let is_shown = |file: &str| file.contains("/src/") && !file.contains("/tests/") && !file.ends_with("/tests.rs");
    let shown: Vec<_> = sources.into_iter().filter(|(file, _)| is_shown(file)).collect();
    assert!(shown.len() > 500, "{}", shown.len());
    for (file, path) in shown {
        let parts = source::parts(&fs::read_to_string(path).unwrap());
        for comment in parts.comments {
            findings.extend(in_blocks(&file, &comment));
        }
        for message in parts.messages {
            findings.extend(of_phrases(&file, &message));
        }
    }
    report(findings);
}
