//! Route of packets: the stages of a line, in the order of a layout.

/// Stage of a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stage {
    Mtu,
    Outage,
    Loss,
    Duplication,
    Corruption,
    Limit,
    Bucket,
    Bottleneck,
    Slots,
    Propagation,
}

/// Order of the stages of a physical link.
pub(super) const PHYSICAL: [Stage; 10] = [
    Stage::Mtu,
    Stage::Outage,
    Stage::Loss,
    Stage::Duplication,
    Stage::Corruption,
    Stage::Limit,
    Stage::Bucket,
    Stage::Bottleneck,
    Stage::Slots,
    Stage::Propagation,
];

/// Order of the stages of netem.
pub(super) const NETEM: [Stage; 10] = [
    Stage::Mtu,
    Stage::Outage,
    Stage::Duplication,
    Stage::Loss,
    Stage::Corruption,
    Stage::Limit,
    Stage::Propagation,
    Stage::Bucket,
    Stage::Bottleneck,
    Stage::Slots,
];

/// The configured stages, in the order of the layout. Most lines have two of the ten, so packets and searches for the next event visit few stages.
#[derive(Clone, Debug)]
pub(super) struct Route {
    /// The configured stages in the first `count` entries. The rest is not read.
    pub(super) stages: [Stage; 10],
    pub(super) count: u8,
    /// Index of the first configured stage after the limit: only later stages can keep a packet.
    keeping: u8,
    /// Index in `stages` of the first configured stage after a stage, indexed by this stage.
    pub(super) behind: [u8; 10],
}

impl Route {
    pub(super) fn new(layout: &[Stage; 10], is_there: impl Fn(Stage) -> bool) -> Self {
        let mut route = Self { stages: *layout, count: 0, keeping: 0, behind: [0; 10] };
        for &stage in layout {
            // `behind` is set for unconfigured stages too: packets of a removed stage go on from there.
            if is_there(stage) {
                route.stages[usize::from(route.count)] = stage;
                route.count += 1;
            }
            route.behind[stage as usize] = route.count;
            if stage == Stage::Limit {
                route.keeping = route.count;
            }
        }
        route
    }

    /// Returns the configured stages that can keep a packet: all stages after the limit.
    pub(super) fn keeping(&self) -> &[Stage] {
        &self.stages[usize::from(self.keeping)..usize::from(self.count)]
    }
}
