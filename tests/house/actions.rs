//! The action of GitHub and the workflows: `action.yml`, `.github/workflows` and the workflows of pages can be read, and name inputs and commands that exist.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::house::{files, root};

/// A value of YAML as far as these files use it: maps and lists by indentation, and texts.
#[derive(Debug)]
enum Yaml {
    Text(String),
    List(Vec<Self>),
    Map(Vec<(String, Self)>),
}

impl Yaml {
    /// Reads a text. Whatever the files do not use is refused: tabs, anchors, several documents.
    fn read(text: &str) -> Self {
        let is_content = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        let lines: Vec<&str> = text.lines().collect();
        let mut at = 0;
        let read = Self::block(&lines, &mut at, 0);
        assert!(lines[at..].iter().all(|line| !is_content(line)), "not read: {:?}", lines.get(at));
        read
    }

    fn block(lines: &[&str], at: &mut usize, indent: usize) -> Self {
        let (mut map, mut list) = (Vec::new(), Vec::new());
        while let Some(line) = lines.get(*at) {
            let content = line.trim_start();
            if content.is_empty() || content.starts_with('#') {
                *at += 1;
                continue;
            }
            assert!(!line.contains('\t') && !content.starts_with(['&', '*', '-']) || content.starts_with("- ") || content == "-", "{line}");
            let deep = line.len() - content.len();
            if deep < indent {
                break;
            }
            assert_eq!(deep, indent, "an indentation that nothing has opened: {line}");
            if let Some(element) = content.strip_prefix("- ") {
                // The first key of an element stands two columns after the dash, as all keys of the element do.
                let same = " ".repeat(deep + 2) + element;
                let mut own: Vec<&str> = lines.to_vec();
                own[*at] = &same;
                list.push(if is_entry(element) { Self::block(&own, at, deep + 2) } else { Self::scalar(&own, at, element, deep) });
            } else {
                let (key, value) = split(content).unwrap_or_else(|| panic!("no key: {line}"));
                let value = Self::scalar(lines, at, value, deep);
                assert!(map.iter().all(|(other, _)| *other != key), "given twice: {key}");
                map.push((key, value));
            }
        }
        assert!(map.is_empty() || list.is_empty(), "a list and a map in one place");
        if list.is_empty() { Self::Map(map) } else { Self::List(list) }
    }

    /// Reads the value after a key or a dash, with the lines below that belong to the value.
    fn scalar(lines: &[&str], at: &mut usize, value: &str, deep: usize) -> Self {
        *at += 1;
        let below = |at: usize| lines.get(at).map(|line| (line.trim().is_empty(), line.len() - line.trim_start().len()));
        if value == "|" || value == ">" {
            let mut text = String::new();
            while below(*at).is_some_and(|(is_empty, indent)| is_empty || indent > deep) {
                text += lines[*at].trim();
                text.push('\n');
                *at += 1;
            }
            return Self::Text(text);
        }
        if !value.is_empty() {
            return Self::Text(value.trim_matches(['"', '\'']).to_owned());
        }
        let mut next = *at;
        while below(next).is_some_and(|(is_empty, _)| is_empty) || lines.get(next).is_some_and(|line| line.trim_start().starts_with('#')) {
            next += 1;
        }
        match below(next) {
            Some((_, indent)) if indent > deep => Self::block(lines, at, indent),
            _ => Self::Text(String::new()),
        }
    }

    fn get(&self, key: &str) -> Option<&Self> {
        if let Self::Map(map) = self { map.iter().find(|(name, _)| name == key).map(|(_, value)| value) } else { None }
    }

    #[track_caller]
    fn at(&self, path: &str) -> &Self {
        path.split('.').fold(self, |value, key| value.get(key).unwrap_or_else(|| panic!("no {path}")))
    }

    fn keys(&self) -> Vec<&str> {
        if let Self::Map(map) = self { map.iter().map(|(key, _)| key.as_str()).collect() } else { Vec::new() }
    }

    fn text(&self) -> &str {
        if let Self::Text(text) = self { text } else { "" }
    }

    /// All steps of jobs below this value, at any depth.
    fn steps(&self) -> Vec<&Self> {
        match self {
            Self::Map(map) => map.iter().flat_map(|(key, value)| if key == "steps" { value.elements() } else { value.steps() }).collect(),
            Self::List(_) | Self::Text(_) => Vec::new(),
        }
    }

    fn elements(&self) -> Vec<&Self> {
        if let Self::List(list) = self { list.iter().collect() } else { Vec::new() }
    }
}

/// Splits a line into a key and the text after the colon.
fn split(line: &str) -> Option<(String, &str)> {
    let (key, value) = line.strip_suffix(':').map(|key| (key, "")).or_else(|| line.split_once(": "))?;
    let key = key.trim_matches('"');
    (!key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c))).then(|| (key.to_owned(), value.trim()))
}

fn is_entry(line: &str) -> bool {
    split(line).is_some()
}

fn action() -> (String, Yaml) {
    let text = fs::read_to_string(root().join("action.yml")).unwrap();
    let read = Yaml::read(&text);
    (text, read)
}

/// Names of the inputs that a text takes, as `inputs.NAME`.
fn taken(text: &str) -> BTreeSet<&str> {
    text.split("inputs.").skip(1).map(|rest| rest.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).next().unwrap()).collect()
}

/// Commands of the program, as they are typed.
fn commands() -> BTreeSet<String> {
    let text = fs::read_to_string(root().join("crates/cli/src/arguments/mod.rs")).unwrap();
    let (_, list) = text.split_once("pub(crate) enum Command {").unwrap();
    let names = list.lines().take_while(|line| *line != "}").filter_map(|line| line.trim().split_once('(')).map(|(name, _)| name.to_lowercase());
    let found: BTreeSet<String> = names.filter(|name| name.chars().all(char::is_alphabetic)).collect();
    assert!(found.contains("relay") && found.contains("test") && found.len() > 15, "{found:?}");
    found
}

/// Returns the words after `cohaptic` in each call of the program in a script.
fn called(script: &str) -> Vec<&str> {
    let calls = script.lines().flat_map(|line| line.split(['|', ';', '&', '(']));
    calls.filter_map(|call| call.trim_start().strip_prefix("cohaptic ")).filter_map(|rest| rest.split_whitespace().next()).collect()
}

/// The workflows of the project, and those that pages show, with their names.
fn workflows() -> Vec<(String, Yaml)> {
    let mut all: Vec<(String, Yaml)> = files(&root().join(".github"), "yml")
        .into_iter()
        .filter(|path| path.parent().unwrap().ends_with("workflows"))
        .map(|path| (crate::house::name(&path), Yaml::read(&fs::read_to_string(&path).unwrap())))
        .collect();
    for page in files(&root().join("docs"), "md") {
        let text = fs::read_to_string(&page).unwrap();
        for block in text.split("```yaml\n").skip(1).map(|rest| rest.split("```").next().unwrap()) {
            all.push((crate::house::name(&page), Yaml::read(block)));
        }
    }
    assert!(all.len() > 6, "{}", all.len());
    all
}

#[test]
fn the_reader_of_yaml_reads_what_it_is_given() {
    let read = Yaml::read(
        "# text\non:\n  push:\n    branches: [main]\njobs:\n  one:\n    steps:\n      - uses: ./\n        with:\n          version: \"source\"\n      - run: |\n          a\n          b\n      - x\n",
    );
    let steps = read.steps();
    assert_eq!((steps.len(), steps[0].at("with.version").text(), steps[1].at("run").text(), steps[2].text()), (3, "source", "a\nb\n", "x"));
    assert_eq!((read.keys(), read.at("on.push.branches").text()), (vec!["on", "jobs"], "[main]"));
}

#[test]
fn the_action_takes_each_input_that_it_declares_and_no_other() {
    let (text, action) = action();
    let declared: BTreeSet<&str> = action.at("inputs").keys().into_iter().collect();
    assert_eq!(taken(&text), declared);
    for name in &declared {
        let input = action.at("inputs").get(name).unwrap();
        assert!(!input.at("description").text().is_empty() && input.get("default").is_some(), "{name}");
    }
    assert_eq!(action.at("runs.using").text(), "composite");
    for step in action.at("runs").steps() {
        // A step of a composite action that runs a script must say by which shell.
        assert!(step.get("run").is_none() || step.get("shell").is_some(), "{step:?}");
    }
}

#[test]
fn workflows_give_the_action_inputs_that_it_has() {
    let (_, action) = action();
    let declared: BTreeSet<&str> = action.at("inputs").keys().into_iter().collect();
    let mut uses = 0;
    for (name, workflow) in workflows() {
        for step in workflow.steps() {
            let is_own = step.get("uses").is_some_and(|uses| uses.text() == "./" || uses.text().starts_with("OWNER/cohaptic@"));
            if is_own {
                uses += 1;
                let given = step.get("with").map_or_else(Vec::new, Yaml::keys);
                assert!(given.iter().all(|input| declared.contains(input)), "{name}: {given:?} of {declared:?}");
            }
        }
    }
    // The workflow of the project, and those of the page.
    assert!(uses >= 3, "{uses}");
}

#[test]
fn action_and_workflows_call_commands_that_exist() {
    let commands = commands();
    let (_, action) = action();
    let mut calls = 0;
    for (name, document) in workflows().into_iter().chain([("action.yml".to_owned(), action)]) {
        for step in document.steps().into_iter().filter_map(|step| step.get("run")) {
            for call in called(step.text()) {
                assert!(commands.contains(call), "{name} calls cohaptic {call}");
                calls += 1;
            }
        }
    }
    assert!(calls >= 4, "{calls}");
}

/// A release from a folder: the archive of `.ci/binary` with a script in place of the program.
#[test]
#[cfg(unix)]
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
fn the_action_installs_the_program_of_a_release_and_no_changed_one() {
    let missing = ["curl", "python3", "tar"].into_iter().find(|tool| Command::new(tool).arg("--version").output().is_err());
    if let Some(tool) = missing {
        eprintln!("not tried here, for want of {tool}");
        return;
    }
    let desk = tempfile::tempdir().unwrap();
    let at = |name: &str| desk.path().join(name);
    fs::write(at("program"), "#!/bin/sh\necho cohaptic of the release\n").unwrap();
    let script = |name: &str| root().join(".ci").join(name);
    let system = Command::new("uname").args(["-s", "-m"]).output().unwrap();
    let target = match String::from_utf8(system.stdout).unwrap().trim() {
        "Linux x86_64" => "x86_64-unknown-linux-musl",
        "Linux aarch64" => "aarch64-unknown-linux-musl",
        "Darwin arm64" => "aarch64-apple-darwin",
        other => return eprintln!("not tried here: {other}"),
    };
    let version = env!("CARGO_PKG_VERSION");
    let folder = at(&format!("releases/download/v{version}"));
    let made = Command::new(script("binary")).arg("--program").arg(at("program")).arg("--out").arg(&folder).arg(target).status().unwrap();
    assert!(made.success());
    let install = |said: &str| {
        let runner = at(said);
        fs::create_dir_all(&runner).unwrap();
        let mut command = Command::new(script("action"));
        command.args(["install", version]).env("RUNNER_TEMP", &runner).env("GITHUB_PATH", runner.join("path"));
        let output = command.env("RELEASES", format!("file://{}", at("releases").display())).env("REPOSITORY", "nobody/nothing").output().unwrap();
        (output.status.success(), String::from_utf8(output.stdout).unwrap(), fs::read_to_string(runner.join("path")).unwrap_or_default())
    };
    let (is_done, said, path) = install("first");
    assert!(is_done && said == "cohaptic of the release\n", "{said}");
    assert!(Path::new(path.trim()).join("cohaptic").is_file(), "{path}");
    let archive =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).find(|path| !path.to_string_lossy().ends_with(".sha256")).unwrap();
    let mut bytes = fs::read(&archive).unwrap();
    bytes.push(0);
    fs::write(&archive, bytes).unwrap();
    let (is_done, said, path) = install("second");
    assert!(!is_done && said.is_empty() && path.is_empty(), "{said}");
}
