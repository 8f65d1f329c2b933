//! The page of an answer, as a single HTML file: the answer in sentences, the question, the pictures, the tables, the notes, and the text of the scene.
//!
//! Each answer has a function `html`, which fills an [`AnswerPage`]. The page has no clock, so equal answers give equal bytes.

use cohaptic_picture::page::{Html, Page, Table};
use cohaptic_stability::KeyRange;

use crate::label;

/// Largest number of rows of a table on a page. Further rows stand only in the files of the folder.
pub const MOST_ROWS: usize = 400;

/// Largest number of similar sentences at the head of a page, such as a sentence per crossing. The tables have the rest.
const MOST_SENTENCES: usize = 20;

/// Origin of an answer, shown on the page.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Origin<'a> {
    /// Command for making the page again.
    pub command: &'a str,
    /// Name of the file of the scene.
    pub file: &'a str,
    /// Overrides of the scene, as texts `KEY=VALUE`.
    pub overrides: &'a [String],
    /// Text of the scene.
    pub scene: &'a str,
    /// Pictures as SVG documents, each with the name of its file.
    pub pictures: &'a [(&'a str, &'a str)],
}

/// Content of the page of an answer, apart from its [`Origin`].
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct AnswerPage {
    /// Title of the page.
    pub title: String,
    /// Sentences in the colour of a failure, before the answer.
    pub warnings: Vec<String>,
    /// The answer, a paragraph per sentence.
    pub sentences: Vec<String>,
    /// Settings of the question besides scene and overrides: names with values.
    pub asked: Vec<(&'static str, Html)>,
    /// Tables with headings, shown after the pictures.
    pub tables: Html,
    /// Notes on simplifications.
    pub notes: Vec<String>,
}

impl AnswerPage {
    /// Returns the page as a document.
    #[must_use]
    pub fn html(self, origin: &Origin<'_>) -> String {
        let Self { title, warnings, sentences, asked, tables, notes } = self;
        let mut page = Page::new(title);
        // Warnings come before the answer, because a warning can turn the answer around.
        for warning in &warnings {
            page = page.with(Html::warning(sentence(warning)));
        }
        for answer in &sentences {
            page = page.with(Html::paragraph(sentence(answer)));
        }
        let scene = [("Scene", Html::code(origin.file))].into_iter().chain(overrides(origin.overrides));
        // The question stands below the answer: a reader first wants the result.
        page = page.with(Html::heading(2, "Asked")).with(Html::facts(scene.chain(asked))).with(made_by(origin.command));
        if !origin.pictures.is_empty() {
            page = page.with(Html::heading(2, "Pictures"));
            for (file, svg) in origin.pictures {
                page = page.with(Html::figure(file, Html::picture(svg)));
            }
        }
        page = page.with(tables);
        if !notes.is_empty() {
            page = page.with(Html::heading(2, "Notes")).with(Html::list(notes.iter().map(|note| Html::text(&sentence(note)))));
        }
        page.with(scene_text(origin.scene)).html()
    }
}

impl Origin<'_> {
    /// Returns whether the command of this origin has made a page, from the same text of the scene. Names of files and overrides are part of the command.
    #[must_use]
    pub fn has_made(&self, page: &str) -> bool {
        [made_by(self.command), scene_text(self.scene)].iter().all(|part| page.contains(part.as_str()))
    }
}

/// Returns the section of a page with the command for making the page again.
#[must_use]
pub fn made_by(command: &str) -> Html {
    Html::heading(2, "Made by").and(Html::preformatted(command))
}

/// Returns the section of a page with the text of the scene.
#[must_use]
pub fn scene_text(text: &str) -> Html {
    // The overrides stand with the question, so that the text of the scene remains the text of the file.
    let said = Html::paragraph("The file as it was read; overrides are not in it.");
    Html::heading(2, "Scene").and(Html::details("The text of the scene", said.and(Html::preformatted(text))))
}

/// Returns the fact about overrides of a scene; `None` without overrides.
#[must_use]
pub fn overrides(overrides: &[String]) -> Option<(&'static str, Html)> {
    let keys = overrides.iter().map(|key| Html::code(key));
    keys.reduce(|before, key| before.and(", ").and(key)).map(|keys| ("Overrides", keys))
}

/// Returns the sentence about the missing rows of a table with `rows` rows; empty if the page shows all rows. `file` has all rows.
#[must_use]
pub fn more_rows(rows: u64, what: &str, file: &str) -> Html {
    if rows > MOST_ROWS as u64 { Html::paragraph(format!("{MOST_ROWS} of {rows} {what} are shown; {file} has all.")) } else { Html::default() }
}

/// Returns the searched range of a key: `coordination.stiffness [N/m], from 0 to 6000`.
#[must_use]
pub fn range(key: &KeyRange) -> Html {
    // `text` repeats the key, and the range names the key once, before both ends.
    let end = |value: f64| key.text(value).replacen(&format!("{}=", key.key), "", 1);
    format!("{}, from {} to {}", label(key), end(key.low), end(key.high)).into()
}

/// Returns a heading with a table, or nothing if the table has no rows.
pub(crate) fn headed(heading: &str, table: &Table) -> Html {
    if table.is_empty() { Html::default() } else { Html::heading(2, heading).and(Html::table(table)) }
}

/// Returns clauses as the beginning of a sentence, with semicolons between them. Beyond a limit, the sentence says how many clauses are left out.
pub(crate) fn clauses(clauses: &[String]) -> String {
    let more = clauses.len().saturating_sub(MOST_SENTENCES);
    // The number of left out clauses counts as a clause of its own.
    let shown = clauses.iter().take(MOST_SENTENCES).cloned();
    let more = (more > 0).then(|| format!("and so on, {more} more"));
    shown.chain(more).collect::<Vec<String>>().join("; ")
}

/// Returns words as a sentence, which begins with a capital letter and ends with a full stop.
fn sentence(words: &str) -> String {
    // A first word with such a character is a key of the scene or the name of a file, and stays as written.
    let is_name = words.split_whitespace().next().is_some_and(|first| first.contains(['.', '_', '=']));
    // Only the first letter changes: capitals inside may be units or names.
    let mut letters = words.chars();
    let first: String = letters.next().map_or_else(String::new, |first| if is_name { first.to_string() } else { first.to_uppercase().collect() });
    let end = if words.ends_with(['.', ':', '?', '!']) { "" } else { "." };
    format!("{first}{}{end}", letters.as_str())
}

#[cfg(test)]
mod tests {
    use cohaptic_picture::testing::page_faults;

    use super::*;

    const HOSTILE: &str = "<script>alert(\"1\")</script> & 'more'";

    #[test]
    fn a_page_has_every_part_in_its_order_and_every_text_is_escaped() {
        let answer = AnswerPage {
            title: format!("title {HOSTILE}"),
            warnings: vec![format!("warning {HOSTILE}")],
            sentences: vec![format!("answer {HOSTILE}")],
            asked: vec![("Key", Html::code(HOSTILE))],
            tables: headed(&format!("table {HOSTILE}"), &Table::new().column(HOSTILE).row([HOSTILE.into()])),
            notes: vec![format!("note {HOSTILE}")],
        };
        let (overrides, pictures) = ([HOSTILE.to_owned()], [("a.svg", "<?xml?><svg viewBox=\"0 0 1 1\"></svg>")]);
        let origin = Origin { command: HOSTILE, file: HOSTILE, overrides: &overrides, scene: HOSTILE, pictures: &pictures };
        let page = answer.html(&origin);
        assert!(!page.contains("<script"), "{page}");
        assert!(!page_faults(&page).iter().any(|fault| fault.contains("tags") || fault.contains("elsewhere")), "{:?}", page_faults(&page));
        let parts = [
            "<h1>title",
            ">Warning &lt;",
            "<p>Answer &lt;",
            "Asked",
            "Overrides",
            "Key",
            "Made by",
            "<pre>&lt;script",
            "<svg",
            "table &lt;",
            "Note &lt;",
            "<summary>",
        ];
        let places: Vec<usize> = parts.iter().map(|part| page.find(part).unwrap_or_else(|| panic!("no {part} in {page}"))).collect();
        assert!(places.is_sorted(), "{places:?}");
    }

    #[test]
    fn what_a_page_has_nothing_of_leaves_no_heading() {
        let origin = Origin { command: "cohaptic", file: "a.toml", overrides: &[], scene: "", pictures: &[] };
        let page =
            AnswerPage { title: "Nothing".to_owned(), tables: headed("Empty", &Table::new().column("a")), ..AnswerPage::default() }.html(&origin);
        for word in ["Pictures", "Notes", "Overrides", "Empty"] {
            assert!(!page.contains(word), "{word} in {page}");
        }
    }

    #[test]
    fn sentences_begin_large_and_end_with_a_stop_and_keys_stay_as_they_are() {
        for (words, expected) in [
            ("stable", "Stable."),
            ("a b.", "A b."),
            ("link.delay is long", "link.delay is long."),
            ("link.delay=8ms", "link.delay=8ms."),
            ("12 of 24", "12 of 24."),
            ("", "."),
        ] {
            assert_eq!(sentence(words), expected);
        }
    }

    #[test]
    fn many_clauses_are_cut_and_counted() {
        let many: Vec<String> = (0..23).map(|number| format!("c{number}")).collect();
        assert!(clauses(&many).ends_with("; c19; and so on, 3 more"), "{}", clauses(&many));
        assert_eq!(clauses(&many[..2]), "c0; c1");
    }
}
