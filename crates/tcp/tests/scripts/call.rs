//! Calls of the program, as scripts write them: `NAME(ARGUMENT, …) = RESULT`.

use crate::parse::{Cursor, Fault};

#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) name: String,
    /// Arguments as text. Brackets and braces keep their commas.
    pub(crate) arguments: Vec<String>,
    pub(crate) result: Outcome,
}

/// Result of a call: a number, or −1 and the name of an error.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Outcome {
    Value(u64),
    Error(String),
}

impl Call {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let name = cursor.word().to_owned();
        if name.is_empty() {
            return Err(cursor.fault("`<`, `>`, `%{` or a call"));
        }
        cursor.needs("(")?;
        let mut arguments = Vec::new();
        while !cursor.eats(")") {
            arguments.push(parse_argument(cursor)?);
            if !cursor.eats(",") {
                cursor.needs(")")?;
                break;
            }
        }
        cursor.needs("=")?;
        let result = if cursor.eats("-1") { Outcome::Error(cursor.word().to_owned()) } else { Outcome::Value(cursor.number()?) };
        // packetdrill allows the text of the error behind its name.
        if matches!(result, Outcome::Error(_)) && cursor.eats("(") {
            cursor.until(")")?;
        }
        Ok(Self { name, arguments, result })
    }

    /// Returns the argument at `index` as a number. Brackets around the number are left out.
    pub(crate) fn number(&self, index: usize) -> Option<u64> {
        self.arguments.get(index)?.trim_matches(['[', ']']).parse().ok()
    }
}

fn parse_argument(cursor: &mut Cursor<'_>) -> Result<String, Fault> {
    for (open, close) in [("[", "]"), ("{", "}")] {
        if cursor.eats(open) {
            return Ok(format!("{open}{}{close}", cursor.until(close)?));
        }
    }
    let text = cursor.takes(|c| !matches!(c, ',' | ')' | '\n'));
    if text.is_empty() { Err(cursor.fault("an argument")) } else { Ok(text.trim_end().to_owned()) }
}
