//! Elements of pages, well formed by construction.

use std::fmt::Write as _;

use super::Table;
use crate::{Gauge, escape};

/// A part of a page. Texts are escaped when they become a part.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Html {
    text: String,
}

/// Judgement shown by a colour. The words with the mark must express the judgement too, for readers without colours.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mark {
    /// Success.
    Good,
    /// Partial success.
    Partly,
    /// Failure.
    Bad,
}

impl From<&str> for Html {
    fn from(text: &str) -> Self {
        Self::text(text)
    }
}

impl From<String> for Html {
    fn from(text: String) -> Self {
        Self::text(&text)
    }
}

impl Html {
    /// Makes a part from a text.
    #[must_use]
    pub fn text(text: &str) -> Self {
        Self { text: escape(text) }
    }

    /// Appends more content.
    #[must_use]
    pub fn and(mut self, more: impl Into<Self>) -> Self {
        self.text.push_str(&more.into().text);
        self
    }

    /// Makes a paragraph.
    #[must_use]
    pub fn paragraph(content: impl Into<Self>) -> Self {
        Self::line("p", &content.into())
    }

    /// Makes a paragraph in the colour of a failure.
    #[must_use]
    pub fn warning(content: impl Into<Self>) -> Self {
        Self { text: format!("<p class=\"warning\">{}</p>\n", content.into().text) }
    }

    /// Makes a heading of level 2 or 3. Level 1 is the title of the page.
    #[must_use]
    pub fn heading(level: u8, content: impl Into<Self>) -> Self {
        Self::line(if level <= 2 { "h2" } else { "h3" }, &content.into())
    }

    /// Makes a section with a name for links.
    #[must_use]
    pub fn section(name: &str, content: impl Into<Self>) -> Self {
        Self { text: format!("<section id=\"{}\">\n{}</section>\n", escape(name), content.into().text) }
    }

    /// Makes a link to a section of the page.
    #[must_use]
    pub fn link(name: &str, content: impl Into<Self>) -> Self {
        Self { text: format!("<a href=\"#{}\">{}</a>", escape(name), content.into().text) }
    }

    /// Makes a list.
    #[must_use]
    pub fn list(items: impl IntoIterator<Item = Self>) -> Self {
        let items: String = items.into_iter().map(|item| format!("<li>{}</li>\n", item.text)).collect();
        Self { text: format!("<ul>\n{items}</ul>\n") }
    }

    /// Makes words in the colour of a judgement.
    #[must_use]
    pub fn mark(mark: Mark, words: &str) -> Self {
        let class = match mark {
            Mark::Good => "good",
            Mark::Partly => "partly",
            Mark::Bad => "bad",
        };
        Self { text: format!("<b class=\"{class}\">{}</b>", escape(words)) }
    }

    /// Makes a list of names with their values.
    #[must_use]
    pub fn facts<'a>(facts: impl IntoIterator<Item = (&'a str, Self)>) -> Self {
        let facts: String = facts.into_iter().map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>\n", escape(name), value.text)).collect();
        Self { text: format!("<dl>\n{facts}</dl>\n") }
    }

    /// Makes a short piece of a file or a command.
    #[must_use]
    pub fn code(text: &str) -> Self {
        Self { text: format!("<code>{}</code>", escape(text)) }
    }

    /// Places parts below each other, for a table cell.
    #[must_use]
    pub fn lines(lines: impl IntoIterator<Item = Self>) -> Self {
        Self { text: lines.into_iter().map(|line| format!("<div>{}</div>", line.text)).collect() }
    }

    /// Makes words that stand out.
    #[must_use]
    pub fn strong(words: &str) -> Self {
        Self { text: format!("<strong>{}</strong>", escape(words)) }
    }

    /// Places parts beside each other, as many as the screen has room for, and the others below.
    #[must_use]
    pub fn beside(parts: impl IntoIterator<Item = Self>) -> Self {
        let parts: String = parts.into_iter().map(|part| format!("<div>\n{}</div>\n", part.text)).collect();
        Self { text: format!("<div class=\"beside\">\n{parts}</div>\n") }
    }

    /// Makes preformatted text, such as the lines of a file or the output of a command.
    #[must_use]
    pub fn preformatted(text: &str) -> Self {
        Self { text: format!("<pre>{}</pre>\n", escape(text)) }
    }

    /// Makes content that is hidden until opened.
    #[must_use]
    pub fn details(summary: &str, content: impl Into<Self>) -> Self {
        Self { text: format!("<details>\n<summary>{}</summary>\n{}</details>\n", escape(summary), content.into().text) }
    }

    /// Makes a figure with a name for links, or without a name if `name` is empty.
    #[must_use]
    pub fn figure(name: &str, content: impl Into<Self>) -> Self {
        // HTML forbids an empty `id`.
        let name = if name.is_empty() { String::new() } else { format!(" id=\"{}\"", escape(name)) };
        Self { text: format!("<figure{name}>\n{}</figure>\n", content.into().text) }
    }

    /// Embeds the SVG document of [`Picture::svg`](crate::Picture::svg).
    #[must_use]
    pub fn picture(svg: &str) -> Self {
        // Without its XML declaration, an SVG document can be embedded in a page unchanged.
        let svg = svg.find("<svg").map_or("", |start| &svg[start..]);
        Self { text: format!("<div class=\"wide\">{svg}</div>\n") }
    }

    /// Makes the caption of a figure.
    #[must_use]
    pub fn caption(content: impl Into<Self>) -> Self {
        Self::line("figcaption", &content.into())
    }

    /// Makes a small bar for a table cell.
    #[must_use]
    pub fn gauge(gauge: &Gauge) -> Self {
        Self { text: gauge.svg() }
    }

    /// Makes a table, scrollable if wider than the page.
    #[must_use]
    pub fn table(table: &Table) -> Self {
        // The `div` gets the scroll bar, so that a wide table does not widen the page.
        let mut text = "<div class=\"wide\">\n<table>\n".to_owned();
        if !table.title.is_empty() {
            let _ = writeln!(text, "<caption>{}</caption>", escape(&table.title));
        }
        text.push_str("<thead>");
        let class = |number: bool| if number { " class=\"number\"" } else { "" };
        if !table.groups.is_empty() {
            text.push_str("<tr>");
            for (name, columns) in &table.groups {
                // A cell without a name is no heading.
                let element = if name.is_empty() { "td" } else { "th scope=\"colgroup\"" };
                let end = if name.is_empty() { "td" } else { "th" };
                let _ = write!(text, "<{element} class=\"group\" colspan=\"{columns}\">{}</{end}>", escape(name));
            }
            text.push_str("</tr>\n");
        }
        text.push_str("<tr>");
        for (name, number) in &table.columns {
            let _ = write!(text, "<th scope=\"col\"{}>{}</th>", class(*number), escape(name));
        }
        text.push_str("</tr></thead>\n<tbody>\n");
        for row in &table.rows {
            text.push_str("<tr>");
            for (place, cell) in row.iter().enumerate() {
                // A cell beyond the named columns counts as text.
                let number = class(table.columns.get(place).is_some_and(|(_, number)| *number));
                // The first cell is the row's heading, so that a screen reader can name the row at each cell.
                let (open, close) = if place == 0 { ("<th scope=\"row\"", "</th>") } else { ("<td", "</td>") };
                let _ = write!(text, "{open}{number}>{}{close}", cell.text);
            }
            text.push_str("</tr>\n");
        }
        text.push_str("</tbody>\n</table>\n</div>\n");
        Self { text }
    }

    /// Returns the part as it stands in a page.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.text
    }

    fn line(element: &str, content: &Self) -> Self {
        Self { text: format!("<{element}>{}</{element}>\n", content.text) }
    }
}
