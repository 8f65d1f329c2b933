//! `cohaptic explain`.

use std::fmt::Write as _;
use std::process::ExitCode;

use cohaptic_harness::explain::{self as harness, Explanation};
use cohaptic_scene::Scene;

use crate::arguments::ExplainArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::{input, output};

/// Says what a scene makes the program model.
pub(crate) fn explain(arguments: &ExplainArguments) -> Result<ExitCode, Failure> {
    let scene = input::with(&arguments.scene.scene, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    let explanation = harness::explain(&scene);
    output::answer(
        arguments.scene.json,
        DocumentSchema::EXPLAIN,
        &cohaptic_answers::explanation(&scene, &explanation),
        || describe(&scene, &explanation),
        output::NO_FILES,
    )?;
    Ok(ExitCode::SUCCESS)
}

fn describe(scene: &Scene, explanation: &Explanation) -> String {
    let Explanation { models, left_out, dimensions, cost } = explanation;
    let mut text = format!("{}\n\nModelled\n", scene.title);
    for row in models {
        // Writing to a string does not fail.
        let _ = writeln!(text, "  {}: {}\n      because: {}", row.part, row.model, row.reason);
    }
    let _ = writeln!(text, "\nLeft out");
    for what in left_out {
        let _ = writeln!(text, "  {what}");
    }
    let _ = writeln!(
        text,
        "\nState\n  {} numbers in devices and copies, {} in samples held, about {} packets on the way",
        dimensions.plant, dimensions.held, dimensions.in_flight
    );
    let _ = writeln!(
        text,
        "\nCost\n  {:.0} control ticks and {:.0} packets a simulated second: about {:.0} times real time with nothing recorded\n  \
         records (--out): about {:.1} MB a simulated second",
        cost.peer_ticks_per_s,
        cost.packets_per_s,
        cost.realtime_factor,
        cost.record_bytes_per_s / 1e6
    );
    text
}
