//! `--curve` and `--against`: the same map or curve of a scene that differs.

use crate::failure::Failure;

/// A scene that a picture is made of.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Variant {
    /// In the legend; of the scene as it stands "as it stands".
    pub(crate) name: String,
    /// What differs from the scene as it stands, on top of all `--set`.
    pub(crate) overrides: Vec<String>,
    /// What the user said it with.
    pub(crate) option: &'static str,
}

impl Variant {
    /// All that a picture shows: the scene as it stands first, then those of `--curve`, then that of `--against`.
    pub(crate) fn all(curves: &[String], against: &[String]) -> Result<Vec<Self>, Failure> {
        let mut all = vec![Self { name: "as it stands".to_owned(), overrides: Vec::new(), option: "--set" }];
        for text in curves {
            let overrides = split(text);
            if let Some(wrong) = overrides.iter().find(|part| !part.contains('=')) {
                return Err(Failure::Input(format!("--curve {text}: {wrong:?} has no =: expected KEY=VALUE, again after a comma if there are more")));
            }
            all.push(Self { name: overrides.join(", "), overrides, option: "--curve" });
        }
        if !against.is_empty() {
            all.push(Self { name: against.join(", "), overrides: against.to_vec(), option: "--against" });
        }
        Ok(all)
    }

    /// Everything that is overridden.
    pub(crate) fn on_top_of(&self, set: &[String]) -> Vec<String> {
        set.iter().chain(&self.overrides).cloned().collect()
    }
}

/// Splits at commas, but for those within brackets, braces and quotes: values may be lists, tables and texts.
fn split(text: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0_u32, None);
    for letter in text.chars() {
        match (quote, letter) {
            (Some(open), _) if open == letter => quote = None,
            (None, '"' | '\'') => quote = Some(letter),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn commas_within_values_do_not_split() {
        assert_eq!(split("scene.count=2"), ["scene.count=2"]);
        assert_eq!(split("scene.count=3, coordination.strategy=average-position"), ["scene.count=3", "coordination.strategy=average-position"]);
        assert_eq!(split("peer.hand={ force = [1.0, 2.0], a = 1 },x=1"), ["peer.hand={ force = [1.0, 2.0], a = 1 }", "x=1"]);
        assert_eq!(split("scene.title=\"a, b\",x='[,'"), ["scene.title=\"a, b\"", "x='[,'"]);
        assert_eq!(split("a=1,"), ["a=1", ""]);
    }
}
