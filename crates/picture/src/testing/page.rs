//! Checks of pages of HTML.

use super::faults;

/// The faults of a page, in sentences; empty if there are none: its tags do not nest, something comes from elsewhere or is a script, or one of its pictures has
/// [`faults`].
#[must_use]
pub fn page_faults(page: &str) -> Vec<String> {
    let mut found = nesting(page);
    // A place within the page is not elsewhere.
    let own = page.replace("url(#", "").replace("href=\"#", "");
    for word in ["src=", "<script", "<link", "@import", "url(", "href=", "<iframe", "<object"] {
        if let Some(place) = own.find(word) {
            let shown: String = own[place..].chars().take(60).collect();
            found.push(format!("something from elsewhere, or a script: {shown}"));
        }
    }
    for (number, part) in page.split("<svg ").skip(1).enumerate() {
        let svg = part.split_once("</svg>").map_or_else(String::new, |(svg, _)| format!("<svg {svg}</svg>"));
        found.extend(faults(&svg).into_iter().map(|fault| format!("picture {}: {fault}", number + 1)));
    }
    found
}

/// Every tag that opens closes, in order, but for the one kind that has no end.
fn nesting(page: &str) -> Vec<String> {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        let Some(length) = rest[start..].find('>') else { return vec!["tags: one does not end".to_owned()] };
        let tag = &rest[start + 1..start + length];
        rest = &rest[start + length + 1..];
        if let Some(closed) = tag.strip_prefix('/') {
            let last = open.pop();
            if last != Some(closed) {
                return vec![format!("tags: </{closed}> closes {last:?}")];
            }
        } else if !tag.ends_with('/') && !tag.starts_with(['!', '?']) && !tag.starts_with("meta ") {
            open.push(tag.split_whitespace().next().unwrap_or_default());
        }
    }
    open.iter().map(|tag| format!("tags: <{tag}> is not closed")).collect()
}
