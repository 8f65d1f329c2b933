//! Checks of the figures of a connection: `%{ assert NAME OPERATOR VALUE }%`, by the names of Linux's `tcp_info`.

use cohaptic_tcp::{CaState, Info, State};

use crate::parse::{Cursor, Fault};

#[derive(Debug)]
pub(crate) struct Check {
    name: String,
    operator: String,
    value: String,
}

const OPERATORS: [&str; 6] = ["==", "!=", "<=", ">=", "<", ">"];

impl Check {
    /// Reads the rest of the checks up to `}%`. Checks stand on lines of their own, or have `and` or `;` between them.
    pub(crate) fn parse(cursor: &mut Cursor<'_>) -> Result<Vec<Self>, Fault> {
        let mut checks = Vec::new();
        while !cursor.eats("}%") {
            cursor.needs("assert ")?;
            loop {
                let line = cursor.line();
                let name = cursor.word().to_owned();
                let operator = cursor.takes(|c| "=!<>".contains(c)).to_owned();
                let value = cursor.word().to_owned();
                let check = Self { name, operator, value };
                // The value of a name changes, but that a name is known does not.
                if check.holds(&Default::default()).is_none() {
                    return Err(Fault { line, text: format!("the check `{} {} {}` is unknown", check.name, check.operator, check.value) });
                }
                checks.push(check);
                if !cursor.eats("and ") {
                    break;
                }
            }
            cursor.eats(";");
        }
        Ok(checks)
    }

    /// Returns whether the check holds, or `None` if its words are unknown.
    fn holds(&self, figures: &Figures) -> Option<bool> {
        let (left, right) = (figures.get(&self.name)?, figures.get(&self.value)?);
        let order = left.cmp(&right);
        let index = OPERATORS.iter().position(|operator| *operator == self.operator)?;
        Some([order.is_eq(), order.is_ne(), order.is_le(), order.is_ge(), order.is_lt(), order.is_gt()][index])
    }

    /// Returns what is wrong with `info`, if something is.
    pub(crate) fn failure(&self, info: &Info) -> Option<String> {
        let figures = Figures(Some(*info));
        let seen = figures.get(&self.name)?;
        (self.holds(&figures) != Some(true)).then(|| format!("{} is {seen}, and not {} {}", self.name, self.operator, self.value))
    }
}

/// Values of names. Without a connection every figure is zero.
#[derive(Default)]
struct Figures(Option<Info>);

impl Figures {
    fn get(&self, name: &str) -> Option<u64> {
        if let Ok(number) = name.parse() {
            return Some(number);
        }
        const STATES: [&str; 12] = [
            "",
            "TCP_ESTABLISHED",
            "TCP_SYN_SENT",
            "TCP_SYN_RECV",
            "TCP_FIN_WAIT1",
            "TCP_FIN_WAIT2",
            "TCP_TIME_WAIT",
            "TCP_CLOSE",
            "TCP_CLOSE_WAIT",
            "TCP_LAST_ACK",
            "TCP_LISTEN",
            "TCP_CLOSING",
        ];
        const CA_STATES: [&str; 5] = ["TCP_CA_Open", "TCP_CA_Disorder", "TCP_CA_CWR", "TCP_CA_Recovery", "TCP_CA_Loss"];
        for names in [&STATES[1..], &CA_STATES[..]] {
            if let Some(index) = names.iter().position(|known| *known == name) {
                return Some((index + usize::from(names.len() > CA_STATES.len())) as u64);
            }
        }
        let of = |get: &dyn Fn(&Info) -> u64| Some(self.0.as_ref().map_or(0, get));
        match name {
            "tcpi_state" => of(&|info| state_number(info.state)),
            "tcpi_ca_state" => of(&|info| ca_number(info.ca_state)),
            "tcpi_unacked" => of(&|info| info.unacked.into()),
            "tcpi_sacked" => of(&|info| info.sacked.into()),
            "tcpi_lost" => of(&|info| info.lost.into()),
            "tcpi_retrans" => of(&|info| info.retrans.into()),
            "tcpi_reordering" => of(&|info| info.reordering.into()),
            "tcpi_total_retrans" => of(&|info| info.retransmissions),
            "tcpi_snd_cwnd" => of(&|info| info.congestion_window.into()),
            // Linux's infinite threshold is 2³¹ − 1.
            "tcpi_snd_ssthresh" => of(&|info| info.slow_start_threshold.min(0x7fff_ffff).into()),
            "tcpi_snd_mss" => of(&|info| info.segment_size as u64),
            "tcpi_snd_wnd" => of(&|info| info.send_window),
            "tcpi_rto" => of(&|info| info.timeout.as_micros() as u64),
            "tcpi_rtt" => of(&|info| info.srtt.unwrap_or_default().as_micros() as u64),
            "tcpi_rttvar" => of(&|info| info.rttvar.as_micros() as u64),
            "tcpi_min_rtt" => of(&|info| info.least_rtt.unwrap_or_default().as_micros() as u64),
            _ => None,
        }
    }
}

const fn state_number(state: State) -> u64 {
    match state {
        State::Established => 1,
        State::SynSent => 2,
        State::SynReceived => 3,
        State::FinWait1 => 4,
        State::FinWait2 => 5,
        State::TimeWait => 6,
        State::Closed => 7,
        State::CloseWait => 8,
        State::LastAck => 9,
        State::Closing => 11,
    }
}

const fn ca_number(state: CaState) -> u64 {
    match state {
        CaState::Open => 0,
        CaState::Disorder => 1,
        CaState::Cwr => 2,
        CaState::Recovery => 3,
        CaState::Loss => 4,
    }
}
