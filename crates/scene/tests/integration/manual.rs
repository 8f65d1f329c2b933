//! The examples in the manual of scene files, as this crate reads them.

use std::fs;
use std::path::Path;

use cohaptic_scene::Scene;

#[test]
fn the_example_of_the_manual_is_a_scene() {
    let manual = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scenes.md")).unwrap();
    let example = manual.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = Scene::parse(example, Path::new("example.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.peers.len(), scene.peers[1].device.mass, scene.links.configs().len()), (3, 0.1, 2));

    let overrides: Vec<&str> = manual.split("--set ").skip(1).filter_map(|rest| rest.split('`').next()).filter(|text| text.contains('=')).collect();
    let wanted: Vec<String> = overrides
        .iter()
        .map(|text| text.trim_matches('\'').to_owned())
        .filter(|text| !text.contains(['\n', 'V']) && !text.starts_with("expect.travel"))
        .collect();
    assert!(wanted.len() >= 5, "{wanted:?}");
    for text in wanted {
        Scene::parse(example, Path::new("example.toml"), std::slice::from_ref(&text)).unwrap_or_else(|error| panic!("{error}"));
    }
}
