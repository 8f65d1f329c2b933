//! Comparison of the pictures of pages with the pictures that their commands draw.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::pages::prose::links;
use crate::pages::{PAGES, markdown, root};

/// Pictures that no page draws, each with its origin. A name that ends in `/` is a folder.
const DRAWN_ELSEWHERE: [(&str, &str); 6] = [
    ("docs/images/campaign.svg", "crates/cli/tests/integration/page_pictures.rs, with more runs than its page has time for"),
    ("docs/images/gallery/bufferbloat.svg", "tests/examples/bufferbloat.rs, whose test compares the picture"),
    ("docs/images/live-control.png", "a browser, by hand"),
    ("docs/images/matplotlib.svg", "python/examples/paper_figure.py with coordination/n3.toml; the bytes depend on the version of matplotlib"),
    ("docs/images/play.png", "crates/cli/tests/integration/live/play_page.rs, with COHAPTIC_SCREENSHOTS"),
    ("docs/images/measured/", "benches/measure"),
];

/// Picture that a page shows.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Drawn {
    /// Line of the comment, counted from 0.
    pub(crate) line: usize,
    /// The file that the commands of the page write.
    pub(crate) by_commands: String,
    /// The file that the page shows, from the project's folder.
    pub(crate) shown: PathBuf,
}

/// Returns the pictures below the comments `drawn: FILE` of a page.
///
/// # Panics
///
/// If no picture stands there.
pub(crate) fn drawn(page: &str, text: &str) -> Vec<Drawn> {
    let lines: Vec<&str> = text.lines().collect();
    let folder = Path::new(page).parent().unwrap();
    let mut found = Vec::new();
    for (line, comment) in lines.iter().enumerate() {
        let Some(by_commands) = comment.strip_prefix("<!-- drawn: ").and_then(|rest| rest.strip_suffix(" -->")) else { continue };
        let below = links(lines.get(line + 1).copied().unwrap_or_default());
        let [picture] = &below[..] else { panic!("{page}:{}: one picture stands in the line below", line + 1) };
        assert!(picture.is_picture, "{page}:{}: {} is no picture", line + 1, picture.target);
        found.push(Drawn { line, by_commands: by_commands.to_owned(), shown: folder.join(&picture.target) });
    }
    found
}

#[test]
fn every_picture_is_drawn_by_a_command_of_a_page_or_elsewhere() {
    let root = root();
    let (mut paths, mut shown, mut faults) = (Vec::new(), BTreeSet::new(), Vec::new());
    markdown(&root, &mut paths);
    let read = |path: &PathBuf| (path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned(), fs::read_to_string(path).unwrap());
    let pages: Vec<(String, String)> = paths.iter().map(read).collect();
    let tested = pages.iter().filter(|(page, _)| PAGES.contains(&page.as_str()));
    let by_commands: BTreeSet<PathBuf> = tested.flat_map(|(page, text)| drawn(page, text)).map(|drawn| drawn.shown).collect();
    for (page, text) in &pages {
        for picture in links(text).into_iter().filter(|link| link.is_picture && !link.target.contains("://")) {
            let file = Path::new(page).parent().unwrap().join(picture.target);
            if !by_commands.contains(&file) && !DRAWN_ELSEWHERE.iter().any(|(name, _)| file.to_str().unwrap().starts_with(name)) {
                faults.push(format!(
                    "{page} shows {}, and no comment `drawn: FILE` above it, here or on another page, says what draws it",
                    file.display()
                ));
            }
            shown.insert(file);
        }
    }
    for entry in fs::read_dir(root.join("docs/images")).unwrap().map(Result::unwrap).filter(|entry| entry.path().is_file()) {
        let file = Path::new("docs/images").join(entry.file_name());
        if !shown.contains(&file) {
            faults.push(format!("no page shows {}", file.display()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_drawn_picture_stands_below_its_comment() {
    let text = "Text\n\n<!-- drawn: out/map.svg -->\n![a map](images/map.svg)\n";
    let wanted = Drawn { line: 2, by_commands: "out/map.svg".to_owned(), shown: PathBuf::from("docs/images/map.svg") };
    assert_eq!(drawn("docs/a.md", text), [wanted]);
    assert!(std::panic::catch_unwind(|| drawn("docs/a.md", "<!-- drawn: a.svg -->\n\n![a map](a.svg)\n")).is_err());
    assert!(std::panic::catch_unwind(|| drawn("docs/a.md", "<!-- drawn: a.svg -->\n[a map](a.svg)\n")).is_err());
}
