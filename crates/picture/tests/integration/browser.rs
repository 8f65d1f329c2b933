//! The gallery in a browser, where there is one.

use cohaptic_picture::testing::{faults, in_browser};

use crate::gallery::gallery;

#[test]
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
