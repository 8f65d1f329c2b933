//! HTML pages, each a single file without scripts and without external content, fit for opening from a folder or sending by mail.
//!
//! A [`Page`] has a title and [`Html`] content made of texts, tables and pictures. Pages are always well formed, because texts are escaped at their entry.
//! Pages and their pictures are light or dark by the reader's preference. Equal contents give equal bytes.
//!
//! ```
//! use cohaptic_picture::page::{Html, Page};
//!
//! let page = Page::new("A <title>").with(Html::paragraph("1 < 2")).html();
//! assert!(page.contains("<h1>A &lt;title&gt;</h1>") && page.contains("<p>1 &lt; 2</p>"));
//! ```

mod content;
mod style;
mod table;

use std::fmt::Write as _;

use crate::escape;

pub use content::{Html, Mark};
pub(crate) use style::STYLE;
pub use table::Table;

/// A page with a title and content.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Page {
    title: String,
    content: Html,
}

impl Page {
    /// Creates a page without content.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), content: Html::default() }
    }

    /// Appends content.
    #[must_use]
    pub fn with(self, content: impl Into<Html>) -> Self {
        Self { title: self.title, content: self.content.and(content) }
    }

    /// Returns the page as a document.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let mut page = String::new();
        // The `meta` element with the colour scheme lets a browser choose the background before reading the styles.
        let _ = write!(
            page,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{}</main>\n\
             </body>\n</html>\n",
            crate::look::style(),
            self.content.as_str()
        );
        page
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Gauge, Line, Look, Panel, Picture};

    const HOSTILE: &str = "<script>alert(\"1\")</script> & 'more' \u{202e}";

    fn everything() -> Page {
        let picture = Picture::new(HOSTILE).panel(Panel::new(Axis::new("x"), Axis::new("y")).with(Line::new([(0.0, 1.0), (1.0, 2.0)], Look::of(0))));
        let table = Table::new()
            .column(HOSTILE)
            .number("value")
            .group(HOSTILE, 2)
            .titled(HOSTILE)
            .row([Html::text(HOSTILE), Html::gauge(&Gauge { low: None, high: Some(1.0), measured: Some(2.0), passed: false })]);
        let content = Html::paragraph(HOSTILE)
            .and(Html::warning(HOSTILE))
            .and(Html::beside([Html::text(HOSTILE), Html::strong(HOSTILE)]))
            .and(Html::heading(2, HOSTILE))
            .and(Html::list([Html::link(HOSTILE, HOSTILE), Html::mark(Mark::Bad, HOSTILE)]))
            .and(Html::facts([(HOSTILE, Html::code(HOSTILE))]))
            .and(Html::details(HOSTILE, Html::preformatted(HOSTILE)))
            .and(Html::figure(HOSTILE, Html::picture(&picture.svg()).and(Html::caption(HOSTILE))));
        Page::new(HOSTILE).with(Html::section(HOSTILE, content.and(Html::table(&table))))
    }

    #[test]
    fn texts_are_escaped_wherever_they_stand() {
        let page = everything().html();
        assert!(!page.contains("<script") && !page.contains('\u{202e}'), "{page}");
        assert_eq!(page, everything().html());
        // Each insertion once, the title of the page twice, and the title of the picture in its `<title>` too.
        assert!(page.matches("&lt;script&gt;").count() >= 20, "{page}");
    }

    #[test]
    fn a_table_has_its_caption_its_groups_and_its_columns() {
        let table = Table::new().column("name").number("one").number("two").group("", 1).group("both", 2).titled("What it is");
        let html = Html::table(&table.row(["a", "1", "2"].map(Html::text)));
        assert_eq!(
            html.as_str().replace('\n', ""),
            "<div class=\"wide\"><table><caption>What it is</caption><thead><tr><td class=\"group\" colspan=\"1\"></td>\
             <th scope=\"colgroup\" class=\"group\" colspan=\"2\">both</th></tr>\
             <tr><th scope=\"col\">name</th><th scope=\"col\" class=\"number\">one</th><th scope=\"col\" class=\"number\">two</th></tr></thead>\
             <tbody><tr><th scope=\"row\">a</th><td class=\"number\">1</td><td class=\"number\">2</td></tr></tbody></table></div>"
        );
    }

    #[test]
    fn a_page_is_one_well_formed_document_without_anything_from_elsewhere() {
        let page = everything().html();
        assert_eq!(crate::testing::page_faults(&page), [""; 0]);
        for (old, new, fault) in [
            ("<h1>", "<h1><b>", "tags"),
            ("<main>", "<main><img src=\"x.png\">", "from elsewhere"),
            ("<main>", "<main><a href=\"https://example.org\">there</a>", "from elsewhere"),
            ("<main>", "<main><script>1</script>", "from elsewhere"),
        ] {
            let found = crate::testing::page_faults(&page.replacen(old, new, 1));
            assert!(found.iter().any(|sentence| sentence.contains(fault)), "{new}: {found:?}");
        }
    }
}
