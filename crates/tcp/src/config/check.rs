//! Limits of the constants of a connection.

use core::fmt;

use super::TcpConfig;

/// Reason for which [`TcpConfig::check`] refuses a configuration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ConfigError {
    /// The MTU \[byte\] is below 128. The headers of IPv6 and TCP with all options take 100 octets.
    Mtu(usize),
    /// The named count, size or time is zero.
    Zero(&'static str),
    /// The lower bound, named first, is above the upper bound, named second.
    Order(&'static str, &'static str),
    /// The receive buffer \[byte\] is above 1 GiB, the largest window (RFC 7323, section 2.3).
    ReceiveBuffer(usize),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mtu(octets) => write!(f, "the MTU {octets} is below 128 bytes"),
            Self::Zero(name) => write!(f, "{name} is zero"),
            Self::Order(least, greatest) => write!(f, "{least} is above {greatest}"),
            Self::ReceiveBuffer(octets) => write!(f, "the receive buffer {octets} is above 1 GiB"),
        }
    }
}

impl core::error::Error for ConfigError {}

impl TcpConfig {
    /// Checks the limits of the constants.
    ///
    /// # Errors
    ///
    /// Returns the first limit that a constant breaks.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.mtu < 128 {
            return Err(ConfigError::Mtu(self.mtu));
        }
        // Without keep-alive, the defaults stand in and pass both checks of `keepalive`.
        let keepalive = self.keepalive.unwrap_or_default();
        let zeros = [
            ("ttl", self.ttl == 0),
            ("initial_window", self.initial_window == 0),
            ("initial_timeout", self.initial_timeout.is_zero()),
            ("receive_buffer", self.receive_buffer == Some(0)),
            ("least_receive_buffer", self.least_receive_buffer == 0),
            ("least_send_buffer", self.least_send_buffer == 0),
            ("the interval of keep-alive probes", keepalive.interval.is_zero()),
            ("the idle time before keep-alive probes", keepalive.idle.is_zero()),
            // A timeout of zero would never let an answer arrive, so one of the two bounds must be above zero.
            ("least_variance and least_timeout", self.least_variance.is_zero() && self.least_timeout.is_zero()),
        ];
        if let Some((name, _)) = zeros.iter().find(|(_, is_zero)| *is_zero) {
            return Err(ConfigError::Zero(name));
        }
        if self.largest_window() > 1 << 30 {
            return Err(ConfigError::ReceiveBuffer(self.largest_window()));
        }
        let pairs = [
            ("least_timeout", "greatest_timeout", self.least_timeout > self.greatest_timeout),
            ("initial_timeout", "greatest_timeout", self.initial_timeout > self.greatest_timeout),
            ("least_receive_buffer", "greatest_receive_buffer", self.least_receive_buffer > self.greatest_receive_buffer),
            ("least_send_buffer", "send_buffer", self.least_send_buffer > self.send_buffer),
        ];
        match pairs.iter().find(|(.., is_wrong)| *is_wrong) {
            Some((least, greatest, _)) => Err(ConfigError::Order(least, greatest)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;
    use core::time::Duration;

    use super::*;
    use crate::Keepalive;

    /// Every limit of the fields' descriptions, once.
    #[test]
    fn impossible_constants_are_refused() {
        type Change = fn(&mut TcpConfig);
        let cases: [(&str, Change); 16] = [
            ("the MTU 127 is below 128 bytes", |config| config.mtu = 127),
            ("ttl is zero", |config| config.ttl = 0),
            ("initial_window is zero", |config| config.initial_window = 0),
            ("initial_timeout is zero", |config| config.initial_timeout = Duration::ZERO),
            ("receive_buffer is zero", |config| config.receive_buffer = Some(0)),
            ("least_receive_buffer is zero", |config| config.least_receive_buffer = 0),
            ("least_send_buffer is zero", |config| config.least_send_buffer = 0),
            ("the interval of keep-alive probes is zero", |config| {
                config.keepalive = Some(Keepalive { interval: Duration::ZERO, ..Keepalive::default() });
            }),
            ("the idle time before keep-alive probes is zero", |config| {
                config.keepalive = Some(Keepalive { idle: Duration::ZERO, ..Keepalive::default() });
            }),
            ("least_variance and least_timeout is zero", |config| {
                (config.least_variance, config.least_timeout) = (Duration::ZERO, Duration::ZERO);
            }),
            ("the receive buffer 1073741825 is above 1 GiB", |config| config.receive_buffer = Some((1 << 30) + 1)),
            ("the receive buffer 1073741825 is above 1 GiB", |config| config.greatest_receive_buffer = (1 << 30) + 1),
            ("least_timeout is above greatest_timeout", |config| config.least_timeout = config.greatest_timeout + Duration::from_nanos(1)),
            ("initial_timeout is above greatest_timeout", |config| config.initial_timeout = config.greatest_timeout + Duration::from_nanos(1)),
            ("least_receive_buffer is above greatest_receive_buffer", |config| config.least_receive_buffer = config.greatest_receive_buffer + 1),
            ("least_send_buffer is above send_buffer", |config| config.least_send_buffer = config.send_buffer + 1),
        ];
        for (text, change) in cases {
            let mut config = TcpConfig::default();
            assert_eq!(config.check(), Ok(()));
            change(&mut config);
            assert_eq!(config.check().unwrap_err().to_string(), text);
        }
        assert_eq!(TcpConfig::textbook().check(), Ok(()));
    }
}
