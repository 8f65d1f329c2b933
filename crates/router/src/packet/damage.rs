//! Bits that are flipped, with checksums that do not notice.

use cohaptic_linkfile::router::Protocol;
use cohaptic_wan::Damage;

use super::Headers;
use super::checksum::{change, sum, transport_field};
use super::headers::V4_CHECKSUM;

/// Flips the bits of a packet. A checksum that was right is right afterwards, and one that was wrong is as wrong as before: a flipped bit of a checksum is
/// therefore flipped back.
///
/// Of a header the checksum is set right and nothing else: a packet whose addresses were hit goes where they say now. A fragment that is not the first
/// has no checksum that could be set right.
pub(super) fn apply(packet: &mut [u8], headers: &Headers, damage: &Damage) {
    let covered = headers.covered();
    let is_v4 = headers.source().is_ipv4();
    let field = transport_field(packet, headers);
    let begin = headers.transport().unwrap_or(packet.len());
    // The addresses are part of the pseudo-header.
    let addresses = if is_v4 { 12..20 } else { 8..40 };
    let of_transport = |packet: &[u8]| [sum(&packet[addresses.clone()]), sum(&packet[begin..])];
    let before = (sum(&packet[..covered]), of_transport(packet));
    damage.apply(packet);
    if is_v4 {
        let now = sum(&packet[..covered]);
        change(packet, V4_CHECKSUM, before.0, now);
    }
    if let Some(field) = field {
        let now = of_transport(packet);
        if headers.protocol() != Protocol::ICMP {
            change(packet, field, before.1[0], now[0]);
        }
        change(packet, field, before.1[1], now[1]);
        // Zero would say that there is no checksum; both are zero in ones' complement.
        if headers.protocol() == Protocol::UDP && packet[field..field + 2] == [0, 0] {
            packet[field..field + 2].fill(0xff);
        }
    }
}
