//! Halves of Unix streams.

use super::{SocketAddr, UnixStream};

crate::net::halves::halves!(UnixStream, SocketAddr, {});
