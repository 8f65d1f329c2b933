//! Certificate of the servers of a test bed.
//!
//! The certificate was made once by
//!
//! ```sh
//! openssl genpkey -algorithm ed25519 -out key.pem
//! openssl req -x509 -new -key key.pem -subj /CN=testbed -addext subjectAltName=DNS:testbed -addext basicConstraints=critical,CA:FALSE \
//!     -addext keyUsage=critical,digitalSignature -days 2900000 -out certificate.pem
//! ```
//!
//! and is a constant, so that two runs are the same. Ed25519 makes signatures of fixed length, without random numbers (RFC 8032).

/// Name for which [`CERTIFICATE`] is valid.
pub const SERVER_NAME: &str = "testbed";

/// Self-signed certificate, as PEM, valid from November 2026 to the year 9966.
pub const CERTIFICATE: &str = "-----BEGIN CERTIFICATE-----
MIIBXDCCAQ6gAwIBAgIUU7KCx6p6WukTzjd5MphPjWJ/sEYwBQYDK2VwMBIxEDAO
BgNVBAMMB3Rlc3RiZWQwIBcNMjYxMTIyMDIxODA4WhgPOTk2NjEwMjgwMjE4MDha
MBIxEDAOBgNVBAMMB3Rlc3RiZWQwKjAFBgMrZXADIQCBWKmO8jPk+bVnFFJcRZO8
dEQKFVVCo2ZoEojS2kPOIqN0MHIwHQYDVR0OBBYEFLhNliyXEJ+JTAEVt1rpqX13
NrXBMB8GA1UdIwQYMBaAFLhNliyXEJ+JTAEVt1rpqX13NrXBMBIGA1UdEQQLMAmC
B3Rlc3RiZWQwDAYDVR0TAQH/BAIwADAOBgNVHQ8BAf8EBAMCB4AwBQYDK2VwA0EA
c6BskJO9kiE85mTTh9VOE8xWQQ9ojBh42t56Tt159YjwaI1bVn6QcGcvNx4RwEeX
H/VhoBGhw3sKs1e7rXRKCQ==
-----END CERTIFICATE-----
";

/// Private key of [`CERTIFICATE`], as PEM. The key is public, so use it in tests only.
pub const PRIVATE_KEY: &str = "-----BEGIN PRIVATE KEY-----
MC4CAQAwBQYDK2VwBCIEIMa02lBnjFd01vTwFnIjux/LVZO+4foPx/OeMIpu9Bkj
-----END PRIVATE KEY-----
";
