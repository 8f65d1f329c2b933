//! The rules, each with its reason.

use std::fmt;

use super::markdown::{Block, Kind};

/// The greatest mean length of the sentences of a page \[words\].
pub(crate) const MEAN_WORDS: usize = 25;
/// The greatest length of a sentence \[words\].
const MOST_WORDS: usize = 60;

const COMPARE: &str = "two figures are compared \"with\" each other";

/// Words that are not used, in any text.
const PHRASES: &[(&[&str], &str)] = &[
    (&["so", "many"], "say which number: \"this number of\", \"at most\""),
    (&["that", "many"], "say which number: \"this number of\""),
    (&["so", "much"], "say which quantity"),
    (&["all", "that", "there", "is"], "name it, or say \"everything\""),
    (&["set", "beside"], COMPARE),
    (&["sets", "beside"], COMPARE),
    (&["beside", "what"], COMPARE),
    (&["beside", "that"], COMPARE),
    (&["beside", "those"], COMPARE),
    (&["beside", "others"], COMPARE),
    (&["beside", "ours"], COMPARE),
    (&["beside", "theory"], COMPARE),
    (&["door"], "a metaphor: name the part of the program"),
    (&["doors"], "a metaphor: name the part of the program"),
    (&["house"], "a metaphor: name the project, or the part of it"),
    (&["blazing"], "state facts, in numbers"),
    (&["blazingly"], "state facts, in numbers"),
    (&["seamless"], "state facts, in numbers"),
    (&["seamlessly"], "state facts, in numbers"),
];

/// Where a phrase is right all the same: a part of a file's name, and the words.
const RIGHT: &[(&str, &str)] =
    &[("", "house rules"), ("crates/live/src/seal.rs", "door"), ("crates/scene/src/sections/timeline.rs", "set beside it")];

/// A question may follow these: "says what is wrong", "knows who sends".
const ASKING: &[&str] = &[
    "say",
    "says",
    "said",
    "saying",
    "tell",
    "tells",
    "told",
    "telling",
    "know",
    "knows",
    "known",
    "knowing",
    "ask",
    "asks",
    "asked",
    "report",
    "reports",
    "reported",
    "see",
    "sees",
    "explain",
    "explains",
    "explained",
    "decide",
    "decides",
];

/// Behind these "who" stands for a noun.
const BEFORE_NOUN: &[&str] =
    &["to", "for", "of", "by", "with", "from", "and", "or", "but", "that", "than", "if", "where", "whom", "because", "so", "in", "at"];

/// Text that breaks a rule.
#[derive(Debug)]
pub(crate) struct Finding {
    pub(crate) file: String,
    pub(crate) line: usize,
    words: String,
    reason: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}: \"{}\": {}", self.file, self.line, self.words, self.reason)
    }
}

/// A word without the marks around it.
struct Word<'a> {
    start: usize,
    /// With its marks.
    raw: &'a str,
    plain: &'a str,
}

impl Word<'_> {
    /// Whether a clause ends behind it.
    fn ends_clause(&self) -> bool {
        self.raw.ends_with(['.', '?', '!', ':', ';'])
    }
}

fn words(text: &str) -> Vec<Word<'_>> {
    let mut found = Vec::new();
    let mut end = 0;
    for raw in text.split_whitespace() {
        let start = end + text[end..].find(raw).unwrap();
        end = start + raw.len();
        let plain = raw.trim_matches(|letter: char| !letter.is_alphanumeric());
        if !plain.is_empty() {
            found.push(Word { start, raw, plain });
        }
    }
    found
}

/// Whether the sentence around a place is a question.
fn is_question(text: &str, place: usize) -> bool {
    ends(&text[place..]).next().is_some_and(|end| text[place..][..end].ends_with('?'))
}

/// Behind each sentence of a text but the last, which may have no mark.
fn ends(text: &str) -> impl Iterator<Item = usize> + '_ {
    text.char_indices().filter(|(_, letter)| ['.', '?', '!'].contains(letter)).filter_map(|(place, letter)| {
        let end = place + letter.len_utf8();
        let rest = text[end..].trim_start_matches([')', '"', '”', '\'']);
        let next = rest.trim_start().chars().next();
        let is_end = rest.is_empty() || (rest.starts_with(char::is_whitespace) && next.is_none_or(|next| !next.is_lowercase()));
        (is_end && !["e.g.", "i.e.", "cf.", "vs.", "al.", "Fig.", "eq.", "No."].iter().any(|short| text[..end].ends_with(short))).then_some(end)
    })
}

/// The lengths of the sentences of a block \[words\].
pub(crate) fn sentence_lengths(block: &Block) -> Vec<usize> {
    sentences(&block.text()).into_iter().map(|(_, length)| length).collect()
}

/// Where each sentence begins, and its number of words.
fn sentences(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = 0;
    for end in ends(text).chain([text.len()]) {
        let length = words(&text[start..end]).len();
        if length > 0 {
            found.push((start + text[start..].len() - text[start..].trim_start().len(), length));
        }
        start = end;
    }
    found
}

/// Sentences that are too long.
pub(crate) fn of_sentences(file: &str, block: &Block) -> Vec<Finding> {
    if block.kind == Kind::Heading {
        return Vec::new();
    }
    let text = block.text();
    let long = sentences(&text).into_iter().filter(|(_, length)| *length > MOST_WORDS);
    let finding = |(start, length): (usize, usize)| Finding {
        file: file.to_owned(),
        line: block.line_at(start),
        words: text[start..].chars().take(40).collect::<String>() + "…",
        reason: format!("a sentence of {length} words: make two of it, {MOST_WORDS} at most"),
    };
    long.map(finding).collect()
}

/// Sentences of a page that begin with "what" and ask nothing: their subject is a clause where a noun can stand.
pub(crate) fn of_subjects(file: &str, block: &Block) -> Vec<Finding> {
    if block.kind != Kind::Prose {
        return Vec::new();
    }
    let text = block.text();
    let begins = |start: usize| text[start..].starts_with("What ") && !is_question(&text, start);
    let finding = |(start, _): (usize, usize)| Finding {
        file: file.to_owned(),
        line: block.line_at(start),
        words: text[start..].chars().take(40).collect::<String>() + "…",
        reason: "begin with the noun that is meant".to_owned(),
    };
    sentences(&text).into_iter().filter(|(start, _)| begins(*start)).map(finding).collect()
}

/// Phrases that are not used.
pub(crate) fn of_phrases(file: &str, block: &Block) -> Vec<Finding> {
    let whole = block.text();
    let text = whole.to_ascii_lowercase();
    let words = words(&text);
    let mut found = Vec::new();
    for (index, word) in words.iter().enumerate() {
        if let Some((length, reason)) = broken_at(&text, &words, index) {
            let is_right = RIGHT.iter().any(|(name, right)| file.contains(name) && text[word.start..].starts_with(right));
            if !is_right {
                let from = words[index.saturating_sub(2)].start;
                let to = words.get(index + length + 2).map_or(text.len(), |next| next.start);
                found.push(Finding {
                    file: file.to_owned(),
                    line: block.line_at(word.start),
                    words: whole[from..to].trim().to_owned(),
                    reason: reason.to_owned(),
                });
            }
        }
    }
    found
}

/// The number of words of the phrase that begins there, and why it is not used.
fn broken_at(text: &str, words: &[Word<'_>], index: usize) -> Option<(usize, &'static str)> {
    let word = &words[index];
    let follows = |phrase: &[&str]| {
        words[index..].len() >= phrase.len()
            && phrase.iter().zip(&words[index..]).all(|(wanted, word)| *wanted == word.plain)
            && words[index..][..phrase.len() - 1].iter().all(|word| word.raw.ends_with(char::is_alphanumeric))
    };
    if let Some((phrase, reason)) = PHRASES.iter().find(|(phrase, _)| follows(phrase)) {
        return Some((phrase.len(), reason));
    }
    if text[word.start..].starts_with("the same, with") {
        return Some((3, "name the thing, and then say how it differs"));
    }
    let before = index.checked_sub(1).map(|before| &words[before]);
    let is_asked = is_question(text, word.start) || before.is_some_and(|before| before.raw == before.plain && ASKING.contains(&before.plain));
    if follows(&["what", "is"]) && !is_asked {
        return Some((2, "no noun: name the thing that is meant"));
    }
    let is_first = before.is_none_or(Word::ends_clause);
    let is_noun = match word.plain {
        "whoever" => true,
        "who" => is_first || before.is_some_and(|before| before.raw == before.plain && BEFORE_NOUN.contains(&before.plain)),
        "whom" => is_first || (index == 1 && before.is_some_and(|before| BEFORE_NOUN.contains(&before.plain))),
        _ => false,
    };
    (is_noun && !is_asked).then_some((1, "no noun: name the peer, the program or the person"))
}

#[cfg(test)]
mod tests {
    use super::super::markdown::blocks;
    use super::*;

    fn found(text: &str) -> Vec<String> {
        blocks(text).iter().flat_map(|block| of_phrases("page.md", block)).map(|finding| format!("{}: {}", finding.line, finding.words)).collect()
    }

    #[test]
    fn phrases_are_found_with_their_lines() {
        let broken = [
            ("A run keeps\nwhat is held.", "2: run keeps what is held."),
            ("It takes so\nmany packets.", "1: it takes so many packets."),
            ("A run of that many ticks.", "1: run of that many ticks."),
            ("the same, with a tail", "1: the same, with a tail"),
            ("Who sends, waits.", "1: Who sends, waits."),
            ("It goes to whoever calls.", "1: goes to whoever calls."),
            ("the scene and who takes part", "1: scene and who takes part"),
            ("Whom to visit.", "1: Whom to visit."),
            ("all that there is here", "1: all that there is here"),
            ("the figures beside those of netem", "1: the figures beside those of netem"),
            ("It stands at the door.", "1: at the door."),
        ];
        for (text, expected) in broken {
            assert_eq!(found(text).iter().map(|line| line.to_lowercase()).collect::<Vec<_>>(), [expected.to_lowercase()], "{text}");
        }
        assert_eq!(found("One line.\nA second, with\nso many words.")[0], "3: second, with so many words.");
    }

    #[test]
    fn right_sentences_are_not() {
        for right in [
            "What is new?",
            "What is this, and who needs it?",
            "It says what is wrong.",
            "People who move an object, and peers, who hear them.",
            "The table lies beside the file, as the house rules say. `what is so many`",
            "    what is code",
            "It did so. Many did.",
        ] {
            let right = if right.starts_with("    ") { format!("\n{right}") } else { right.to_owned() };
            assert_eq!(found(&right), [""; 0], "{right}");
        }
    }

    #[test]
    fn a_clause_as_subject_is_found() {
        let of = |text: &str| blocks(text).iter().flat_map(|block| of_subjects("page.md", block)).map(|finding| finding.line).collect::<Vec<_>>();
        assert_eq!(of("A link drops packets.\nIt counts. What passes\nis delivered.\n\n- What is lost, counts."), [2, 5]);
        assert!(of("# What passes\n\nWhat passes? It says what passes. Whatever.").is_empty());
    }

    #[test]
    fn sentences_are_counted() {
        let text = "One two three. Four, e.g. five (six)! Is 1.5 ms `a.b c` so? yes. Last one";
        assert_eq!(blocks(text).iter().flat_map(sentence_lengths).collect::<Vec<_>>(), [3, 4, 6, 2]);
        let long = vec!["word"; MOST_WORDS + 1].join(" ");
        let blocks = blocks(&format!("A word.\n{long}."));
        assert_eq!(of_sentences("page.md", &blocks[0]).len(), 1);
        assert!(of_sentences("page.md", &super::super::markdown::blocks(&vec!["word"; MOST_WORDS].join(" "))[0]).is_empty());
    }
}
