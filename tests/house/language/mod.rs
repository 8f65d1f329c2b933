//! The language of pages, comments and messages: phrases that are not used, and the length of sentences.
//!
//! A finding names file, line, the words and the reason. The rules are in `rules`; where a phrase is right all the same, `RIGHT` there lists it.

pub(crate) mod markdown;
mod rules;
mod source;

use std::collections::BTreeMap;
use std::fs;

use crate::house::{files, name, root};
use markdown::{Block, Kind, blocks};
use rules::{Finding, of_phrases, of_sentences, of_subjects};

/// Pages of the project, also those that programs write, but for the list of changes.
fn pages() -> Vec<(String, String)> {
    let all = files(&root(), "md").into_iter().map(|path| (name(&path), fs::read_to_string(path).unwrap()));
    all.filter(|(page, _)| page != "CHANGELOG.md").collect()
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
    let found = pages.iter().flat_map(|(page, text)| {
        let blocks = blocks(text);
        // The forms of issues ask without a mark.
        let looked_at = if page.starts_with(".github/") { &[] } else { &blocks[..] };
        let subjects: Vec<_> = looked_at.iter().flat_map(|block| of_subjects(page, block)).collect();
        in_blocks(page, &blocks).into_iter().chain(subjects)
    });
    report(found.collect());
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

/// The texts of all sources but tests, each with the name of its file.
fn sources() -> Vec<(String, source::Parts)> {
    let all = ["crates", "benches"].into_iter().flat_map(|folder| files(&root().join(folder), "rs")).map(|path| (name(&path), path));
    let is_shown = |file: &str| file.contains("/src/") && !file.contains("/tests/") && !file.ends_with("/tests.rs");
    let shown: Vec<_> = all.filter(|(file, _)| is_shown(file)).collect();
    assert!(shown.len() > 500, "{}", shown.len());
    shown.into_iter().map(|(file, path)| (file, source::parts(&fs::read_to_string(path).unwrap()))).collect()
}

#[test]
fn sentences_of_the_comments_of_a_package_have_25_words_on_average() {
    let mut all: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (file, parts) in sources() {
        let package = file.split("/src/").next().unwrap().to_owned();
        let prose = parts.comments.iter().flatten().filter(|block| block.kind == Kind::Prose);
        all.entry(package).or_default().extend(prose.flat_map(rules::sentence_lengths));
    }
    let long = |(package, lengths): (String, Vec<usize>)| {
        let words: usize = lengths.iter().sum();
        (words > rules::MEAN_WORDS * lengths.len()).then(|| format!("{package}: {words} words in {} sentences", lengths.len()))
    };
    let long: Vec<String> = all.into_iter().filter_map(long).collect();
    assert!(long.is_empty(), "the sentences of these comments have more than {} words on average:\n{}", rules::MEAN_WORDS, long.join("\n"));
}

#[test]
fn comments_and_messages_keep_to_the_language() {
    let mut findings = Vec::new();
    for (file, parts) in sources() {
        for comment in parts.comments {
            findings.extend(in_blocks(&file, &comment));
        }
        for message in parts.messages {
            findings.extend(of_phrases(&file, &message));
        }
    }
    report(findings);
}
