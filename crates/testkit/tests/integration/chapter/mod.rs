//! Checks of docs/testing.md: its blocks of code are tests, and the outputs that it shows are the outputs of these tests.

mod files;
mod misuse;
mod nodes;
mod programs;

use std::panic::{AssertUnwindSafe, catch_unwind};

const CHAPTER: &str = include_str!("../../../../../docs/testing.md");

/// Files of code in which the blocks must stand word for word. Blocks that use axum are among the tests of programs of others, a workspace of its own: they are compared
/// here, and compiled and run there. Blocks that need the feature `files` or `scenes` are among the tests across crates, which always have both.
const CODE: [&str; 7] = [
    include_str!("programs.rs"),
    include_str!("files.rs"),
    include_str!("nodes.rs"),
    include_str!("../../../../../tests/programs/tests/phone/each_part.rs"),
    include_str!("../../../../../tests/programs/tests/phone/whole_photo.rs"),
    include_str!("../../../../../tests/testkit/chapter.rs"),
    include_str!("../../../../../tests/examples/bufferbloat.rs"),
];

/// Test with which the page begins.
const FIRST_TEST: &str = include_str!("../../../../../docs/examples/first-test/src/lib.rs");

/// Returns the blocks of code in a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    CHAPTER.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn every_block_of_rust_is_in_a_test() {
    let blocks = blocks("rust");
    assert_eq!(blocks.len(), CHAPTER.matches("```rust").count());
    for block in blocks {
        assert!(CODE.iter().any(|code| code.contains(block)), "this block of docs/testing.md stands in no test:\n{block}");
    }
}

#[test]
fn the_first_test_has_fewer_than_forty_lines() {
    let manifest = include_str!("../../../../../docs/examples/first-test/Cargo.toml");
    let (needed, _) = manifest.split_once("\n\n# ").unwrap();
    let count = needed.lines().count() + FIRST_TEST.lines().count();
    assert!(count < 40, "{count} lines");
}

#[test]
fn the_page_begins_with_a_service_and_its_test_in_ten_lines() {
    let blocks = blocks("rust");
    assert!(blocks[0].contains("StatusCode") && blocks[1].contains("fn a_phone_sends_a_photo"));
    let is_code = |line: &&str| !line.trim().is_empty();
    assert_eq!(blocks[..2].iter().flat_map(|block| block.lines()).filter(is_code).count(), 10);
}

/// The files that the blocks of code read are shown on the page.
#[test]
fn the_files_that_are_shown_are_there() {
    assert!(blocks("text").contains(&include_str!("../../home.links")));
    assert_eq!(blocks("toml"), [include_str!("../../../../../tests/testkit/room.toml")]);
}

/// Returns the message with which a program panics.
fn message_of(program: impl FnOnce()) -> String {
    let panic = catch_unwind(AssertUnwindSafe(program)).unwrap_err();
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

/// Fails unless docs/testing.md shows the text.
fn assert_shown(text: &str) {
    assert!(CHAPTER.contains(text), "docs/testing.md does not show:\n{text}");
}
