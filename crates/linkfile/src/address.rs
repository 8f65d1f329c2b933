//! Socket addresses in numbers or as `localhost`.

use std::net::{Ipv4Addr, SocketAddr};

/// Error: a text is no socket address.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AddressError {
    /// An address or a name without a port.
    #[error("has no port")]
    Port,
    /// The text is a port at a host whose name would have to be looked up.
    #[error("names a host that would need a look-up")]
    Name,
    /// The text has another form.
    #[error("is no address")]
    Form,
}

/// Reads a socket address such as `127.0.0.1:7000`, `[::1]:7000` or `localhost:7000`. The name `localhost` always stands for 127.0.0.1 (RFC 6761, section 6.3:
/// names in `localhost` resolve to a loopback address without a look-up), so that reading a file sends no query.
///
/// # Errors
///
/// [`AddressError`], which names the missing part; names other than `localhost` are refused.
pub fn address(text: &str) -> Result<SocketAddr, AddressError> {
    if let Ok(address) = text.parse() {
        return Ok(address);
    }
    // Before the split at the last colon: an IPv6 address without a port contains colons.
    if text.parse::<std::net::IpAddr>().is_ok() {
        return Err(AddressError::Port);
    }
    let (host, port) = text.rsplit_once(':').map_or((text, None), |(host, port)| (host, Some(port)));
    let is_host = !host.is_empty() && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.'));
    // Digits and dots that are no IPv4 address are a slip, and not the name of a host.
    let in_numbers = host.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    if !is_host || in_numbers {
        return Err(AddressError::Form);
    }
    let Some(port) = port else { return Err(AddressError::Port) };
    // `parse` also takes a sign, so the digits are checked here.
    let plain = port.bytes().all(|byte| byte.is_ascii_digit());
    let port = port.parse().ok().filter(|_| plain).ok_or(AddressError::Form)?;
    if host.eq_ignore_ascii_case("localhost") { Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port))) } else { Err(AddressError::Name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn localhost_is_an_address_and_other_names_are_not() {
        for (text, meant) in
            [("127.0.0.1:7000", "127.0.0.1:7000"), ("[::1]:7000", "[::1]:7000"), ("localhost:7000", "127.0.0.1:7000"), ("LocalHost:0", "127.0.0.1:0")]
        {
            assert_eq!(address(text), Ok(meant.parse().unwrap()), "{text}");
        }
        for (text, why) in [
            ("localhost", AddressError::Port),
            ("127.0.0.1", AddressError::Port),
            ("::1", AddressError::Port),
            ("host.example:7000", AddressError::Name),
            ("", AddressError::Form),
            (":7000", AddressError::Form),
            ("localhost:", AddressError::Form),
            ("localhost:65536", AddressError::Form),
            ("localhost:+7", AddressError::Form),
            ("1.2.3:7000", AddressError::Form),
            ("256.1.1.1:7000", AddressError::Form),
            ("a b:7000", AddressError::Form),
        ] {
            assert_eq!(address(text), Err(why), "{text}");
        }
    }
}
