//! What the programs of this package share: they measure in real time, on the clock on the wall.

pub mod machine;
pub mod scene;
pub mod soak;
pub mod visitor;
pub mod waiting;
