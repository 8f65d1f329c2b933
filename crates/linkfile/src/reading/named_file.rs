//! Files named in a document: a file is looked for beside the document, read once, and refused with the faulty line.

use core::any::Any;
use core::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use cohaptic_units::Excerpt;

use super::context::Context;
use super::values;
use crate::document::{Diagnostic, Node, Origin};
use crate::fingerprint::Fingerprint;

/// Fault in the text of a file, with its place.
#[derive(Debug)]
pub struct Fault {
    /// Faulty bytes of the text.
    pub span: Range<usize>,
    /// Message: the fault and the expected text.
    pub message: String,
}

impl Fault {
    /// Returns a fault in a line, counted from 1, or at the beginning of the text without a line. A prefix such as "line 2: " is removed from the message,
    /// because the display form shows the line.
    #[must_use]
    pub(crate) fn in_line(text: &str, line: Option<usize>, error: &dyn core::fmt::Display) -> Self {
        let message = error.to_string();
        let shown = line.and_then(|line| {
            let rest = message.strip_prefix(&format!("line {line}"))?;
            rest.strip_prefix(": ").or_else(|| rest.strip_prefix(", "))
        });
        let message = shown.unwrap_or(&message).to_owned();
        Self { span: line.map_or(0..0, |line| line_span(text, line)), message }
    }
}

/// Returns the bytes of a line, counted from 1, without the space around the content. A line after the last line is the empty span at the end of the text.
#[must_use]
pub fn line_span(text: &str, line: usize) -> Range<usize> {
    let Some(found) = text.lines().nth(line.saturating_sub(1)) else { return text.len()..text.len() };
    // `lines` leaves out line breaks of one or two bytes. `split_inclusive` keeps the breaks, so that the pieces sum up to the start of the line.
    let start = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum::<usize>();
    let indent = found.len() - found.trim_start().len();
    start + indent..start + indent + found.trim().len()
}

/// Returns the path of the file named by `node`, joined to the folder of the document. An empty name is a fault.
pub fn file_path(node: &Node, context: Context<'_>, expected: &str) -> Option<PathBuf> {
    let name = values::text(node, context, expected)?;
    if name.is_empty() {
        context.fault_at(node, format!("the name is empty: expected {expected}"));
        return None;
    }
    Some(beside_document(context, name))
}

/// Joins the name of a file to the folder of the document. An absolute name stays as it is.
#[must_use]
pub(crate) fn beside_document(context: Context<'_>, name: &str) -> PathBuf {
    context.sources.file.parent().unwrap_or_else(|| Path::new("")).join(name)
}

/// Reads and parses the file named by `node`, or returns the result of an earlier call with the same path and form. `form` names the format and every value
/// that `parse` depends on. Returns `None` if the file was refused.
pub fn read_file<T: Clone + 'static>(
    node: &Node,
    context: Context<'_>,
    path: &Path,
    form: &str,
    parse: impl FnOnce(&str) -> Result<T, Fault>,
) -> Option<T> {
    let key = (path.to_path_buf(), form.to_owned());
    if let Some(known) = context.files.known.borrow().get(&key) {
        return known.as_ref().and_then(|known| known.downcast_ref()).cloned();
    }
    // A refused file is remembered too, so that the fault is not made again for every link with the file.
    let read = load(node, context, path).and_then(|text| {
        let refused = |Fault { span, message }: Fault| refuse(node, context, path, &text, span, message);
        parse(&text).map_err(refused).ok()
    });
    context.files.known.borrow_mut().insert(key, read.clone().map(|read| Rc::new(read) as Rc<dyn Any>));
    read
}

/// Reads the bytes of a file as UTF-8, and records the fingerprint of the bytes.
fn load(node: &Node, context: Context<'_>, path: &Path) -> Option<String> {
    let bytes = (context.reader.0)(path).map_err(|error| context.unreadable(node, path.to_path_buf(), error)).ok()?;
    context.files.held.borrow_mut().insert(path.to_path_buf(), Fingerprint::of_bytes(&bytes));
    match String::from_utf8(bytes) {
        Ok(text) => Some(text),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            // The lossy text equals the file up to the first faulty byte, so line and column of the fault equal line and column in the file.
            let text = String::from_utf8_lossy(error.as_bytes());
            refuse(node, context, path, &text, at..at + 1, "not UTF-8: expected a text file".to_owned());
            None
        }
    }
}

/// Reports a fault in a named file. A message without an expected text gets a general text.
fn refuse(node: &Node, context: Context<'_>, path: &Path, text: &str, span: Range<usize>, message: String) {
    let message = if message.contains("expected") { message } else { format!("{message}: expected another value") };
    let origin = Origin::File(path.to_path_buf());
    let diagnostic = Diagnostic { origin, excerpt: Excerpt::new(text, span), key: node.path.clone(), message, note: None };
    context.fault_in_file(node, diagnostic);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_whatever_ends_them() {
        let text = "a\r\n  bc \n\nd";
        let shown = |line| &text[line_span(text, line)];
        assert_eq!([shown(1), shown(2), shown(3), shown(4), shown(5)], ["a", "bc", "", "d", ""]);
    }

    #[test]
    fn a_message_does_not_repeat_the_line_that_is_shown() {
        let fault = Fault::in_line("a\nb", Some(2), &"line 2, column t: expected more");
        assert_eq!((fault.span, fault.message.as_str()), (2..3, "column t: expected more"));
        assert_eq!(Fault::in_line("a\nb", None, &"no row").span, 0..0);
    }
}
