//! Every seed passes its target, without libFuzzer: a crash that was mended stays mended.

use std::fs;
use std::path::{Path, PathBuf};

use crate::TARGETS;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())).map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn every_seed_passes() {
    for (name, run) in TARGETS {
        let seeds = files(&folder().join("seeds").join(name));
        assert!(!seeds.is_empty(), "{name} has no seed");
        for seed in seeds {
            println!("{}", seed.display());
            let bytes = fs::read(seed).unwrap();
            assert!(bytes.len() <= 8192, "a seed is small");
            run(&bytes);
        }
    }
}

#[test]
fn every_target_has_a_program() {
    let named: Vec<String> = files(&folder().join("targets")).iter().map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    assert_eq!(named, TARGETS.map(|(name, _)| name.to_owned()));
}
