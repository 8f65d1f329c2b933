//! Checks of HTML pages.

use super::faults;

/// Returns the faults of a page as sentences; empty without a fault. A fault is a wrongly nested tag, external content, a script, or a fault of a picture
/// as in [`faults`].
#[must_use]
pub fn page_faults(page: &str) -> Vec<String> {
    let mut found = nesting(page);
    // References inside the page are not external.
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

/// Checks that every opened tag is closed in order, except tags that have no end.
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
