//! Headers before IP. Numbers of link types: <https://www.tcpdump.org/linktypes.html>.

use super::layers::{by_type, ppp, pppoe};
use super::{CUT, Kind, half, wireless};

/// Returns the IP packet of a frame: the end of the frame from the first octet of IP on.
pub(super) fn packet(link_type: u16, data: &[u8]) -> Result<&[u8], Kind> {
    let after = |octets: usize| data.get(octets..).ok_or(CUT);
    match link_type {
        // The address family, in a byte order unknown from the file. The IP version has the same information.
        0 | 108 => after(4),
        1 => by_type(half(data, 12).ok_or(CUT)?, after(14)?),
        9 => ppp(data),
        // PPP or Cisco's framing, recognised by the first octet 0x0F or 0x8F.
        50 if matches!(data.first(), Some(0x0F | 0x8F)) => by_type(half(data, 2).ok_or(CUT)?, after(4)?),
        50 => ppp(data),
        51 => pppoe(data),
        // Raw IP, and the numbers of BSD systems for raw IP.
        12 | 14 | 101 | 228 | 229 => Ok(data),
        104 => by_type(half(data, 2).ok_or(CUT)?, after(4)?),
        105 => wireless::packet(data, false),
        // "Cooked" captures have the type at the end of the header in the first form, and at the beginning in the second (276).
        113 => by_type(half(data, 14).ok_or(CUT)?, after(16)?),
        127 => wireless::with_radiotap(data),
        // The direction replaces the address of PPP, or stands before the address.
        166 => ppp(after(2)?),
        204 => ppp(after(1)?),
        276 => by_type(half(data, 0).ok_or(CUT)?, after(20)?),
        other => Err(format!("link type {other}").into()),
    }
}
