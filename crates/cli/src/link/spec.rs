//! Configuration of the link of `cohaptic link`, from words of tc-netem, from keys of a scene, or from a log of fates.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use cohaptic_linkfile::library::{self, Direction, ProfileName};
use cohaptic_linkfile::link_from_keys;
use cohaptic_linkfile::stream::first_fault;
use cohaptic_measure::asked::Asked;
use cohaptic_scene::LinkKeys;
use cohaptic_wan::law::DistTable;
use cohaptic_wan::netem::kernel::Table;
use cohaptic_wan::netem::{ExactError, Netem, TableName};
use cohaptic_wan::{KernelNetem, LinkConfig, LinkModel};

use crate::arguments::{LinkArguments, Profile};
use crate::failure::Failure;
use crate::{file, output};

/// Model of a link, with the figures of the configuration.
pub(super) struct Spec {
    /// Configuration as the user wrote it, for the report.
    pub(super) said: String,
    pub(super) model: LinkModel,
    pub(super) asked: Asked,
    /// Number of packets in the log of a replay. `None` without a replay, and if the number exceeds 64 bits.
    pub(super) packets: Option<u64>,
}

/// Beginning of a key that names a link of the library.
const PROFILE: &str = "profile=";

impl Spec {
    pub(super) fn read(arguments: &LinkArguments) -> Result<Self, Failure> {
        if let Some(path) = &arguments.from {
            return replay(path);
        }
        // A bare name is measured towards the user: the direction in which most of the traffic goes.
        let spec = with_profile(&arguments.spec, Some(Direction::Down));
        let is_keys = is_keys(&spec)?;
        let said = spec.join(" ");
        let said = said.strip_prefix(PROFILE).map_or_else(|| said.clone(), str::to_owned);
        if is_keys && arguments.profile == Profile::Kernel66 {
            return Err(Failure::Input("--profile kernel-6.6 is for words of tc-netem: expected those, or no profile".to_owned()));
        }
        let (model, asked) = if is_keys { of_keys(&spec, arguments)? } else { of_words(arguments, &said)? };
        Ok(Self { said, model, asked, packets: None })
    }
}

/// Returns the words of a link with a name of the [library] in front as the key `profile`, so that keys may follow the name: `starlink/down rate=5Mbit`. The
/// name gets the version that it stands for. Other words are returned unchanged. `bare` is the direction of a name that needs a direction and has none.
fn with_profile(spec: &[String], bare: Option<Direction>) -> Cow<'_, [String]> {
    let Some((first, rest)) = spec.split_first() else { return Cow::Borrowed(spec) };
    let Ok(name) = first.parse::<ProfileName>() else { return Cow::Borrowed(spec) };
    let direction = name.direction.or(bare).map_or_else(String::new, |direction| format!("/{}", direction.word()));
    Cow::Owned([format!("{PROFILE}{}{direction}", name.profile.title())].into_iter().chain(rest.iter().cloned()).collect())
}

/// Returns a note on a newer version of the link of the [library] that words name, if there is one.
pub(super) fn note(spec: &[String]) -> Option<String> {
    spec.first()?.parse::<ProfileName>().ok()?.profile.note()
}

/// Returns whether a link is written in keys of a scene (`true`) or in words of tc-netem (`false`).
///
/// # Errors
///
/// [`Failure::Input`] if `spec` mixes keys and words.
fn is_keys(spec: &[String]) -> Result<bool, Failure> {
    // The equals sign tells the kinds apart: no word of tc-netem has one.
    let (keys, words): (Vec<&str>, Vec<&str>) = spec.iter().map(String::as_str).partition(|word| word.contains('='));
    if keys.is_empty() || words.is_empty() {
        return Ok(words.is_empty());
    }
    Err(Failure::Input(format!(
        "a link is written either in words of tc-netem or in keys of a scene, not in both: {} is of the first kind, {} of the second. Write all in one kind, such as delay 20ms loss 1%, or delay=20ms loss=1%; put a value with spaces in quotes, 'jitter={{ sd = \"2ms\" }}'",
        words.join(" "),
        keys.join(" ")
    )))
}

fn of_keys(spec: &[String], arguments: &LinkArguments) -> Result<(LinkModel, Asked), Failure> {
    let model = link_from_keys(spec).map_err(Failure::LinkKeys)?;
    let asked = Asked::of(&model, arguments.every, arguments.size);
    Ok((model, asked))
}

/// Returns the link of the words of tc-netem or of the keys, and the keys of the link. Words are stored under the single key `netem`. An empty `spec` gives an
/// ideal link.
///
/// # Errors
///
/// The fault in the words or keys. For a word of connections of TCP, which links of packets do not have, the message names the command that has the
/// word.
pub(crate) fn link_and_keys(spec: &[String]) -> Result<(LinkModel, LinkKeys), Failure> {
    let of_tcp = |name| {
        let command = "cohaptic relay --tcp --listen 127.0.0.1:7000 --to 127.0.0.1:8000";
        Failure::Input(format!(
            "{name} is a word of links for connections of TCP, and this link carries packets: expected another word, or {command} {name} …"
        ))
    };
    // Only a refused spec is searched for such a name: words of tc-netem may be shortened, and a valid spec decides itself what its words mean.
    read(spec).map_err(|failure| first_fault(spec).map_or(failure, of_tcp))
}

fn read(spec: &[String]) -> Result<(LinkModel, LinkKeys), Failure> {
    let nothing = LinkKeys::default();
    if spec.is_empty() {
        return Ok((LinkModel::default(), nothing));
    }
    let spec = with_profile(spec, None);
    let spec = spec.as_ref();
    if is_keys(spec)? {
        let model = link_from_keys(spec).map_err(Failure::LinkKeys)?;
        // Each text has an equals sign here, because `is_keys` has checked the texts.
        let keys = spec.iter().filter_map(|text| text.split_once('='));
        return Ok((model, keys.fold(nothing, |keys, (key, value)| keys.with(key.trim(), value))));
    }
    let said = spec.join(" ");
    let exact = exact(&parsed(&said)?)?.map_err(|error| not_exact(&said, &error))?;
    Ok((exact.into(), nothing.with("netem", &said)))
}

fn parsed(said: &str) -> Result<Netem, Failure> {
    Netem::parse(said).map_err(|error| {
        let first = said.split(' ').next().unwrap_or_default();
        // Whoever misspells the name of a link of the library is told the name that is near, and not the options of tc.
        let near =
            library::nearest(first).map_or_else(String::new, |name| format!("\ndid you mean {name}, a link of the library (cohaptic link --list)?"));
        Failure::Input(format!("these words do not describe a link:\n{}{near}", error.excerpt(said)))
    })
}

fn not_exact(said: &str, error: &ExactError) -> Failure {
    Failure::Input(format!("{error}\n{}", below(said, error.option())))
}

/// Returns the link with exactly the behaviour of the words, or the reason why there is no such link.
///
/// # Errors
///
/// A failure if the table of a named distribution cannot be read.
fn exact(netem: &Netem) -> Result<Result<LinkConfig, ExactError>, Failure> {
    let mut fault = None;
    let exact = netem.to_link_config(&mut |name| {
        let text = table(name, &mut fault)?;
        DistTable::parse(&text).map_err(|error| fault = Some(in_table(name, &error))).ok().map(Arc::new)
    });
    // A fault of a table comes first: without its table, `exact` only says that the distribution is unknown.
    fault.map_or(Ok(exact), Err)
}

fn of_words(arguments: &LinkArguments, said: &str) -> Result<(LinkModel, Asked), Failure> {
    let netem = parsed(said)?;
    let exact = exact(&netem)?;
    let asked = exact.as_ref().map_or_else(|_| Asked::default(), |config| Asked::of_config(config, arguments.every, arguments.size));
    match arguments.profile {
        Profile::Exact => match exact {
            Ok(config) => Ok((config.into(), asked)),
            Err(error) => Err(not_exact(said, &error)),
        },
        Profile::Kernel66 => {
            let mut fault = None;
            let named = [netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()?.distribution.clone()), slot_distribution(&netem)];
            let tables = named.into_iter().flatten().filter_map(|distribution| {
                let name = TableName::new(distribution.name())?;
                let text = table(&name, &mut fault)?;
                Some((name, Table::parse(&text).ok()?))
            });
            let tables = tables.collect();
            fault.map_or(Ok(()), Err)?;
            let kernel = KernelNetem::new(netem, tables).map_err(|error| Failure::Input(error.to_string()))?;
            // The report compares with the figures of the words, also where the kernel is known to deviate.
            Ok((kernel.into(), asked))
        }
    }
}

fn slot_distribution(netem: &Netem) -> Option<cohaptic_wan::netem::Distribution> {
    match &netem.slot.as_ref()?.gap {
        cohaptic_wan::netem::SlotGap::Drawn { distribution, .. } => Some(distribution.clone()),
        cohaptic_wan::netem::SlotGap::Range { .. } => None,
    }
}

/// Reads the text of `NAME.dist` in the current folder. Returns `None` if the file does not exist, and also if the file cannot be read; the latter sets
/// `fault`.
fn table(name: &TableName, fault: &mut Option<Failure>) -> Option<String> {
    let path = Path::new(name.as_str()).with_extension("dist");
    match file::read_text(&path) {
        Ok(text) => Some(text),
        Err(Failure::File { error, .. }) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(failure) => {
            *fault = Some(failure);
            None
        }
    }
}

fn in_table(name: &TableName, error: &cohaptic_wan::law::DistTableError) -> Failure {
    Failure::Input(format!("{}.dist: {error}", name.as_str()))
}

/// Returns the words with a mark under the option at fault. The user may have abbreviated the option, so the mark stands under the longest word that begins the
/// name of the option, and under the first of equal words.
fn below(said: &str, option: &str) -> String {
    let words = said.split(' ').scan(0, |start, word| {
        let at = *start;
        *start += word.len() + 1;
        Some((at, word))
    });
    let found = words.filter(|(_, word)| !word.is_empty() && option.starts_with(word)).max_by_key(|(at, word)| (word.len(), usize::MAX - at));
    let (at, length) = found.map_or((0, 1), |(at, word)| (at, word.len()));
    // `at` counts bytes, and a terminal shows characters.
    format!("{said}\n{}{}", " ".repeat(said[..at].chars().count()), "^".repeat(length))
}

fn replay(path: &Path) -> Result<Spec, Failure> {
    let log = file::read_fates(path, file::open_large(path)?)?;
    let packets = u64::try_from(log.packets()).ok();
    let model = LinkModel::Replay(Arc::new(log));
    Ok(Spec { said: format!("replay of {}", output::path(path)), model, asked: Asked::default(), packets })
}
