//! What the packages of benches share.

pub mod machine;
pub mod mesh;
pub mod one_link;
