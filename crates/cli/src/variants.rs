//! `--curve` and `--against`: the same map or curve of a scene that differs.

use cohaptic_campaign::split_at_commas;

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
            let overrides = split_at_commas(text);
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
