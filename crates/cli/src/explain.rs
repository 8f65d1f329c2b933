//! `cohaptic explain`.

use std::fmt::Write as _;
use std::process::ExitCode;

use cohaptic_harness::explain::{self as harness, Explanation};
use cohaptic_scene::Scene;
use serde::Serialize;

use crate::arguments::ExplainArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::{input, output};

#[derive(Serialize)]
struct ExplainDocument<'a> {
    title: &'a str,
    models: Vec<Model<'a>>,
    left_out: &'a [String],
    dimensions: Dimensions,
    cost: Cost,
}

#[derive(Serialize)]
struct Model<'a> {
    part: &'a str,
    model: &'a str,
    reason: &'a str,
}

#[derive(Serialize)]
struct Dimensions {
    plant: u64,
    held: u64,
    in_flight: u64,
}

#[derive(Serialize)]
struct Cost {
    peer_ticks_per_s: f64,
    packets_per_s: f64,
    realtime_factor: f64,
    record_bytes_per_s: f64,
}

/// Says what a scene makes the program model.
pub(crate) fn explain(arguments: &ExplainArguments) -> Result<ExitCode, Failure> {
    let scene = input::with(&arguments.scene.scene, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    let explanation = harness::explain(&scene);
    output::answer(
        arguments.scene.json,
        DocumentSchema::EXPLAIN,
        &document(&scene, &explanation),
        || describe(&scene, &explanation),
        output::NO_FILES,
    )?;
    Ok(ExitCode::SUCCESS)
}

fn document<'a>(scene: &'a Scene, explanation: &'a Explanation) -> ExplainDocument<'a> {
    let Explanation { models, left_out, dimensions, cost } = explanation;
    ExplainDocument {
        title: &scene.title,
        models: models.iter().map(|row| Model { part: &row.part, model: &row.model, reason: &row.reason }).collect(),
        left_out,
        dimensions: Dimensions { plant: dimensions.plant, held: dimensions.held, in_flight: dimensions.in_flight },
        cost: Cost {
            peer_ticks_per_s: cost.peer_ticks_per_s,
            packets_per_s: cost.packets_per_s,
            realtime_factor: cost.realtime_factor,
            record_bytes_per_s: cost.record_bytes_per_s,
        },
    }
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
