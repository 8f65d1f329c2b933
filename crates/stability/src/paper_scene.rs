//! The scene that most unit tests use.

/// The paper's parameters (Rakhsha & Constantinescu 2015, Section 3): three users who all hold the object.
pub(crate) const PAPER: &str = r#"
    scene        = { duration = "1s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;
