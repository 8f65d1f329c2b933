//! Reads measurements from CSV, in the format described at [`cohaptic_wan::delay_table`].

pub(super) use cohaptic_wan::delay_table::Attoseconds;
use cohaptic_wan::delay_table::{self, DelayTableError};

use super::{Measurement, Measurements};

impl Measurements {
    /// Reads a CSV file with the columns `t,delay[,lost]` or `sent,arrived[,lost]`, as described at [`delay_table`]. Times count from the first packet.
    ///
    /// # Errors
    ///
    /// [`DelayTableError`] with line, column and expectation.
    pub fn from_csv(text: &str) -> Result<Self, DelayTableError> {
        let rows = delay_table::read(text)?;
        let packets = rows.iter().map(|row| {
            let sent_s = row.sent.seconds_since(rows[0].sent).unwrap_or(f64::MAX);
            Measurement { sent_s, delay_s: row.delay.map(Attoseconds::seconds) }
        });
        // A table is in the order of sending, and its times are finite.
        Ok(Self::in_order(packets.collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_measurements() {
        let measurements =
            Measurements::from_csv("\u{feff}t_ms,delay_ms,lost\n1700000000000,24,0\n1700000000001,-1,0\n1700000000001,25,1\n").unwrap();
        let packet = |sent_s, delay_s| Measurement { sent_s, delay_s };
        assert_eq!(measurements.packets(), [packet(0.0, Some(0.024)), packet(0.001, None), packet(0.001, None)]);
        assert_eq!(Measurements::from_csv("t,delay\n0,soon\n").unwrap_err().line(), 2);
    }
}
