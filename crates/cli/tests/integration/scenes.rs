//! The scenes on the desk.

/// Two users for 200 ticks over constant links: each sends 25 samples, at 0 ms, 8 ms, ... 192 ms. Those sent until 176 ms arrive by the end.
pub(crate) const TWO: &str = r#"
[scene]
title    = "Two users"
duration = "200ms"

[object]
mass = 0.3

[coordination]
strategy  = "average-position"
stiffness = 1000.0
damping   = 20.0
update    = "8ms"

[peer]
device   = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }

[[peers]]
name = "left"
hand = { force = 1.5 }

[[peers]]
name = "right"

[link]
delay = "24ms"
"#;

/// Three users and a network that draws random numbers: jitter, loss, and a short queue before a slow line.
pub(crate) const RANDOM: &str = r#"
[scene]
title    = "Three users, far apart"
duration = "600ms"
seed     = 3

[object]
mass = 0.45

[coordination]
strategy  = "average-position"
stiffness = 1000.0
damping   = 5.0
update    = "8ms"

[peer]
device   = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }

[[peers]]
name   = "left"
hand   = { sine = { amplitude = 2.0, frequency = 3.0 } }
uplink = { rate = "100kbit", queue = { limit = "2 packets" } }

[[peers]]
name = "right"

[[peers]]
name    = "third"
contact = "none"

[link]
delay  = "24ms"
jitter = "4ms"
loss   = "10%"
outage = [{ from = "300ms", to = "350ms" }]
"#;

/// Two users in a plane.
pub(crate) const PLANE: &str = r#"
[scene]
title    = "A plane"
duration = "100ms"
axes     = 2

[object]
mass = 0.3

[coordination]
strategy  = "average-position"
stiffness = 2100.0
damping   = 5.0
update    = "8ms"

[peer]
device   = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }

[[peers]]
name = "left"
hand = { force = [1.5, -0.5] }

[[peers]]
name = "right"
"#;

/// The paper's parameters (Rakhsha & Constantinescu 2015, Section 3): three users who all hold the object.
pub(crate) const PAPER: &str = r#"
scene        = { duration = "1s", count = 3 }
object       = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link         = { delay = "8ms" }
"#;
