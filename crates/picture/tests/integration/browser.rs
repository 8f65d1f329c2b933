//! The gallery in a browser, if a browser is installed.

use cohaptic_picture::page::{Html, Mark, Page, Table};
use cohaptic_picture::testing::{Scheme, computed_colours, faults, in_browser, page_in_browser};

use crate::gallery::gallery;

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_browser_shows_every_text_of_every_kind_of_picture_inside_and_apart() {
    let pictures: Vec<(String, String)> = gallery().into_iter().map(|(name, picture)| (name, picture.svg())).collect();
    let found: Vec<String> = pictures.iter().flat_map(|(name, svg)| faults(svg).into_iter().map(move |fault| format!("{name}: {fault}"))).collect();
    assert!(found.is_empty(), "by the stored widths:\n{}", found.join("\n"));
    if let Ok(folder) = std::env::var("COHAPTIC_GALLERY") {
        for (name, svg) in &pictures {
            std::fs::write(std::path::Path::new(&folder).join(format!("{name}.svg")), svg).unwrap();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    match in_browser(folder.path(), &pictures) {
        Some(found) => assert!(found.is_empty(), "in the browser:\n{}", found.join("\n")),
        None => eprintln!("skipped: there is no chromium"),
    }
}

/// Returns a page with a picture of each kind and with each mark.
fn page() -> String {
    let pictures = gallery().into_iter().filter(|(name, _)| name.ends_with("-page"));
    let figures = pictures.fold(Html::default(), |before, (name, picture)| before.and(Html::figure(&name, Html::picture(&picture.svg()))));
    let marks = [(Mark::Good, "good"), (Mark::Partly, "partly"), (Mark::Bad, "bad")].map(|(mark, word)| Html::mark(mark, word));
    Page::new("Each kind of picture").with(Html::list(marks)).with(Html::warning("A warning")).with(figures).with(long_words()).html()
}

/// Returns each kind of text with a word that is longer than a line on a phone, and a table that is wider than a phone. On paper the words of its cells break.
fn long_words() -> Html {
    let word = "coordination.strategy=average-position,peers.participant.coupling.stiffness=3500".replace(['-', '.'], "_");
    let table = (0..12).fold(Table::new().column("key"), |table, column| table.column(format!("column {column}")));
    let table = Html::table(&table.row((0..13).map(|_| Html::code(&word))));
    let texts = [Html::code(&word), Html::link("nowhere", word.as_str()), Html::mark(Mark::Good, &word), Html::text(&word)];
    let lines = Html::heading(3, word.as_str()).and(Html::list(texts.clone())).and(Html::facts([(word.as_str(), Html::code(&word))]));
    let content = texts.into_iter().fold(lines, |content, text| content.and(Html::paragraph(text))).and(Html::preformatted(&word));
    content.and(Html::figure("long", Html::caption(word.as_str()))).and(Html::details(&word, table.clone())).and(table)
}

/// Checks the colours drawn and not the style sheet, because a browser ignores a rule it cannot read.
#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_browser_draws_other_colours_for_readers_who_prefer_dark() {
    let folder = tempfile::tempdir().unwrap();
    let colours = |scheme| computed_colours(folder.path(), &page(), scheme);
    let (Some(light), Some(dark)) = (colours(Scheme::Light), colours(Scheme::Dark)) else {
        eprintln!("skipped: there is no chromium");
        return;
    };
    let of = |lines: &[String], element: &str| -> Vec<String> {
        let line = lines.iter().find(|line| line.split('|').next() == Some(element)).unwrap_or_else(|| panic!("no {element} in {lines:?}"));
        line.split('|').skip(1).map(str::to_owned).collect()
    };
    // Fill, stroke, text and background. #fff and #14181d are the backgrounds; #0072b2 and #4aa8e8 belong to the first line.
    for (element, place, on_white, on_black) in [
        ("rect.paper", 0, "rgb(255, 255, 255)", "rgb(20, 24, 29)"),
        ("body.", 3, "rgb(255, 255, 255)", "rgb(20, 24, 29)"),
        ("text.ink", 0, "rgb(27, 31, 36)", "rgb(230, 233, 236)"),
        ("path.line s0", 1, "rgb(0, 114, 178)", "rgb(74, 168, 232)"),
        ("path.f1", 0, "rgb(213, 94, 0)", "rgb(255, 130, 55)"),
        ("path.hatching", 1, "rgb(87, 96, 106)", "rgb(163, 171, 180)"),
        ("b.bad", 2, "rgb(155, 28, 28)", "rgb(255, 143, 143)"),
    ] {
        assert_eq!((of(&light, element)[place].as_str(), of(&dark, element)[place].as_str()), (on_white, on_black), "{element}");
    }
    // Colours of cells stand for values, and hatchings are patterns, whose path is checked above. All other drawn elements change.
    let drawn = |element: &str| ["path.", "rect.", "circle.", "text."].iter().any(|kind| element.starts_with(kind));
    let mut seen = 0;
    for element in light.iter().filter_map(|line| line.split('|').next()).filter(|element| drawn(element)) {
        if !["cells", "hatch", "back-hatch"].iter().any(|class| element.ends_with(&format!(".{class}"))) {
            assert_ne!(of(&light, element)[..2], of(&dark, element)[..2], "{element} looks alike in both");
            seen += 1;
        }
    }
    assert!(seen >= 20, "{seen}");
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_browser_shows_pages_without_scrolling_sideways_and_texts_apart() {
    let folder = tempfile::tempdir().unwrap();
    let Some(found) = page_in_browser(folder.path(), &page()) else {
        eprintln!("skipped: there is no chromium");
        return;
    };
    assert_eq!(found, [""; 0]);
    for (width, windows) in [("3000px", &["phone", "laptop"][..]), ("500px", &["phone"])] {
        let wide = page().replace("<main>", &format!("<main style=\"width:{width};max-width:none\">"));
        let mut found = page_in_browser(folder.path(), &wide).unwrap();
        found.retain(|fault| fault.starts_with("the page is wider"));
        assert!(found.iter().zip(windows).all(|(fault, window)| fault.contains(window)) && found.len() == windows.len(), "{width}: {found:?}");
    }
    // On a screen a wide table scrolls in its box. A sheet of paper does not scroll.
    let long = Table::new().column("a").row([Html::text(&"key.".repeat(60))]);
    let table = Page::new("A wide table").with(Html::table(&long)).html();
    assert_eq!(page_in_browser(folder.path(), &table).unwrap(), [""; 0]);
    let screen = table.replace("@media print", "@media speech");
    assert!(page_in_browser(folder.path(), &screen).unwrap().iter().any(|fault| fault.starts_with("a table or picture is cut off on paper")));
}
