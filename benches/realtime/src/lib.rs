//! What the programs of this package share: they measure in real time, on the clock on the wall.

#[path = "floods/datagrams.rs"]
pub mod datagrams;
#[path = "floods/hello.rs"]
pub mod hello_floods;
pub mod machine;
pub mod scene;
pub mod soak;
pub mod visitor;
pub mod waiting;
