//! Variants of a scene for `--curve` and `--against`: the same map or curve is drawn for each variant.

use cohaptic_campaign::split_at_commas;

use crate::failure::Failure;

/// Variant of a scene in a picture.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Variant {
    /// Name in documents and messages. The unchanged scene is called "as it stands". Legends name the law: see [`cohaptic_answers::legend_name`].
    pub(crate) name: String,
    /// Overrides of the variant, applied after all `--set`.
    pub(crate) overrides: Vec<String>,
    /// Option of the overrides, for messages.
    pub(crate) option: &'static str,
}

impl Variant {
    /// Returns the variants of a picture: the unchanged scene, then one variant per `--curve`, then the variant of `--against`.
    ///
    /// # Errors
    ///
    /// [`Failure::Input`] if a part of `--curve` is not of the form `KEY=VALUE`.
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

    /// Returns all overrides of the variant: the overrides `set`, then the variant's own.
    pub(crate) fn on_top_of(&self, set: &[String]) -> Vec<String> {
        set.iter().chain(&self.overrides).cloned().collect()
    }
}
