//! Scenes: a text is a scene, which its own text gives again, or is refused in words that can be shown.

use std::path::Path;

use cohaptic_scene::{Scene, SceneError, scene_content_of_text, scene_text};

/// The folder has the small files that a scene with every key names.
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/scene/tests/integration/data/scene.toml");
/// More peers than a shipped scene lists. A scene may say `count = 1000000`, which takes two gigabytes.
const MOST_PEERS: i64 = 64;

/// The bytes are a scene and, each after a zero byte, overrides.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let mut parts = text.split('\0');
    let text = parts.next().unwrap_or_default();
    let overrides: Vec<String> = parts.map(str::to_owned).collect();
    if has_many_peers(text)
        || overrides.iter().any(|over| over.contains("count"))
        || leaves_folder(text)
        || overrides.iter().any(|over| leaves_folder(over))
    {
        return;
    }
    let file = Path::new(FILE);
    let run = Scene::parse(text, file, &overrides);
    match Scene::parse_live(text, file, &overrides) {
        Ok(scene) => {
            let written = scene_text(text, file, &overrides).unwrap();
            let again = Scene::parse_live(&written, file, &[]).unwrap_or_else(|error| panic!("{error}\n{written}"));
            assert!(again == scene, "{written}");
            assert_eq!(scene_content_of_text(text, file, &overrides).unwrap(), scene_content_of_text(&written, file, &[]).unwrap());
            assert_eq!(scene.fingerprint(), again.fingerprint());
        }
        Err(error) => {
            assert!(run.is_err(), "a scene is no live scene: {error}");
            check(&error);
        }
    }
    if let Err(error) = run {
        check(&error);
    }
}

fn has_many_peers(text: &str) -> bool {
    let count = |table: toml::Table| table.get("scene")?.get("count")?.as_integer();
    text.contains("count") && toml::from_str(text).ok().and_then(count).is_some_and(|count| count > MOST_PEERS)
}

/// Returns whether a text may name a file outside of the folder, which could be a device without an end.
fn leaves_folder(text: &str) -> bool {
    ["..", "\"/", "'/", "\"\\", "=/", "= /"].iter().any(|part| text.contains(part))
}

/// Every refusal says where and what was expected, and holds no control characters but the ends of its lines.
fn check(error: &SceneError) {
    let shown = error.to_string();
    assert!(shown.chars().all(|letter| letter == '\n' || !letter.is_control()), "{shown:?}");
    assert!(shown.lines().count() >= 4 && shown.contains("expected"), "{shown}");
    // The message of a reader that answers nothing without saying why.
    assert!(!shown.contains("the scene is refused"), "{shown}");
    let place = error.diagnostic().unwrap();
    assert!(place.line() >= 1 && place.column() >= 1 && place.shown_line().chars().count() <= 202);
}
