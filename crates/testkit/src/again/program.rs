//! Programs of tests, as read from the source files of the tests.

use std::fs;
use std::panic::Location;
use std::path::{Path, PathBuf};

/// Call of a program as in its source: the method, and the text between the parentheses.
pub(super) struct Call {
    pub(super) method: String,
    pub(super) program: String,
}

/// Returns the call at a place. `None` if the source file is missing, or there is no such call at the place, as in the code of a macro.
pub(super) fn call(place: &Location<'_>) -> Option<Call> {
    let text = fs::read_to_string(source(place.file())?).ok()?;
    let line = text.lines().nth((place.line() as usize).checked_sub(1)?)?;
    let column: usize = line.chars().take((place.column() as usize).checked_sub(1)?).map(char::len_utf8).sum();
    let begin = line.as_ptr().addr() - text.as_ptr().addr() + column;
    read(&text[begin..])
}

/// Returns the path of a source file. `file` is relative to the folder of the compiler, usually the folder of the workspace. A test runs in the folder of its
/// package, so all folders above are tried.
fn source(file: &str) -> Option<PathBuf> {
    let here = std::env::current_dir().ok()?;
    here.ancestors().map(|folder| folder.join(Path::new(file))).find(|path| path.is_file())
}

/// Parses a call, from its method on.
fn read(text: &str) -> Option<Call> {
    let (method, rest) = text.split_once('(')?;
    let method = method.trim();
    if !["run", "run_recorded", "run_twice"].contains(&method) {
        return None;
    }
    let (end, has_long_text) = closing(rest)?;
    let program = rest[..end].trim().trim_end_matches(',').trim_end();
    // Blanks inside a string of several lines are part of the string.
    let program = if has_long_text { program.to_owned() } else { indented(program) };
    Some(Call { method: method.to_owned(), program })
}

/// Indentation of a call in the printed test \[columns\].
const INDENT: usize = 8;

/// Returns the program with its lines after the first moved, so that the outermost of these lines are indented like the call.
fn indented(program: &str) -> String {
    let depth = |line: &str| line.len() - line.trim_start().len();
    // The first line follows the parenthesis of the call, so its indentation in the source says nothing about the other lines.
    let least = program.lines().skip(1).filter(|line| !line.trim().is_empty()).map(depth).min().unwrap_or(0);
    let mut lines = program.lines();
    let mut text = lines.next().unwrap_or_default().to_owned();
    for line in lines {
        text.push('\n');
        if !line.trim().is_empty() {
            text.push_str(&" ".repeat(INDENT));
            text.push_str(&line[least..]);
        }
    }
    text
}

/// Returns the position of the parenthesis that closes the call, and whether a string of several lines precedes it.
fn closing(text: &str) -> Option<(usize, bool)> {
    let bytes = text.as_bytes();
    let (mut place, mut depth, mut has_long_text) = (0, 0_usize, false);
    while place < bytes.len() {
        let rest = &text[place..];
        // Parentheses within comments, strings and characters do not count. A whole comment or string is one step.
        let len = match bytes[place] {
            b'(' | b'[' | b'{' => {
                depth += 1;
                1
            }
            b')' if depth == 0 => return Some((place, has_long_text)),
            b')' | b']' | b'}' => {
                depth = depth.checked_sub(1)?;
                1
            }
            b'/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            b'/' if rest.starts_with("/*") => comment(rest)?,
            b'"' => string(rest)?,
            b'r' if is_raw(text, place) => raw_string(rest)?,
            b'\'' => character(rest),
            _ => 1,
        };
        has_long_text |= matches!(bytes[place], b'"' | b'r') && len > 1 && rest.get(..len).is_some_and(|string| string.contains('\n'));
        place += len;
        // A step of one byte may end within a character.
        while !text.is_char_boundary(place) {
            place += 1;
        }
    }
    None
}

/// Returns the length of a comment, which may contain nested comments.
fn comment(text: &str) -> Option<usize> {
    let (mut depth, mut place) = (0_usize, 0);
    loop {
        let rest = text.as_bytes().get(place..)?;
        if rest.starts_with(b"/*") {
            (depth, place) = (depth + 1, place + 2);
        } else if rest.starts_with(b"*/") {
            (depth, place) = (depth - 1, place + 2);
            if depth == 0 {
                return Some(place);
            }
        } else if rest.is_empty() {
            return None;
        } else {
            place += 1;
        }
    }
}

/// Returns the length of a string in quotation marks.
fn string(text: &str) -> Option<usize> {
    let mut is_escaped = false;
    for (place, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = true,
            b'"' => return Some(place + 1),
            _ => {}
        }
    }
    None
}

/// Returns whether a raw string begins at `place`, as opposed to a name that contains an `r`.
fn is_raw(text: &str, place: usize) -> bool {
    let before = text[..place].chars().next_back();
    // An `r` within a word begins no string. The `b` of `br"…"` is no word.
    let is_word = before.is_some_and(|before| before.is_alphanumeric() || before == '_') && !text[..place].ends_with('b');
    !is_word && text[place + 1..].trim_start_matches('#').starts_with('"')
}

/// Returns the length of a raw string.
fn raw_string(text: &str) -> Option<usize> {
    // The string begins after `r`, the hashes and a quotation mark, and ends with a quotation mark and as many hashes.
    let hashes = text[1..].bytes().take_while(|byte| *byte == b'#').count();
    let begin = hashes + 2;
    let end = format!("\"{}", "#".repeat(hashes));
    Some(begin + text.get(begin..)?.find(&end)? + end.len())
}

/// Returns the length of a character in quotation marks, or one for the mark of a lifetime.
fn character(text: &str) -> usize {
    let mut characters = text.char_indices().skip(1);
    match characters.next() {
        // The character after the backslash may be a quotation mark itself.
        Some((_, '\\')) => text.get(3..).and_then(|rest| rest.find('\'')).map_or(1, |end| end + 4),
        // Without a second quotation mark, the first one begins a lifetime.
        Some(_) => characters.next().filter(|(_, mark)| *mark == '\'').map_or(1, |(place, _)| place + 1),
        None => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(text: &str) -> Option<String> {
        read(text).map(|call| call.program)
    }

    #[test]
    fn a_program_ends_where_its_call_closes() {
        for (text, expected) in [
            ("run(ten_questions);", "ten_questions"),
            ("run(\n    ask::<(), 3>, // )\n) + (1)", "ask::<(), 3>, // )"),
            ("run(|bed| async move { ask(&bed, \")\").await }).len()", "|bed| async move { ask(&bed, \")\").await }"),
            ("run(|_: Bed<'static>| f(')', '\\'', '\\u{29}', b')', 'é')), x", "|_: Bed<'static>| f(')', '\\'', '\\u{29}', b')', 'é')"),
            ("run(f(r#\"\")\"#, br\")\", for_(\"\\\")\"), /* ) /* ) */ ) */ 1))", "f(r#\"\")\"#, br\")\", for_(\"\\\")\"), /* ) /* ) */ ) */ 1)"),
            (
                "run_twice(|bed| async {\n            x\n                .y()\n        })",
                "|bed| async {\n            x\n                .y()\n        }",
            ),
            ("run(|bed| {\n    x\n})", "|bed| {\n            x\n        }"),
            ("run(|bed| {\n    f(\"a\n  b\")\n})", "|bed| {\n    f(\"a\n  b\")\n}"),
        ] {
            assert_eq!(program(text).as_deref(), Some(expected), "{text}");
        }
        for text in ["", "run", "walk(x)", "run(x", "run(\"x)", "run(])", "run(/* x)", "run(r#\"x\")"] {
            assert_eq!(program(text), None, "{text}");
        }
    }

    #[track_caller]
    fn run<T>(_program: T) -> &'static Location<'static> {
        Location::caller()
    }

    #[test]
    fn the_source_of_a_call_is_found_from_the_folder_of_the_package() {
        let place = run(|bed: u8| bed + 1);
        let call = call(place).unwrap();
        assert_eq!((&*call.method, &*call.program), ("run", "|bed: u8| bed + 1"));
    }
}
