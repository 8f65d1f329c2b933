//! Router files: the links between two network interfaces.
//!
//! A router has two sides, links with names, and rules that choose the link of each packet. The keys of a link are the same as in a scene, and faults are
//! shown in the same way.
//!
//! ```
//! use std::path::Path;
//! use cohaptic_linkfile::router::{RouterFile, Target};
//!
//! let text = r#"
//!     router = { seed = 1, default = "wan" }
//!     left   = { tun = "left0", addresses = ["10.1.0.1/24"] }
//!     right  = { tun = "right0", addresses = ["10.2.0.1/24"] }
//!     links  = { wan = { delay = "24ms" } }
//!     rules  = [{ protocol = "tcp", port = 22, link = "pass" }]
//! "#;
//! let file = RouterFile::parse(text, Path::new("router.toml"), &[])?;
//! assert_eq!(file.links[0].name, "wan");
//! assert_eq!(file.rules[0].target, Target::Pass);
//!
//! let error = RouterFile::parse(&text.replace("24ms", "24 parsecs"), Path::new("router.toml"), &[]).unwrap_err();
//! assert!(error.to_string().starts_with("router.toml:5:32: links.wan.delay: unknown unit \"parsecs\""));
//! # Ok::<(), cohaptic_linkfile::FileError>(())
//! ```

mod address;
mod model;
pub(crate) mod read;
mod rules;
mod sides;

pub use address::{Network, NoNetwork};
pub use model::{Attachment, InterfaceSpec, Memory, NamedLink, Ports, Protocol, RouterFile, RuleSpec, Side, Target, TunSpec};
