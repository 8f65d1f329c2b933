//! Changes of links by their keys, from the thread of live control to the one that runs.

use std::path::PathBuf;
use std::sync::mpsc::Sender;

use cohaptic_control::LinkEditor;
use cohaptic_scene::LinkKeys;
use cohaptic_wan::LinkModel;

/// A link from now on.
#[derive(Debug)]
pub(crate) struct Edit {
    /// Its number in the description of the run.
    pub(crate) link: usize,
    pub(crate) keys: LinkKeys,
    pub(crate) model: LinkModel,
}

/// The links of a run by their keys. A change is checked here; what makes sense goes to the run.
#[derive(Debug)]
pub(crate) struct KeyedLinks {
    pub(crate) keys: Vec<LinkKeys>,
    /// Where files that keys name are looked for.
    pub(crate) folder: PathBuf,
    pub(crate) changes: Sender<Edit>,
}

impl LinkEditor for KeyedLinks {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        self.keys.get(link).map_or_else(Vec::new, |keys| keys.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect())
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        // All are checked before the first is changed.
        let edits = links.iter().map(|link| {
            let old = self.keys.get(*link).ok_or_else(|| format!("there is no link {link}"))?;
            let new = keys.iter().fold(old.clone(), |laid, (key, value)| laid.with(key, value));
            let model = new.model(&self.folder).map_err(|error| {
                let said = error.diagnostic().map_or_else(|| error.to_string(), |diagnostic| diagnostic.message().to_owned());
                let text = error.diagnostic().and_then(cohaptic_scene::Diagnostic::override_text).unwrap_or_default();
                let at = text.strip_prefix("link.").unwrap_or(text);
                if at.is_empty() { said } else { format!("{at}: {said}") }
            })?;
            Ok(Edit { link: *link, keys: new, model })
        });
        let edits: Vec<Edit> = edits.collect::<Result<_, String>>()?;
        for edit in edits {
            self.keys[edit.link] = edit.keys.clone();
            self.changes.send(edit).map_err(|_| "the run has ended".to_owned())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_change_of_several_links_is_made_whole_or_not_at_all() {
        let (changes, made) = channel();
        let keys = vec![LinkKeys::default().with("delay", "\"8ms\""), LinkKeys::default().with("netem", "\"delay 3ms\"")];
        let mut links = KeyedLinks { keys, folder: PathBuf::new(), changes };
        let loss = |value: &str| vec![("loss".to_owned(), value.to_owned())];
        // The second link is written in words of tc-netem, which no other key stands beside.
        let error = links.change(&[0, 1], &loss("\"1%\"")).unwrap_err();
        assert!(error.contains("netem"), "{error}");
        assert_eq!(links.keys(0), [("delay".to_owned(), "\"8ms\"".to_owned())]);
        assert!(made.try_recv().is_err());
        links.change(&[0], &loss("\"1%\"")).unwrap();
        let edit = made.try_recv().unwrap();
        assert_eq!((edit.link, edit.keys.to_string().as_str()), (0, "{ delay = \"8ms\", loss = \"1%\" }"));
        assert_eq!(edit.model, edit.keys.model(std::path::Path::new("")).unwrap());
        let error = links.change(&[0], &loss("\"1.5\"")).unwrap_err();
        assert!(error.starts_with("loss=") && error.contains("expected"), "{error}");
        assert!(links.change(&[7], &loss("0.1")).is_err());
    }
}
