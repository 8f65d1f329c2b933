//! Reader of `corrupt`: flipped bits.

use cohaptic_wan::{Chance, Checksum, Corruption, Flips};

use super::loss_pattern::read_range;
use super::read_chance_in;
use crate::document::{Node, quote};
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, values};

/// Reads `"1%"` (one flipped bit per corrupted packet), `{ probability, correlation, bits }` or `{ bit-error-rate }`; both tables also take `bytes` and
/// `checksum`. Returns `Some(None)` if no bit is ever flipped.
pub(super) fn read_corruption(node: &Node, context: Context<'_>) -> Option<Option<Corruption>> {
    const EXPECTED: &str = "a probability or a table such as { probability = \"1%\", bits = 3 } or { bit-error-rate = 1e-6 }";
    if node.as_table().is_none() {
        let probability = values::probability(node, context)?;
        return Some(flipping(Flips::Bits { packets: Chance::independent(probability), count: 1 }));
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("corrupt"), EXPECTED)?;
    let bytes = table.maybe("bytes", |node, context| {
        const EXPECTED: &str = "the first and the last byte that may be hit, counted from 0, such as \"8-15\"";
        let text = values::text(node, context, EXPECTED)?;
        let range = read_range(text);
        if range.is_none() {
            context.fault_at(node, format!("{} is not a row of bytes: expected {EXPECTED}", quote(text)));
        }
        range
    });
    let checksum = table.choice("checksum", &Checksum::CHOICES);
    let rate = table.maybe_value("bit-error-rate");
    let bits = match table.entry("bit-error-rate") {
        Some(rate_entry) => {
            // Asked for before `finish`, so that these keys count as known and get the message below.
            let others = ["probability", "correlation", "bits"].map(|key| table.entry(key));
            table.finish();
            if let Some(other) = others.into_iter().flatten().next() {
                let (first, last) = if other.key < rate_entry.key { (other, rate_entry) } else { (rate_entry, other) };
                let message = format!(
                    "{} and {} exclude each other: expected either a bit-error-rate, or a probability for each packet",
                    last.name, first.name
                );
                context.fault(last.key, &last.node.path, message);
                return None;
            }
            rate?.map(Flips::Rate)
        }
        None => {
            let packets = read_chance_in(&mut table, node, context);
            let count: Option<u64> = table.value("bits");
            table.finish();
            Some(Flips::Bits { packets: packets?, count: u32::try_from(count?).ok()? })
        }
    };
    let corruption = flipping(bits?);
    let (within, checksum) = (bytes?, checksum?);
    Some(corruption.map(|corruption| Corruption { within, checksum, ..corruption }))
}

/// Returns a corruption with the default range and checksum, or `None` if no bit is ever flipped.
fn flipping(bits: Flips) -> Option<Corruption> {
    let never = match bits {
        Flips::Bits { packets, .. } => packets.is_never(),
        Flips::Rate(rate) => rate == cohaptic_units::Probability::ZERO,
    };
    (!never).then_some(Corruption { bits, within: None, checksum: Checksum::Discards })
}
