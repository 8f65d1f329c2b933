//! Segments as scripts write them: numbers relative to the initial ones, options by name.

use std::fmt;
use std::net::SocketAddr;

use cohaptic_tcp::{Ecn, Flags, Options, SackBlocks, Segment};

use crate::parse::{Cursor, Fault};

/// A segment in the numbers of a script. What is `None` is not compared.
#[derive(Clone, Debug)]
pub(crate) struct Packet {
    pub(crate) ecn: Option<Ecn>,
    pub(crate) flags: Flags,
    pub(crate) sequence: u32,
    pub(crate) length: u32,
    pub(crate) acknowledgement: Option<u32>,
    pub(crate) window: Option<u16>,
    pub(crate) options: Option<Options>,
}

/// Differences between the numbers of a script and those on the wire.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Offsets {
    /// Initial sequence number of the end that is tested. The peer's numbers are those of the script.
    pub(crate) sequence: u32,
    /// Timestamps of the end that is tested, as far as a timestamp has been seen.
    pub(crate) stamp: Option<u32>,
}

const FLAGS: [(char, Flags); 8] = [
    ('F', Flags::FIN),
    ('S', Flags::SYN),
    ('R', Flags::RST),
    ('P', Flags::PSH),
    ('.', Flags::ACK),
    ('U', Flags::URG),
    ('E', Flags::ECE),
    ('W', Flags::CWR),
];

const ECN: [(&str, Ecn); 4] = [("noecn", Ecn::NotCapable), ("ect0", Ecn::Capable0), ("ect1", Ecn::Capable1), ("ce", Ecn::Congestion)];

impl Packet {
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let line = cursor.line();
        let fault = |text: String| Fault { line, text };
        let ecn = if cursor.eats("[") {
            let name = cursor.until("]")?;
            let found = ECN.iter().find(|(known, _)| *known == name);
            Some(found.ok_or_else(|| fault(format!("the ECN mark `{name}` is unknown")))?.1)
        } else {
            None
        };
        let mut flags = Flags::NONE;
        let names = cursor.takes(|c| !c.is_whitespace());
        for name in names.chars().filter(|name| *name != '-') {
            let found = FLAGS.iter().find(|(known, _)| *known == name);
            flags |= found.ok_or_else(|| fault(format!("the flags `{names}` are unknown")))?.1;
        }
        let sequence = cursor.number()?;
        cursor.needs(":")?;
        let end: u32 = cursor.number()?;
        cursor.needs("(")?;
        let length: u32 = cursor.number()?;
        cursor.needs(")")?;
        if end.wrapping_sub(sequence) != length {
            return Err(fault(format!("{sequence}:{end} are not {length} octets")));
        }
        let acknowledgement = if cursor.eats("ack ") { Some(cursor.number()?) } else { None };
        if acknowledgement.is_some() != flags.has(Flags::ACK) {
            return Err(fault("`ack` and the flag `.` go together".into()));
        }
        let window = if cursor.eats("win ") { Some(cursor.number()?) } else { None };
        let options = if cursor.eats("<") { parse_options(cursor)? } else { Some(Options::default()) };
        Ok(Self { ecn, flags, sequence, length, acknowledgement, window, options })
    }

    /// Returns the segment that arrives. Data is that of `octet`, counted from the peer's first octet.
    pub(crate) fn to_segment(&self, [from, to]: [SocketAddr; 2], offsets: Offsets, first: u32) -> Segment<'static> {
        let mut options = self.options.unwrap_or_default();
        let mut sack = SackBlocks::default();
        for (start, end) in options.sack.as_slice() {
            sack.push(start.wrapping_add(offsets.sequence), end.wrapping_add(offsets.sequence));
        }
        options.sack = sack;
        // An echo of zero is no echo.
        if let (Some((_, echo @ 1..)), Some(stamp)) = (&mut options.timestamps, offsets.stamp) {
            *echo = echo.wrapping_add(stamp);
        }
        let data = (0..self.length).map(|k| octet(self.sequence.wrapping_add(k).wrapping_sub(first + 1)));
        Segment {
            source: from,
            destination: to,
            sequence: self.sequence,
            acknowledgement: self.acknowledgement.map_or(0, |number| number.wrapping_add(offsets.sequence)),
            flags: self.flags,
            window: self.window.unwrap_or(0),
            options,
            ecn: self.ecn.unwrap_or_default(),
            ttl: 64,
            payload: data.collect::<Vec<u8>>().into(),
        }
    }

    /// Returns a segment that has left in the numbers of the script.
    pub(crate) fn of(segment: &Segment<'_>, offsets: Offsets) -> Self {
        let mut options = segment.options;
        if let (Some((value, _)), Some(stamp)) = (&mut options.timestamps, offsets.stamp) {
            *value = value.wrapping_sub(stamp);
        }
        Self {
            ecn: Some(segment.ecn),
            flags: segment.flags,
            sequence: segment.sequence.wrapping_sub(offsets.sequence),
            length: u32::try_from(segment.payload.len()).unwrap(),
            acknowledgement: segment.flags.has(Flags::ACK).then_some(segment.acknowledgement),
            window: Some(segment.window),
            options: Some(options),
        }
    }

    /// Returns whether `seen` is the segment that this one describes.
    pub(crate) fn fits(&self, seen: &Self) -> bool {
        let fixed = |packet: &Self| (packet.flags, packet.sequence, packet.length, packet.acknowledgement);
        fixed(self) == fixed(seen)
            && (self.ecn.is_none() || self.ecn == seen.ecn)
            && (self.window.is_none() || self.window == seen.window)
            && (self.options.is_none() || self.options == seen.options)
    }
}

/// Reads `NAME VALUE, …>`. Returns `None` for `...`, which stands for any options.
fn parse_options(cursor: &mut Cursor<'_>) -> Result<Option<Options>, Fault> {
    if cursor.eats("...") {
        return cursor.needs(">").map(|()| None);
    }
    let mut options = Options::default();
    loop {
        match cursor.word() {
            "mss" => options.mss = Some(cursor.number()?),
            "wscale" => options.window_scale = Some(cursor.number()?),
            "sackOK" => options.sack_permitted = true,
            "nop" | "eol" => {}
            "TS" => {
                cursor.needs("val")?;
                let value = cursor.number()?;
                cursor.needs("ecr")?;
                options.timestamps = Some((value, cursor.number()?));
            }
            "sack" => {
                while cursor.rest().starts_with(|c: char| c.is_ascii_digit()) {
                    let start = cursor.number()?;
                    cursor.needs(":")?;
                    options.sack.push(start, cursor.number()?);
                }
            }
            other => return Err(Fault { line: cursor.line(), text: format!("the option `{other}` is unknown") }),
        }
        if cursor.eats(">") {
            return Ok(Some(options));
        }
        cursor.needs(",")?;
    }
}

/// Returns the octet at a place of any stream, so that lost, doubled and invented octets are seen.
pub(crate) fn octet(at: u32) -> u8 {
    u8::try_from((u64::from(at) * 31 + u64::from(at) / 251) % 251).unwrap()
}

impl fmt::Display for Packet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sequence, length, .. } = self;
        let names: String = FLAGS.iter().filter(|(_, flag)| self.flags.has(*flag)).map(|(name, _)| *name).collect();
        if let Some((name, _)) = ECN.iter().find(|(_, ecn)| self.ecn.is_some_and(|own| own == *ecn && own != Ecn::NotCapable)) {
            write!(f, "[{name}] ")?;
        }
        write!(f, "{} {sequence}:{}({length})", if names.is_empty() { "-" } else { &names }, sequence.wrapping_add(*length))?;
        if let Some(number) = self.acknowledgement {
            write!(f, " ack {number}")?;
        }
        if let Some(window) = self.window {
            write!(f, " win {window}")?;
        }
        let Some(options) = &self.options else { return f.write_str(" <...>") };
        let mut words = Vec::new();
        words.extend(options.mss.map(|mss| format!("mss {mss}")));
        words.extend(options.sack_permitted.then(|| "sackOK".to_owned()));
        words.extend(options.timestamps.map(|(value, echo)| format!("TS val {value} ecr {echo}")));
        words.extend(options.window_scale.map(|scale| format!("wscale {scale}")));
        let blocks: String = options.sack.as_slice().iter().map(|(start, end)| format!(" {start}:{end}")).collect();
        words.extend((!blocks.is_empty()).then(|| format!("sack{blocks}")));
        if words.is_empty() { Ok(()) } else { write!(f, " <{}>", words.join(",")) }
    }
}
