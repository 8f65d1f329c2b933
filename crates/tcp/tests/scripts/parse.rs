//! Grammar of a script: packetdrill's language, as far as a connection without sockets can follow it.

use std::str::FromStr;

use crate::call::Call;
use crate::check::Check;
use crate::packet::Packet;

/// Reason for which a script is refused or fails, with the line to look at.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) line: usize,
    pub(crate) text: String,
}

/// A script, ready to run.
#[derive(Debug)]
pub(crate) struct Script {
    /// Names and values of the settings, by the names of Linux's `net.ipv4`.
    pub(crate) settings: Vec<(usize, String, String)>,
    pub(crate) steps: Vec<Step>,
}

#[derive(Debug)]
pub(crate) struct Step {
    pub(crate) line: usize,
    pub(crate) when: When,
    pub(crate) action: Action,
}

/// Time of a step \[ns\].
#[derive(Clone, Copy, Debug)]
pub(crate) enum When {
    /// Whenever the segment leaves.
    Any,
    /// From `from` to `to`, both inclusive: since the step before if `is_relative` is set, otherwise since the beginning.
    Within { is_relative: bool, from: u64, to: u64 },
}

#[derive(Debug)]
pub(crate) enum Action {
    /// `<`: a segment arrives.
    Arrives(Packet),
    /// `>`: a segment must leave.
    Leaves(Packet),
    Calls(Call),
    Checks(Vec<Check>),
}

impl Script {
    pub(crate) fn parse(text: &str) -> Result<Self, Fault> {
        let (code, comments) = without_comments(text)?;
        if !comments.contains("Source:") {
            return Err(Fault { line: 1, text: "no comment names the source of the script (`// Source: …`)".into() });
        }
        let mut cursor = Cursor { text: &code, at: 0 };
        let (mut settings, mut steps) = (Vec::new(), Vec::new());
        if cursor.eats("`") {
            parse_settings(&mut cursor, &mut settings)?;
        }
        while !cursor.is_at_end() {
            let (line, when) = (cursor.line(), cursor.when()?);
            let action = cursor.action()?;
            if matches!(when, When::Any) && !matches!(action, Action::Leaves(_)) {
                return Err(Fault { line, text: "only a segment that leaves may have the time `*`".into() });
            }
            steps.push(Step { line, when, action });
        }
        if !steps.iter().any(|step| matches!(step.action, Action::Leaves(_) | Action::Checks(_))) {
            return Err(Fault { line: 1, text: "the script expects nothing".into() });
        }
        Ok(Self { settings, steps })
    }
}

/// Returns the text with spaces in the place of comments, so that lines keep their numbers, and the comments.
fn without_comments(text: &str) -> Result<(String, String), Fault> {
    let (mut code, mut comments, mut rest) = (String::new(), String::new(), text);
    while let Some(at) = ["//", "/*"].iter().filter_map(|mark| rest.find(mark)).min() {
        code.push_str(&rest[..at]);
        let comment = &rest[at..];
        let line = code.matches('\n').count() + 1;
        let end = if comment.starts_with("//") {
            comment.find('\n').unwrap_or(comment.len())
        } else {
            comment.find("*/").map(|end| end + 2).ok_or_else(|| Fault { line, text: "the comment has no end".into() })?
        };
        comments.push_str(&comment[..end]);
        code.extend(comment[..end].chars().map(|c| if c == '\n' { c } else { ' ' }));
        rest = &comment[end..];
    }
    code.push_str(rest);
    Ok((code, comments))
}

/// Reads the rest of `` `sysctl -q net.ipv4.NAME=VALUE …` ``.
fn parse_settings(cursor: &mut Cursor<'_>, settings: &mut Vec<(usize, String, String)>) -> Result<(), Fault> {
    cursor.needs("sysctl")?;
    cursor.needs("-q")?;
    while !cursor.eats("`") {
        cursor.needs("net.ipv4.")?;
        let line = cursor.line();
        let name = cursor.word().to_owned();
        cursor.needs("=")?;
        settings.push((line, name, cursor.word().to_owned()));
    }
    Ok(())
}

/// Place in the text of a script. All methods skip white space first.
#[derive(Debug)]
pub(crate) struct Cursor<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn rest(&mut self) -> &'a str {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        &self.text[self.at..]
    }

    pub(crate) fn is_at_end(&mut self) -> bool {
        self.rest().is_empty()
    }

    pub(crate) fn line(&mut self) -> usize {
        self.rest();
        self.text[..self.at].matches('\n').count() + 1
    }

    pub(crate) fn fault(&mut self, wanted: &str) -> Fault {
        let line = self.line();
        let found = self.rest().split_whitespace().next().unwrap_or("the end");
        Fault { line, text: format!("`{found}` is not {wanted}") }
    }

    /// Passes over `mark` if it is next.
    pub(crate) fn eats(&mut self, mark: &str) -> bool {
        let is_next = self.rest().starts_with(mark);
        self.at += if is_next { mark.len() } else { 0 };
        is_next
    }

    pub(crate) fn needs(&mut self, mark: &str) -> Result<(), Fault> {
        if self.eats(mark) { Ok(()) } else { Err(self.fault(&format!("`{mark}`"))) }
    }

    /// Takes the text before `end`, and passes over `end`.
    pub(crate) fn until(&mut self, end: &str) -> Result<&'a str, Fault> {
        let rest = self.rest();
        let length = rest.find(end).ok_or_else(|| self.fault(&format!("followed by `{end}`")))?;
        self.at += length + end.len();
        Ok(&rest[..length])
    }

    /// Takes the longest text of characters that `is_part` holds for, which may be empty.
    pub(crate) fn takes(&mut self, is_part: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|c| !is_part(c)).unwrap_or(rest.len())];
        self.at += taken.len();
        taken
    }

    /// Takes letters, digits and underscores.
    pub(crate) fn word(&mut self) -> &'a str {
        self.takes(|c| c.is_alphanumeric() || c == '_')
    }

    pub(crate) fn number<T: FromStr>(&mut self) -> Result<T, Fault> {
        let before = self.at;
        let digits = self.takes(|c| c.is_ascii_digit() || c == '-');
        digits.parse().map_err(|_| {
            self.at = before;
            self.fault("a number in range")
        })
    }

    /// Reads seconds with up to nine decimals, as nanoseconds.
    fn nanos(&mut self) -> Result<u64, Fault> {
        let before = self.at;
        let text = self.takes(|c| c.is_ascii_digit() || c == '.');
        let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
        let number = |digits: &str| if digits.is_empty() { Ok(0) } else { digits.parse::<u64>() };
        match (number(whole), number(&format!("{decimals:0<9}"))) {
            (Ok(seconds), Ok(nanos)) if text.len() > 1 || !whole.is_empty() => Ok(seconds * 1_000_000_000 + nanos),
            _ => {
                self.at = before;
                Err(self.fault("a time in seconds"))
            }
        }
    }

    fn when(&mut self) -> Result<When, Fault> {
        if self.eats("*") {
            return Ok(When::Any);
        }
        let is_relative = self.eats("+");
        let from = self.nanos()?;
        let to = if self.eats("~") {
            if is_relative {
                self.needs("+")?;
            }
            self.nanos()?
        } else {
            from
        };
        Ok(When::Within { is_relative, from, to })
    }

    fn action(&mut self) -> Result<Action, Fault> {
        if self.eats("<") {
            return Packet::parse(self).map(Action::Arrives);
        }
        if self.eats(">") {
            return Packet::parse(self).map(Action::Leaves);
        }
        if self.eats("%{") {
            return Check::parse(self).map(Action::Checks);
        }
        Call::parse(self).map(Action::Calls)
    }
}
