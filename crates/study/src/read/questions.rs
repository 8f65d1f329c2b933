//! Reader of `[[questions]]`.

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::{Context, TableReader, values};

use super::keys::{AFTER, KINDS, Kind, QUESTION};
use crate::model::{Question, QuestionKind};

pub(super) fn read_questions(node: Option<&Node>, context: Context<'_>) -> Option<Vec<Question>> {
    let Some(node) = node else { return Some(Vec::new()) };
    let entries = values::list(node, context, "entries [[questions]]")?;
    let read: Vec<Option<Question>> = entries.iter().enumerate().map(|(place, entry)| read_question(entry, place, context)).collect();
    let questions: Vec<Question> = read.into_iter().collect::<Option<_>>()?;
    for (place, question) in questions.iter().enumerate() {
        if questions[..place].iter().any(|other| is_same_file(&other.name, &question.name)) {
            context.fault_at(entries[place], format!("two questions have the name {}: expected a name for each", quote(&question.name)));
            return None;
        }
    }
    Some(questions)
}

/// Reports the first question with the name of an analysed measure, whose picture has the same file. Returns whether no question has such a name. `node` is the
/// node of the questions.
pub(super) fn have_own_names(node: &Node, questions: &[Question], measures: &[String], context: Context<'_>) -> bool {
    let measured = questions.iter().position(|question| measures.iter().any(|measure| is_same_file(measure, &question.name)));
    let Some(place) = measured else { return true };
    let name = quote(&questions[place].name);
    let entry = values::list(node, context, "entries [[questions]]").and_then(|entries| entries.get(place).copied());
    context.fault_at(entry.unwrap_or(node), format!("the name {name} is that of an analysed measure: expected another name"));
    false
}

/// Returns whether two names are the same in a file system that takes upper and lower case for the same.
fn is_same_file(one: &str, other: &str) -> bool {
    one.eq_ignore_ascii_case(other)
}

fn read_question(node: &Node, place: usize, context: Context<'_>) -> Option<Question> {
    const OF_SCALE: &str = "only a question of the kind scale takes this key: expected no such key";
    let mut table = TableReader::new(node, context, &QUESTION, "a table such as { after = \"condition\", kind = \"tlx\" }")?;
    let name = table.maybe("name", |node, context| {
        let name = values::text(node, context, "a name")?;
        let fits = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'));
        if !fits {
            context.fault_at(node, format!("{} is no name: expected letters, digits, - and _", quote(name)));
        }
        fits.then(|| name.to_owned())
    });
    let (after, kind) = (table.choice("after", &AFTER), table.choice("kind", &KINDS));
    let is_scale = kind != Some(Kind::Tlx);
    let mut fits = true;
    for key in ["text", "ends", "steps"] {
        fits &= table.only_if(is_scale, key, OF_SCALE).is_some();
    }
    let (text, ends, steps) = if kind == Some(Kind::Scale) {
        let text = table.read("text", |node, context| values::text(node, context, "a question").map(str::to_owned));
        let steps: Option<u64> = table.value("steps");
        (text, table.read("ends", read_ends), steps)
    } else {
        (None, None, None)
    };
    table.finish();
    fits.then_some(())?;
    let (name, after) = (name?, after?);
    let (word, kind) = match kind? {
        Kind::Tlx => ("tlx", QuestionKind::Tlx),
        Kind::Scale => ("scale", QuestionKind::Scale { text: text?, ends: ends?, steps: u32::try_from(steps?).ok()? }),
    };
    Some(Question { name: name.unwrap_or_else(|| format!("{word}{}", place + 1)), after, kind })
}

fn read_ends(node: &Node, context: Context<'_>) -> Option<[String; 2]> {
    const EXPECTED: &str = "a list of two texts such as [\"not at all\", \"very\"]";
    let elements = values::list(node, context, EXPECTED)?;
    let [low, high] = elements.as_slice() else {
        context.fault_at(node, format!("found a list of {}: expected {EXPECTED}", elements.len()));
        return None;
    };
    let text = |node: &Node| values::text(node, context, "a text").map(str::to_owned);
    Some([text(low)?, text(high)?])
}
