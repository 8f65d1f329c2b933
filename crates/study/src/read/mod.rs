//! Reader of study files: from TOML text to a checked [`Study`].

mod conditions;
mod keys;
mod operator;
mod questions;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_linkfile::FileError;
use cohaptic_linkfile::document::{Node, Sources, quote};
use cohaptic_linkfile::reading::named_file::{file_path, read_file};
use cohaptic_linkfile::reading::{Context, FileReader, TableReader, default_title, one_of, parse_with, values, with_text};
use cohaptic_scene::{Measure, MeasureName, PeerKind, Scene, Scope, TaskKind, scene_content_of_text};
use cohaptic_units::print::{Counted, Span};

use crate::model::{Breaks, Order, Study};
use crate::trial::TrialScene;
use keys::{ANALYSIS, BREAK, ORDERS, STUDY};

pub use keys::ROOT;

/// Largest number of conditions. The square of this number, times groups and trials, bounds the length of a session.
const MOST_CONDITIONS: usize = 64;

impl Study {
    /// Reads a study file, the scene, and the texts for people.
    ///
    /// # Errors
    ///
    /// [`FileError`] with the place of the fault: in the study file, or in the scene file. Of several faults of the study file, the first in the text.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        with_text(path, |text| Self::parse(text, path))
    }

    /// Reads the text of a study file. `file` is the path for messages, and the folder of `file` is the base of files named in the text.
    ///
    /// # Errors
    ///
    /// Errors of [`Study::read`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, FileError> {
        Self::parse_with(text, file, FileReader(&cohaptic_files::read_bytes))
    }

    /// Like [`Study::parse`], but `reader` reads the named files.
    pub(crate) fn parse_with(text: &str, file: &Path, reader: FileReader<'_>) -> Result<Self, FileError> {
        Ok(parse_with(Sources { file, text, overrides: &[] }, reader, read_document)?.whole)
    }
}

/// Header of a study. A field is `None` after a refused value.
#[derive(Debug, Default)]
struct Header<'a> {
    files: BTreeMap<String, String>,
    title: Option<Option<String>>,
    seed: Option<u64>,
    scene: Option<(PathBuf, String)>,
    scene_node: Option<&'a Node>,
    participants: Option<usize>,
    participants_node: Option<&'a Node>,
    group: Option<usize>,
    order: Option<Order>,
    trials: Option<usize>,
    practice: Option<usize>,
    breaks: Option<Option<Breaks>>,
    consent: Option<String>,
    instructions: Option<String>,
}

/// Reads every part, also after a refused part, so that the reported fault is the first in the order of the text. `None` if any part was refused.
fn read_document(document: &Node, context: Context<'_>) -> Option<Study> {
    let mut root = TableReader::new(document, context, &ROOT, "a table")?;
    root.know_all();
    let header = match root.get("study") {
        Some(node) => read_header(node, context).unwrap_or_default(),
        None => {
            root.require("study", "a table [study] with a scene");
            Header::default()
        }
    };
    let scene = header.scene.as_ref().and_then(|(path, text)| read_scene(header.scene_node?, path, text, context));
    let conditions_node = root.get("conditions");
    let conditions = conditions::read_conditions(conditions_node, MOST_CONDITIONS, context);
    let questions_node = root.get("questions");
    let questions = questions::read_questions(questions_node, context);
    let measures = root.read("analysis", |node, context| read_analysis(node, scene.as_ref(), context));
    let operator_node = root.get("operator");
    let operator = root.table("operator", operator::read_operator);
    root.finish();
    // From here on `?` ends the reading without a new fault: each `None` was reported where the value was read.
    let (group, participants) = (header.group?, header.participants?);
    let scene = scene?;
    let hands = hands(&scene);
    if hands.len() != group {
        let hands = if hands.is_empty() { "no pointer".to_owned() } else { format!("the pointers {}", hands.join(", ")) };
        let group = Counted(group, "person");
        let message = format!(
            "the scene has {hands}, and a group has {group}: expected a pointer for each person (kind = \"pointer\" of a peer, or of [peer] for all)"
        );
        context.fault_at(header.scene_node?, message);
        return None;
    }
    if participants % group != 0 {
        let message = format!("{participants} people are no whole number of groups of {group}: expected a multiple of {group}");
        context.fault_at(header.participants_node?, message);
        return None;
    }
    let (factors, conditions) = conditions?;
    let (scene_file, scene_text) = header.scene?;
    let (questions, measures) = (questions?, measures?);
    if let Some(node) = questions_node
        && !questions::have_own_names(node, &questions, &measures, context)
    {
        return None;
    }
    let mut study = Study {
        file: context.sources.file.to_path_buf(),
        text: context.sources.text.to_owned(),
        files: header.files,
        title: header.title?.unwrap_or_else(|| default_title(context.sources.file)),
        seed: header.seed?,
        scene_file,
        scene_text,
        hands,
        groups: participants / group,
        order: header.order?,
        trials: header.trials?,
        practice: header.practice?,
        breaks: header.breaks?,
        consent: header.consent?,
        instructions: header.instructions?,
        factors,
        conditions,
        questions,
        measures,
        limit: limit(&scene),
        operator: operator?,
    };
    let tracks = read_scenes(&study, conditions_node.or(header.scene_node)?, context)?;
    for (condition, tracks) in study.conditions.iter_mut().zip(tracks) {
        condition.tracks = tracks;
    }
    if let Some(node) = operator_node
        && !(operator::is_used(&study, node, context) && operator::fits(&study, node, context))
    {
        return None;
    }
    Some(study)
}

/// Reads the scene of each condition, because a fault must not wait until a group comes to its trial. Returns whether the target of the task moves, indexed by
/// condition. `None` if a scene is refused or changes what all conditions share, which is reported at `conditions`.
fn read_scenes(study: &Study, conditions: &Node, context: Context<'_>) -> Option<Vec<bool>> {
    let mut tracks = Vec::new();
    for (place, condition) in study.conditions.iter().enumerate() {
        let (node, message) = match study.condition_scene(place) {
            Ok(TrialScene { text, scene, .. }) => {
                let Some(message) = unfit(study, &text, &scene) else {
                    tracks.push(scene.task.is_some_and(|task| matches!(task.kind, TaskKind::Track(_))));
                    continue;
                };
                (conditions, message)
            }
            Err(error) => refused_scene(&error, conditions),
        };
        context.fault_at(node, format!("in the condition {}, {message}", quote(&condition.label)));
        return None;
    }
    Some(tracks)
}

/// Returns the key of `conditions` whose value is refused, or the whole table, and the fault in words.
fn refused_scene<'a>(error: &FileError, conditions: &'a Node) -> (&'a Node, String) {
    let Some(diagnostic) = error.diagnostic() else { return (conditions, error.to_string()) };
    let key = diagnostic.override_text().and_then(|text| text.split_once('=')).map(|(key, _)| key);
    let node = key.and_then(|key| conditions.as_table()?.get(key)).map_or(conditions, |entry| &entry.node);
    let message = diagnostic.message();
    (node, if diagnostic.key().is_empty() { message.to_owned() } else { format!("{}: {message}", diagnostic.key()) })
}

/// Returns how the scene of a condition changes what all conditions share, in words; `None` if all of this stays.
fn unfit(study: &Study, text: &str, scene: &Scene) -> Option<String> {
    let other_hands = || {
        let message = || format!("the pointers are {}: expected {}", hands(scene).join(", "), study.hands.join(", "));
        (hands(scene) != study.hands).then(message)
    };
    let other_limit = || {
        let message =
            || format!("a task may take {}, and {} in the scene: expected the same time in all conditions", Span(limit(scene)), Span(study.limit));
        (limit(scene) != study.limit).then(message)
    };
    unkept(scene, text, &study.scene_file).or_else(other_hands).or_else(other_limit)
}

/// Returns why a study could not keep all of a scene, in words; `None` for a scene that is kept as a whole.
fn unkept(scene: &Scene, text: &str, path: &Path) -> Option<String> {
    let content = scene_content_of_text(text, path, &[]).ok()?;
    if let Some(name) = content.files.keys().next() {
        return Some(format!("the scene names the file {name}, and a study keeps nothing but the scene: expected a scene without other files"));
    }
    let peer = scene.peers.iter().find(|peer| matches!(peer.kind, PeerKind::Udp(_) | PeerKind::Falcon(..) | PeerKind::Inverse3(..)))?;
    Some(format!("peer {} is a {}: expected peers of kind pointer, for people, or simulated", quote(&peer.name), peer.kind.name()))
}

fn read_header<'a>(node: &'a Node, context: Context<'a>) -> Option<Header<'a>> {
    let mut table = TableReader::new(node, context, &STUDY, "a table such as [study]")?;
    let mut files = BTreeMap::new();
    let title = table.maybe("title", |node, context| values::text(node, context, "a text").map(str::to_owned));
    let (scene_node, participants_node) = (table.get("scene"), table.get("participants"));
    let scene = table.read("scene", |node, context| read_named(node, "a scene file such as \"pull.toml\"", &mut files, context));
    let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    let (participants, group) = (table.value("participants").map(count), table.value("group").map(count));
    let (order, seed) = (table.choice("order", &ORDERS), table.value("seed"));
    let (trials, practice) = (table.value("trials").map(count), table.value("practice").map(count));
    let breaks = table.maybe("break", read_break);
    let mut page = |name: &'static str| {
        table.read(name, |node, context| read_named(node, "a file of Markdown such as \"consent.md\"", &mut files, context)).map(|(_, text)| text)
    };
    let (consent, instructions) = (page("consent"), page("instructions"));
    table.finish();
    Some(Header {
        files,
        title,
        seed,
        scene,
        scene_node,
        participants,
        participants_node,
        group,
        order,
        trials,
        practice,
        breaks,
        consent,
        instructions,
    })
}

fn read_break(node: &Node, context: Context<'_>) -> Option<Breaks> {
    let mut table = TableReader::new(node, context, &BREAK, "a table such as { every = 10, at-least = \"30s\" }")?;
    let (every, at_least) = (table.value("every"), table.value("at-least"));
    table.finish();
    let every: u64 = every?;
    Some(Breaks { every: usize::try_from(every).unwrap_or(usize::MAX), at_least: at_least? })
}

/// Reads the text of a named file, and notes the text under the name as written. Returns path and text.
fn read_named(node: &Node, expected: &str, files: &mut BTreeMap<String, String>, context: Context<'_>) -> Option<(PathBuf, String)> {
    let path = file_path(node, context, expected)?;
    let text = read_file(node, context, &path, "a text", |text| Ok(text.to_owned()))?;
    files.insert(node.as_text()?.to_owned(), text.clone());
    Some((path, text))
}

/// Reads the scene as for a session, and refuses scenes of which a study cannot keep everything.
fn read_scene(node: &Node, path: &Path, text: &str, context: Context<'_>) -> Option<Scene> {
    let scene = match Scene::parse_live(text, path, &[]) {
        Ok(scene) => scene,
        Err(error) => {
            context.refused_file(node, error);
            return None;
        }
    };
    if let Some(message) = unkept(&scene, text, path) {
        context.fault_at(node, message);
        return None;
    }
    if scene.task.is_none() {
        context.fault_at(node, "the scene has no task: expected a table [task], of which a trial is one run");
        return None;
    }
    Some(scene)
}

/// Returns the names of the pointers of a scene.
fn hands(scene: &Scene) -> Vec<String> {
    scene.peers.iter().filter(|peer| matches!(peer.kind, PeerKind::Pointer(..))).map(|peer| peer.name.clone()).collect()
}

/// Returns the time that counts for a task that timed out: its timeout, or the rest of the scene.
fn limit(scene: &Scene) -> Duration {
    let Some(task) = &scene.task else { return scene.duration };
    let rest = scene.duration.saturating_sub(Duration::from_nanos(task.start.as_nanos()));
    task.timeout.map_or(rest, |timeout| timeout.min(rest))
}

/// Reads the names of the measures. `scene` is `None` if the scene was refused.
fn read_analysis(node: &Node, scene: Option<&Scene>, context: Context<'_>) -> Option<Vec<String>> {
    let mut table = TableReader::new(node, context, &ANALYSIS, "a table such as [analysis]")?;
    let measures = table.read("measures", |node, context| {
        let elements = values::list(node, context, "a list of names such as [\"task_time_s\"]")?;
        if elements.is_empty() {
            context.fault_at(node, "no measure is given: expected a list of names such as [\"task_time_s\"]");
            return None;
        }
        let read: Vec<Option<String>> = elements.iter().map(|element| read_measure(element, scene, context)).collect();
        let names: Vec<String> = read.into_iter().collect::<Option<_>>()?;
        for (place, name) in names.iter().enumerate() {
            if names[..place].contains(name) {
                context.fault_at(elements[place], format!("{name} is given twice: expected each measure once"));
                return None;
            }
        }
        Some(names)
    });
    table.finish();
    measures
}

fn read_measure(node: &Node, scene: Option<&Scene>, context: Context<'_>) -> Option<String> {
    let name = values::text(node, context, "the name of a measure such as \"task_time_s\"")?;
    let scene = scene?;
    // The impedance of a hand needs a sine in place of a person.
    let fits = |name: &MeasureName| !matches!(name.measure, Measure::Viscosity | Measure::EffectiveMass);
    let known: Vec<String> = MeasureName::all(scene.peers.len(), true).into_iter().filter(fits).map(|name| name.text(scene)).collect();
    if !known.iter().any(|known| known == name) {
        let of_peer = Measure::ALL.iter().any(|measure| measure.scope() == Scope::Peer && measure.name() == name);
        let way_out = if of_peer {
            format!("peers.{}.{name}, with the name of a peer", scene.peers[0].name)
        } else {
            one_of(known.iter().map(String::as_str), name)
        };
        context.fault_at(node, format!("unknown measure {}: expected {way_out}", quote(name)));
        return None;
    }
    Some(name.to_owned())
}

#[cfg(test)]
mod tests;
