//! How long the pages of the book are.

use std::fs;

use crate::house::language::markdown::blocks;
use crate::house::{files, name, root};

/// The most words on a page, as `wc -w` counts them: with code, and with each bar of a table.
const PAGE: usize = 3_500;
/// The most words that all pages have to be read: those of sentences, headings and tables.
const BOOK: usize = 45_000;

/// Pages that hold figures which programs have computed: the paper again, and strategies compared.
const RESULTS: [&str; 2] = ["docs/compare.md", "docs/results.md"];

/// Each page of the book with its text, apart from figures and the table of contents.
fn pages() -> Vec<(String, String)> {
    let all = files(&root().join("docs"), "md").into_iter().map(|path| (name(&path), fs::read_to_string(path).unwrap()));
    let is_left_out = |page: &str| page.starts_with("docs/measured") || page == "docs/SUMMARY.md" || RESULTS.contains(&page);
    all.filter(|(page, _)| !is_left_out(page)).collect()
}

/// The words outside of blocks of code. Code within a sentence is one word.
fn words(text: &str) -> usize {
    let is_word = |word: &&str| word.contains(char::is_alphanumeric);
    blocks(text).iter().map(|block| block.text().split_whitespace().filter(is_word).count()).sum()
}

#[test]
fn a_page_can_be_read_in_one_sitting() {
    let all = pages().into_iter().map(|(page, text)| (page, text.split_whitespace().count()));
    let long: Vec<_> = all.filter(|(_, words)| *words > PAGE).collect();
    assert!(long.is_empty(), "more than {PAGE} words: split {long:?}");
}

#[test]
fn the_book_without_measured_figures_has_few_words() {
    let pages = pages();
    let all: usize = pages.iter().map(|(_, text)| words(text)).sum();
    assert!(pages.len() > 20 && all <= BOOK, "{all} words of at most {BOOK} on {} pages", pages.len());
}

#[test]
fn code_and_marks_are_no_words() {
    assert_eq!(words("# A title\n\nOne `x y` – two.\n\n    code here\n\n| a cell | 5 N |\n| --- | --- |\n- an [entry](page.md)\n"), 11);
}
