//! A link by itself: its keys, as they stand in a scene.

use std::path::Path;

use cohaptic_wan::LinkModel;

use crate::SceneError;
use crate::model::Scene;

/// The least scene that has a link.
const AROUND: &str = "scene = { duration = \"1s\", count = 2 }\nobject = { mass = 1.0 }\n\
    coordination = { strategy = \"average-position\", stiffness = 1.0, damping = 1.0, update = \"1ms\" }\n\
    peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\n";

/// The link of these keys: texts `KEY=VALUE`, such as `delay=24ms` and `loss={ gilbert-elliott = { p = 0.01, r = 0.1 } }`, as in `[link]` of a scene.
/// Files that they name are looked for in the current folder.
///
/// # Errors
///
/// [`SceneError`], whose [`override_text`](crate::Diagnostic::override_text) is `link.` and the text with the fault.
pub fn link_from_keys(keys: &[String]) -> Result<LinkModel, SceneError> {
    let overrides: Vec<String> = keys.iter().map(|key| format!("link.{key}")).collect();
    let scene = Scene::parse(AROUND, Path::new("link.toml"), &overrides)?;
    Ok(scene.links.between(0, 1).clone())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::Probability;
    use cohaptic_wan::{Delay, Distribution, Jitter, LinkConfig, Loss};

    use super::*;

    fn link(keys: &[&str]) -> Result<LinkModel, SceneError> {
        link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn keys_make_the_link_that_they_make_in_a_scene() {
        let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(2), Distribution::Normal)).unwrap();
        let expected = LinkConfig { delay, loss: Loss::Independent(Probability::new(0.01).unwrap()), ..LinkConfig::default() };
        assert_eq!(link(&["delay=24ms", "jitter={ sd = \"2ms\" }", "loss=1%"]).unwrap(), expected.into());
        assert_eq!(link(&[]).unwrap(), LinkModel::default());
    }

    #[test]
    fn a_fault_names_the_text_that_has_it() {
        for (keys, text) in [
            (["delay=24ms", "los=1%"], "link.los=1%"),
            (["delay=24 parsecs", "loss=1%"], "link.delay=24 parsecs"),
            (["delay", "loss=1%"], "link.delay"),
        ] {
            let error = link(&keys).unwrap_err();
            let diagnostic = error.diagnostic().unwrap();
            assert_eq!(diagnostic.override_text(), Some(text), "{error}");
            assert!(diagnostic.message().contains("expected"), "{error}");
        }
    }
}
