//! Reader of `cross-traffic`: packets of other senders at the bottleneck.

use cohaptic_wan::{CrossRecording, CrossTraffic, CrossTrafficError, OnOff, Poisson};

use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::named_file::{Fault, file_path, read_file};
use crate::reading::{Context, TableReader, only_one, values};

const EXPECTED: &str = "\"none\", { poisson = { rate = \"6Mbit\" } }, { on-off = { sources = 10, peak = \"2Mbit\", on = \"200ms\", off = \"800ms\" } } or { trace = \"cross.csv\" }";

/// Reads cross-traffic: one source of packets.
pub(super) fn read_cross_traffic(node: &Node, context: Context<'_>) -> Option<CrossTraffic> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("cross-traffic"), EXPECTED)?;
    let sources = [table.entry("poisson"), table.entry("on-off"), table.entry("trace")];
    table.finish();
    let source = only_one(node, context, &sources, EXPECTED)?;
    match source.name.as_str() {
        "poisson" => read_poisson(&source.node, context),
        "on-off" => read_on_off(&source.node, context),
        _ => read_recording(&source.node, context).map(CrossTraffic::recorded),
    }
}

fn read_poisson(node: &Node, context: Context<'_>) -> Option<CrossTraffic> {
    let declaration = LINK_TABLE.table("cross-traffic.poisson");
    let mut table = TableReader::new(node, context, declaration, "a table such as { rate = \"6Mbit\", size = \"1500B\" }")?;
    let nodes = [table.get("rate"), table.get("size")];
    let (rate, size) = (table.value("rate"), table.value("size"));
    table.finish();
    CrossTraffic::poisson(Poisson { rate: rate?, size: size? }).map_err(|error| values::refuse(context, &nodes, node, &error)).ok()
}

fn read_on_off(node: &Node, context: Context<'_>) -> Option<CrossTraffic> {
    const EXPECTED: &str = "a table such as { sources = 10, peak = \"2Mbit\", on = \"200ms\", off = \"800ms\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("cross-traffic.on-off"), EXPECTED)?;
    let [shape_node, size_node, peak_node, on_node] = ["shape", "size", "peak", "on"].map(|key| table.get(key));
    let (sources, peak, size): (Option<u64>, _, _) = (table.value("sources"), table.value("peak"), table.value("size"));
    let (on, off, shape) = (table.value("on"), table.value("off"), table.value("shape"));
    table.finish();
    let on_off = OnOff { sources: u32::try_from(sources?).ok()?, peak: peak?, size: size?, on: on?, off: off?, shape: shape? };
    CrossTraffic::on_off(on_off)
        .map_err(|error| {
            // Each refusal is shown at the parameter at fault.
            let nodes = match error {
                CrossTrafficError::Shape(_) => [shape_node, None],
                CrossTrafficError::NoBytes | CrossTrafficError::TooDense => [size_node, peak_node],
                CrossTrafficError::ShortBursts { .. } | CrossTrafficError::NoSilence => [on_node, None],
            };
            values::refuse(context, &nodes, node, &error);
        })
        .ok()
}

/// Reads a recording of cross-traffic with a path relative to the folder of the document.
fn read_recording(node: &Node, context: Context<'_>) -> Option<CrossRecording> {
    let path = file_path(node, context, "the name of a CSV with the columns t,bytes, relative to the folder of this file")?;
    read_file(node, context, &path, "cross-traffic", |text| CrossRecording::parse(text).map_err(|error| Fault::in_line(text, error.line(), &error)))
}
