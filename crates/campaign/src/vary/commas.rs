//! Splits texts at the commas between their parts, as in `--vary KEY=1,2,3`.

/// Splits a text at commas, except within brackets, braces and quotes, because values may be lists, tables and texts. Space around the parts is removed.
#[must_use]
pub fn split_at_commas(text: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0_u32, None);
    for letter in text.chars() {
        match (quote, letter) {
            // Only the same kind of quote ends a quoted text.
            (Some(open), _) if open == letter => quote = None,
            (None, '"' | '\'') => quote = Some(letter),
            (None, '[' | '{') => depth += 1,
            // A closing bracket too many is left to the reader of the value, which reports it.
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}
