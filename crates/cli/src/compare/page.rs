//! Origin of the numbers in `compare.html`: the commands, the parameters of the strategies, and the scene.

use cohaptic_answers::compare::{Finished, PageSource};
use cohaptic_campaign::Variation;
use cohaptic_scene::scene_content_of_text;

use super::preset::Asked;
use crate::arguments::{CompareArguments, TableFormat};
use crate::failure::Failure;
use crate::input;
use crate::shell::CommandLine;

/// Returns the origin of the numbers of a comparison. `scene` is the text of the scene.
pub(super) fn source<'a>(arguments: &CompareArguments, finished: &Finished, scene: &'a str) -> Result<PageSource<'a>, Failure> {
    let (command, campaign) = (command_line(arguments), campaign_line(arguments, finished));
    Ok(PageSource { strategies: strategies(arguments, finished)?, command, campaign, scene })
}

/// Returns the description of each strategy, and the parameters of the strategy with the values in the scene.
fn strategies(arguments: &CompareArguments, finished: &Finished) -> Result<Vec<(&'static str, String)>, Failure> {
    let strategies = Asked::of(arguments).map_err(|error| Failure::Input(error.to_string()))?.strategies;
    let all = (0..finished.comparison.strategies.len()).map(|place| {
        let (about, parameters) = strategies.registered(place);
        let varied = strategies.variation().overrides(place);
        let overrides: Vec<String> = arguments.scene.overrides.set.iter().chain(&varied).cloned().collect();
        // A refused scene has no content. Only the values of overrides and the defaults are shown then.
        let keys = input::with(&arguments.scene.scene, |text, file| scene_content_of_text(text, file, &overrides))
            .map(|content| content.keys)
            .unwrap_or_default();
        let given = |(key, default): &(String, &str)| {
            // The last override of a key wins, as in the scene; then the key of the scene, then the default.
            let own = varied.iter().rev().find_map(|text| text.strip_prefix(key.as_str())?.strip_prefix('='));
            let value = own.or_else(|| keys.get(key).map(String::as_str)).unwrap_or(*default);
            format!("{} {}", key.rsplit('.').next().unwrap_or_default(), value.trim_matches('"'))
        };
        let mut words: Vec<String> = parameters.iter().map(given).collect();
        words.extend(varied.iter().skip(1).filter(|text| parameters.iter().all(|(key, _)| !text.starts_with(&format!("{key}=")))).cloned());
        (about, words.join(", "))
    });
    Ok(all.collect())
}

/// Returns the command that makes this page.
fn command_line(arguments: &CompareArguments) -> String {
    CommandLine::new("compare", &arguments.scene.scene, &arguments.scene.overrides.set)
        .option("--preset", arguments.preset.map(|_| "field"))
        .option("--strategies", &arguments.strategies)
        .option("--vary", &arguments.vary)
        .option("--runs", [arguments.runs])
        .out()
        .option("--format", (arguments.table.format == TableFormat::Csv).then_some("csv"))
        .text()
}

/// Returns the command of the campaign that has the same table of runs as the comparison.
fn campaign_line(arguments: &CompareArguments, finished: &Finished) -> String {
    CommandLine::new("campaign", &arguments.scene.scene, &arguments.scene.overrides.set)
        .option("--vary", finished.plan.variations().iter().map(Variation::text))
        .option("--runs", [arguments.runs])
        .option("--measure", ["all"])
        .out()
        .text()
}
