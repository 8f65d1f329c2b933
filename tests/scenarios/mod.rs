//! Every shipped scene does what its `[expect]` says.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]

use std::path::PathBuf;
use std::sync::Mutex;

use cohaptic_harness::Model;
use cohaptic_harness::check::check;
use cohaptic_scene::Scene;
use cohaptic_tests::shipped_scenes;

#[test]
fn every_shipped_scene_meets_its_expectations() {
    let left: Mutex<Vec<PathBuf>> = Mutex::new(shipped_scenes());
    let failures: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, Into::into);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(path) = next(&left) {
                    let scene = Scene::read(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
                    assert!(scene.expect.is_some(), "{} expects nothing", path.display());
                    let lines = check(&scene, Model::Least, || true).into_iter().map(|line| format!("{}: {line}", path.display()));
                    failures.lock().unwrap().extend(lines);
                }
            });
        }
    });
    let mut failures = failures.into_inner().unwrap();
    failures.sort();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn the_scene_in_the_readme_is_what_it_says() {
    let readme = include_str!("../../README.md");
    let (_, rest) = readme.split_once("```toml\n").expect("the README shows a scene");
    let (text, _) = rest.split_once("```").expect("the scene ends");
    let scene = Scene::parse(text, "README.md".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(check(&scene, Model::Least, || true), Vec::<String>::new());
}

fn next(left: &Mutex<Vec<PathBuf>>) -> Option<PathBuf> {
    left.lock().unwrap().pop()
}
