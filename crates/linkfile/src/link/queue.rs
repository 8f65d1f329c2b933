//! Readers of `queue` and of limits: the room for waiting packets, and the discipline that drops packets.

use core::num::{NonZeroU8, NonZeroU32};

use cohaptic_units::Bytes;
use cohaptic_wan::{CoDel, Discipline, DualPi2, FqCoDel, Pie, QueueLimit, Red};

use super::{UNLIMITED, unless};
use crate::document::{Node, quote};
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, only_one, values};

/// Queue without the serving line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Queue {
    /// Room for waiting packets. `None` for an unlimited queue.
    pub(super) limit: Option<QueueLimit>,
    /// Discipline of dropping or marking packets.
    pub(super) discipline: Discipline,
}

const DISCIPLINES: &str =
    "one of tail-drop, head-drop, codel, fq-codel, pie, dualpi2, red, { codel = … }, { fq-codel = … }, { pie = … }, { dualpi2 = … } or { red = … }";
const LIMIT: &str = "a limit such as \"100 packets\", \"64kB\" or \"50ms\"";

/// Reads a queue: limit and discipline.
pub(super) fn read_queue(node: &Node, context: Context<'_>) -> Option<Queue> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue"), "a table such as { limit = \"100 packets\" }")?;
    // The limit is read first, because plain RED takes thresholds from the limit.
    let limit = table.read_expecting("limit", LIMIT, unless(UNLIMITED, read_limit));
    let discipline = table.read("discipline", |node, context| read_discipline(node, context, limit.flatten()));
    table.finish();
    Some(Queue { limit: limit?, discipline: discipline? })
}

/// Reads a limit of a queue: a number of packets, a size in bytes, or a time.
pub(super) fn read_limit(node: &Node, context: Context<'_>) -> Option<QueueLimit> {
    let text = values::text(node, context, LIMIT)?;
    // The three forms differ by their units, so that the order of the attempts does not matter.
    let packets = || values::packets(text).map(QueueLimit::Packets);
    let bytes = || cohaptic_units::parse::size(text).ok().map(QueueLimit::Bytes);
    let time = || cohaptic_units::parse::duration(text).ok().map(QueueLimit::Time);
    let limit = packets().or_else(bytes).or_else(time);
    if limit.is_none() {
        context.fault_at(node, format!("{} is not a limit of a queue: expected {LIMIT}", quote(text)));
    }
    limit
}

/// Reads the key `limit` of a link: a number of packets.
pub(super) fn read_packets(node: &Node, context: Context<'_>) -> Option<u64> {
    const EXPECTED: &str = "a number of packets such as \"1000 packets\"";
    let text = values::text(node, context, EXPECTED)?;
    let packets = values::packets(text);
    if packets.is_none() {
        context.fault_at(node, format!("{} is not a number of packets: expected {EXPECTED}", quote(text)));
    }
    packets
}

/// Reads a discipline by name or as a table. `limit` is the limit of the queue, for the thresholds of plain RED.
fn read_discipline(node: &Node, context: Context<'_>, limit: Option<QueueLimit>) -> Option<Discipline> {
    if let Some(name) = node.as_text() {
        return match name {
            "tail-drop" => Some(Discipline::TailDrop),
            "head-drop" => Some(Discipline::HeadDrop),
            "codel" => read_codel(&nothing(node), context).map(Discipline::CoDel),
            "fq-codel" => read_fq_codel(&nothing(node), context).map(Discipline::FqCoDel),
            "pie" => read_pie(&nothing(node), context).map(Discipline::Pie),
            "dualpi2" => read_dualpi2(&nothing(node), context).map(Discipline::DualPi2),
            "red" => read_plain_red(node, context, limit),
            other => {
                context.fault_at(node, format!("unknown name {}: expected {DISCIPLINES}", quote(other)));
                None
            }
        };
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue.discipline"), DISCIPLINES)?;
    let entries = ["codel", "fq-codel", "pie", "dualpi2", "red"].map(|name| table.entry(name));
    table.finish();
    let chosen = only_one(node, context, &entries, DISCIPLINES)?;
    match chosen.name.as_str() {
        "codel" => read_codel(&chosen.node, context).map(Discipline::CoDel),
        "fq-codel" => read_fq_codel(&chosen.node, context).map(Discipline::FqCoDel),
        "pie" => read_pie(&chosen.node, context).map(Discipline::Pie),
        "dualpi2" => read_dualpi2(&chosen.node, context).map(Discipline::DualPi2),
        _ => read_red(&chosen.node, context, None).map(Discipline::Red),
    }
}

/// Reads the parameters of CoDel.
fn read_codel(node: &Node, context: Context<'_>) -> Option<CoDel> {
    const EXPECTED: &str = "a table such as { target = \"5ms\", interval = \"100ms\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue.discipline.codel"), EXPECTED)?;
    let (target, interval) = (table.value("target"), table.value("interval"));
    let (mtu, ecn) = (table.value("mtu"), table.value("ecn"));
    table.finish();
    Some(CoDel { target: target?, interval: interval?, mtu: mtu?, ecn: ecn? })
}

/// Reads the parameters of FQ-CoDel.
fn read_fq_codel(node: &Node, context: Context<'_>) -> Option<FqCoDel> {
    const EXPECTED: &str = "a table such as { target = \"5ms\", quantum = \"300B\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue.discipline.fq-codel"), EXPECTED)?;
    let (target, interval) = (table.value("target"), table.value("interval"));
    let (mtu, ecn) = (table.value("mtu"), table.value("ecn"));
    let quantum = table.read("quantum", |node, context| {
        let size = values::size(node, context)?;
        let found = u32::try_from(size.get()).ok().and_then(NonZeroU32::new);
        if found.is_none() {
            context.fault_at(node, format!("a queue cannot send {size} in its turn: expected a size from 1B to {}B", u32::MAX));
        }
        found
    });
    let flows: Option<u64> = table.value("flows");
    table.finish();
    let flows = u32::try_from(flows?).ok().and_then(NonZeroU32::new).expect("the declaration of the key gives the range");
    Some(FqCoDel { codel: CoDel { target: target?, interval: interval?, mtu: mtu?, ecn: ecn? }, quantum: quantum?, flows })
}

/// Reads the parameters of PIE.
fn read_pie(node: &Node, context: Context<'_>) -> Option<Pie> {
    const EXPECTED: &str = "a table such as { target = \"15ms\", burst = \"150ms\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue.discipline.pie"), EXPECTED)?;
    let (target, burst) = (table.value("target"), table.value("burst"));
    let (mtu, ecn) = (table.value("mtu"), table.value("ecn"));
    table.finish();
    Some(Pie { target: target?, burst: burst?, mtu: mtu?, ecn: ecn? })
}

/// Reads the parameters of DualPI2.
fn read_dualpi2(node: &Node, context: Context<'_>) -> Option<DualPi2> {
    const EXPECTED: &str = "a table such as { target = \"15ms\", step-thresh = \"1ms\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("queue.discipline.dualpi2"), EXPECTED)?;
    let (target, tupdate, step_thresh) = (table.value("target"), table.value("tupdate"), table.value("step-thresh"));
    let (alpha, beta) = (table.value("alpha"), table.value("beta"));
    let factor: Option<u64> = table.value("coupling-factor");
    let protection = table.value("classic-protection");
    table.finish();
    let coupling_factor = u8::try_from(factor?).ok().and_then(NonZeroU8::new).expect("the declaration of the key gives the range");
    Some(DualPi2 {
        target: target?,
        tupdate: tupdate?,
        alpha: alpha?,
        beta: beta?,
        coupling_factor,
        step_thresh: step_thresh?,
        classic_protection: protection?,
    })
}

/// Reads RED without parameters, with the advice of Floyd: the upper threshold is three times the lower threshold, and a tenth of the packets is dropped at the
/// upper threshold. The upper threshold is half of the queue's limit, so that the queue rarely reaches the limit.
fn read_plain_red(node: &Node, context: Context<'_>, limit: Option<QueueLimit>) -> Option<Discipline> {
    const EXPECTED: &str = "a limit in bytes of at least 6B beside it, or { red = { min, max } }";
    let Some(QueueLimit::Bytes(limit)) = limit else {
        context.fault_at(node, format!("red takes its thresholds from the limit: expected {EXPECTED}"));
        return None;
    };
    read_red(&nothing(node), context, Some([Bytes::new(limit.get() / 6), Bytes::new(limit.get() / 2)])).map(Discipline::Red)
}

/// Returns a table without keys in place of a word, for a discipline with all defaults.
fn nothing(word: &Node) -> Node {
    Node::empty_table(word.place, word.path.clone())
}

/// Reads the parameters of RED. `thresholds` are the lower and the upper threshold, or `None` if the table has the keys `min` and `max`.
fn read_red(node: &Node, context: Context<'_>, thresholds: Option<[Bytes; 2]>) -> Option<Red> {
    let declaration = LINK_TABLE.table("queue.discipline.red");
    let mut table = TableReader::new(node, context, declaration, "a table such as { min = \"5kB\", max = \"15kB\" }")?;
    let nodes = [table.get("min"), table.get("max")];
    let (weight_node, packet_node) = (table.get("weight"), table.get("mean-packet"));
    let [min, max] = thresholds.map_or_else(|| ["min", "max"].map(|key| table.value(key)), |ends| ends.map(Some));
    let (probability, weight) = (table.value("max-probability"), table.value("weight"));
    let (packet, ecn) = (table.value("mean-packet"), table.value("ecn"));
    table.finish();
    let red = Red::new(min?, max?, probability?, weight?, packet?, ecn?);
    red.map_err(|error| {
        // Each refusal is shown at the parameter at fault. Of both thresholds, the later in the text is shown.
        let nodes: &[Option<&Node>] = match error {
            cohaptic_wan::RedError::Weight(_) => &[weight_node],
            cohaptic_wan::RedError::MeanPacket => &[packet_node],
            cohaptic_wan::RedError::Thresholds { .. } => &nodes,
        };
        values::refuse(context, nodes, node, &error);
    })
    .ok()
}
