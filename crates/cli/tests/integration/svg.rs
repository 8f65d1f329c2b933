//! As much of an XML reader as it takes to see that a plot is one well-formed document.

/// The texts between tags, without white space around them.
pub(crate) fn words(svg: &str) -> Vec<String> {
    assert!(!svg.contains(|letter: char| letter.is_control() && letter != '\n'), "a control character");
    let (mut open, mut words, mut rest) = (Vec::new(), Vec::new(), svg.trim());
    while let Some(start) = rest.find('<') {
        let text = rest[..start].trim();
        assert!(text.is_empty() || !open.is_empty(), "text outside of the document: {text:?}");
        words.extend((!text.is_empty()).then(|| unescape(text)));
        let end = start + rest[start..].find('>').expect("every tag ends");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        assert!(!tag.contains('<'), "a tag within a tag: {tag:?}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name.trim()), "tags nest");
        } else if !tag.starts_with(['?', '!']) {
            let (name, attributes) = tag.split_once(char::is_whitespace).unwrap_or((tag, ""));
            let attributes = attributes.trim_end_matches('/');
            assert!(attributes.matches('"').count().is_multiple_of(2), "quotes come in pairs: {tag:?}");
            attributes.split('"').skip(1).step_by(2).for_each(|value| drop(unescape(value)));
            if !tag.ends_with('/') {
                open.push(name);
            }
        }
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "the document ends: {open:?} {rest:?}");
    assert!(svg.trim_start().starts_with("<svg") && svg.contains("http://www.w3.org/2000/svg"));
    words
}

const ENTITIES: [(&str, &str); 6] = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&#39;", "'"), ("&amp;", "&")];

fn unescape(text: &str) -> String {
    let known: usize = ENTITIES.iter().map(|(entity, _)| text.matches(entity).count()).sum();
    assert_eq!(text.matches('&').count(), known, "{text:?}");
    ENTITIES.iter().fold(text.to_owned(), |plain, (entity, letter)| plain.replace(entity, letter))
}
