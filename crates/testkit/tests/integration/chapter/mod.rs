//! docs/testing.md says what is true: its blocks are tests, and what it shows comes out.

mod misuse;
mod nodes;
mod programs;

use std::panic::{AssertUnwindSafe, catch_unwind};

const CHAPTER: &str = include_str!("../../../../../docs/testing.md");

/// The code in which the blocks must stand as they are.
const CODE: [&str; 3] = [include_str!("programs.rs"), include_str!("nodes.rs"), include_str!("../../../../../docs/examples/first-test/src/lib.rs")];

/// The blocks of a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    CHAPTER.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn every_block_of_rust_is_compiled_and_run() {
    let blocks = blocks("rust");
    assert_eq!(blocks.len(), CHAPTER.matches("```rust").count());
    for block in blocks {
        assert!(CODE.iter().any(|code| code.contains(block)), "this block of docs/testing.md stands in no test:\n{block}");
    }
}

#[test]
fn the_first_test_has_fewer_than_forty_lines() {
    let (manifest, code) = (blocks("toml")[0], blocks("rust")[0]);
    assert!(include_str!("../../../../../docs/examples/first-test/Cargo.toml").starts_with(manifest));
    assert_eq!(CODE[2], code);
    let count = manifest.lines().count() + code.lines().count();
    assert!(count < 40, "{count} lines");
}

/// What a program panics with.
fn message_of(program: impl FnOnce()) -> String {
    let panic = catch_unwind(AssertUnwindSafe(program)).unwrap_err();
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

/// Fails unless the chapter shows a text.
fn assert_shown(text: &str) {
    assert!(CHAPTER.contains(text), "docs/testing.md does not show:\n{text}");
}
