//! Shows untrusted text on a terminal: no character of the text moves the cursor, changes the direction of writing, or is invisible.

use alloc::string::String;
use core::fmt::{self, Write as _};

/// Prints a text for a single line: control characters, format characters and line separators appear as escapes such as `\u{202e}`.
#[derive(Clone, Copy, Debug)]
pub struct Visible<'a>(pub &'a str);

impl fmt::Display for Visible<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|c| if is_hidden(c) { write!(f, "{}", c.escape_default()) } else { f.write_char(c) })
    }
}

/// Returns a text of several lines with escapes as in [`Visible`]. Line feeds stay.
#[must_use]
pub fn visible_lines(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for (place, line) in text.split('\n').enumerate() {
        if place > 0 {
            shown.push('\n');
        }
        // Writing to memory does not fail.
        let _ = write!(shown, "{}", Visible(line));
    }
    shown
}

/// Returns whether a character acts on a terminal instead of showing a glyph: general categories Cc, Cf, Zl and Zp of Unicode 16.
#[must_use]
pub(crate) fn is_hidden(c: char) -> bool {
    // `is_control` covers Cc. The list covers Cf, Zl and Zp, for which the standard library has no function.
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{6dd}' | '\u{70f}' | '\u{890}'..='\u{891}' | '\u{8e2}' | '\u{180e}' | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2064}' | '\u{2066}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{110bd}' | '\u{110cd}'
            | '\u{13430}'..='\u{1343f}' | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0001}' | '\u{e0020}'..='\u{e007f}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString as _;

    /// UnicodeData 16.0: 170 characters of category Cf, 65 of Cc, and a single character each of Zl and Zp.
    #[test]
    fn the_characters_are_as_many_as_unicode_has() {
        assert_eq!(('\0'..=char::MAX).filter(|c| is_hidden(*c)).count(), 170 + 65 + 1 + 1);
    }

    #[test]
    fn what_turns_or_hides_is_escaped_and_letters_of_all_scripts_are_not() {
        assert_eq!(Visible("a\u{202e}b\u{1b}[2J\n").to_string(), "a\\u{202e}b\\u{1b}[2J\\n");
        assert_eq!(visible_lines("a\u{2066}\nb\t\n"), "a\\u{2066}\nb\\t\n");
        let letters = "µ é Ж 猫 עברית · … — N·s/m ✓ 👍";
        assert_eq!(Visible(letters).to_string(), letters);
        let twice = visible_lines(&visible_lines("\u{ad}\r\n"));
        assert_eq!(twice, "\\u{ad}\\r\n", "shown text is shown unchanged");
    }
}
