//! The documents of all commands and their keys.

/// Document of a command.
pub(super) struct Document {
    pub(super) command: &'static str,
    /// Lines for `sh` that print documents of this kind, one each, and in which every key occurs.
    pub(super) lines: &'static [&'static str],
    pub(super) rows: &'static [(&'static str, &'static str)],
}

/// Command that succeeds on machines on which the router can run: it needs namespaces and devices.
pub(super) const NAMESPACES: &str = "unshare --map-root-user --net --mount true && test -w /dev/net/tun && ip -V && python3 -V";

pub(super) const DOCUMENTS: [Document; 25] = [
    Document {
        command: "run",
        lines: &[
            "cohaptic run scenarios/rigid/tray.toml --json",
            "cohaptic run scenarios/tasks/hold.toml --set task.radius=0.0001 --json",
            "cohaptic run scenarios/network/shared-access-line.toml --against scene.seed=2 --measure all --json --out out",
            "cohaptic live scenarios/live/two-and-a-program.toml --for 50ms --listen 127.0.0.1:0 --no-priority --out session > said && \
             cohaptic run scenarios/live/two-and-a-program.toml --inputs session/inputs.csv --force --json",
        ],
        rows: &[
            ("title", "of the scene"),
            ("duration_s", "how much was simulated: the scene's duration, unless numbers overflowed or the run was interrupted"),
            ("ticks", "of the peer that made the most"),
            ("ending", "`complete`, `diverged` (a position or a velocity was not finite, or two copies were more than 1 m apart) or `interrupted`"),
            ("wall_s, realtime_factor", "the time the run took, and `duration_s` divided by it. Only these differ from run to run"),
            (
                "peers[].name, peers[].position_m, peers[].velocity_m_s",
                "state of the copy at the peer's first tick at or after the end: a number with one axis, else a list",
            ),
            (
                "peers[].orientation, peers[].angular_velocity_rad_s",
                "where the object turns: quaternion w, x, y, z and angular velocity about the axes of the copy",
            ),
            ("peers[].stale_samples, peers[].refused_samples", "samples that came too late to be used, and that arrived damaged"),
            ("link_totals.links, link_totals.@Counters", "how many links there are between peers, and what all did together"),
            (
                "link_quantiles.delivered_fraction.NAME, link_quantiles.mean_delay_s.NAME",
                "over links, `min`, `p01`, `p50`, `p99` and `max`: of n values `p01` is the ⌈n/100⌉-th. Packets delivered, as a part of those offered, and mean delays; `null` where no link has any",
            ),
            (
                "links[].from, links[].to, links[].@Counters",
                "by sender, then receiver; `links` is `null` where there are more than 1,000: then `--links` writes them",
            ),
            ("access_lines[].peer, access_lines[].line, access_lines[].@Counters", "`line` is `uplink` or `downlink`"),
            ("max_discrepancy_m", "[discrepancy](model.md#discrepancy)"),
            ("max_rotation_discrepancy_rad", "where the object turns: the largest angle between two copies"),
            (
                "task.kind, task.outcome, task.time_s",
                "where the scene has a [task](tasks.md): its kind, its outcome, and the time from its start to the outcome",
            ),
            ("task.reached_s", "instants at which targets were reached"),
            ("task.failed_by, task.reason", "of a task that has failed: the name of a peer, and `dropped`, `left`, `tilted` or `gap`"),
            ("measures.NAME", "each [measure](#measures) that is asked for; `null` where it has no value"),
            ("files", "paths written by `--out` and `--links`"),
            ("replayed_otherwise", "with `--inputs --force`: what differs from the scene of the session, and what the record lacks"),
            ("against", "the document of the second run; absent without `--against`"),
        ],
    },
    Document {
        command: "check",
        lines: &["cohaptic check scenarios/paper/5-1-ap-2100.toml --json"],
        rows: &[
            ("scenes[].file, scenes[].passed, scenes[].failures", "in the order of the files; `failures` is a list of texts"),
            ("scenes[].expects", "whether the scene has an `[expect]`"),
            ("scenes[].notes", "what was judged in another way than with more time"),
            (
                "scenes[].expectations[].expectation",
                "`stable`, `discrepancy`, `position`, `travel`, `rotation-discrepancy`, `orientation`, `loss`, `delay` or `measures`",
            ),
            (
                "scenes[].expectations[].name, scenes[].expectations[].expected, scenes[].expectations[].found",
                "the quantity, the expected value and the outcome, in words",
            ),
            ("scenes[].expectations[].passed", "whether that is as expected"),
            ("scenes[].expectations[].unit", "of the next three; empty for ratios"),
            (
                "scenes[].expectations[].low, scenes[].expectations[].high",
                "the limits or `null`. A stable scene has a radius of at most 1, an unstable one of at least 1",
            ),
            ("scenes[].expectations[].measured", "what came out; `null` if that is not a number"),
        ],
    },
    Document {
        command: "explain",
        lines: &["cohaptic explain scenarios/network/ideal.toml --json", "cohaptic explain scenarios/network/ideal.toml --cost --json"],
        rows: &[
            ("title", "of the scene"),
            ("models[].part, models[].model, models[].reason", "a part of the scene, its model, and the reason"),
            ("left_out", "list of texts"),
            ("dimensions.plant", "positions and velocities of devices and copies"),
            ("dimensions.held", "numbers in the samples held"),
            ("dimensions.in_flight", "packets on the way at once, about"),
            ("cost.peer_ticks_per_s, cost.packets_per_s", "in a simulated second"),
            ("cost.realtime_factor", "estimated simulated seconds per second with nothing recorded"),
            ("cost.record_bytes_per_s", "what `--out` writes in a simulated second, about"),
            ("cost_measured[].kind", "with `--cost`: `engine`, `axes`, `integrator`, `sampling` or `analysis`; methods of one kind do the same work"),
            (
                "cost_measured[].method, cost_measured[].option, cost_measured[].chosen",
                "its name, the words that choose it, and whether the scene does",
            ),
            (
                "cost_measured[].cost_ms, cost_measured[].cost_of",
                "processor time in milliseconds, and what it is for; `null` if the method does not apply",
            ),
            (
                "cost_measured[].error, cost_measured[].error_of, cost_measured[].error_unit",
                "the largest difference from the reference, of what, and its unit",
            ),
            ("cost_measured[].reference, cost_measured[].note", "the method that the error is against; why a number is `null`, or a remark"),
            ("cost_span_s", "the simulated time of the runs measured"),
            ("interrupted", "whether kinds are missing"),
        ],
    },
    Document {
        command: "campaign",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --verdicts --out few --json"],
        rows: &[
            ("title", "of the scene of the first combination"),
            ("runs, runs_computed", "in the table; done this time"),
            ("wall_s, runs_per_s", "of this time"),
            ("out, file, files", "the folder; the table; the table, verdicts and pictures"),
            ("diverged", "how many runs"),
            ("combinations[].vary, combinations[].runs, combinations[].diverged", "`vary` is a list of `KEY=VALUE`"),
            (
                "combinations[].mean_discrepancy_m, combinations[].largest_discrepancy_m, combinations[].worst_run",
                "over the runs that did not diverge; the number of the run with the largest. `null` where all diverged",
            ),
            (
                "combinations[].verdict, combinations[].judged, combinations[].radius, combinations[].error_bound, combinations[].reason",
                "with `--verdicts`: [verdicts](campaign.md#verdicts)",
            ),
            ("notes", "parts that verdicts leave out, and pictures that are not drawn"),
        ],
    },
    Document {
        command: "campaign --shard",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --out shards --shard 1/1 --json"],
        rows: &[
            ("shard, out", "as `I/N`; the folder"),
            ("piece, unit", "`part` of `run`, `row` of `cell`, `block` of `sample` or `range`"),
            ("pieces, units, units_computed", "of the shard; computed this time"),
            ("wall_s", "of this time"),
        ],
    },
    Document {
        command: "campaign --status",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --out shards --shard 1/1 > said && \
                  cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --status shards --json"],
        rows: &[
            ("out, piece, unit", "as of [a shard](#campaign---shard)"),
            ("pieces, pieces_done, units, units_done", "of the whole work"),
            ("pieces_unassigned", "missing, and done by no worker now"),
            ("ends_in_s", "`null` if not known"),
            ("workers[].shard, workers[].host, workers[].process", "each process that did a shard"),
            ("workers[].state", "`working`, `done`, `interrupted`, `failed` or `killed`"),
            ("workers[].pieces, workers[].units, workers[].units_per_s", "its work until now"),
            ("workers[].units_left, workers[].ends_in_s", "of its shard; `null` if not known"),
        ],
    },
    Document {
        command: "compare",
        lines: &[
            "cohaptic compare scenarios/network/loss-independent.toml --strategies average-position,local-damping,extrapolated --vary link.delay=8ms,24ms --runs 2 \
             --out compared --json",
            "cohaptic compare scenarios/tasks/reach.toml --strategies average-position,extrapolated --runs 2 --out tasks --json",
        ],
        rows: &[
            ("title", "of the scene of the first combination that runs"),
            ("runs, runs_computed", "in the table; done this time"),
            ("wall_s", "of this time"),
            ("out, files", "the folder; the table of runs, verdicts, the table of figures, the page"),
            (
                "strategies[].name, strategies[].set",
                "as it is written; what it puts into the scene, a list of `KEY=VALUE`. The first is the baseline",
            ),
            ("measures[].name, measures[].unit, measures[].about", "the measures that any run has"),
            ("combinations[].strategy, combinations[].vary", "`vary` is a list of `KEY=VALUE` without the strategy"),
            ("combinations[].refused", "why the strategy does not run here; `null` where it does"),
            ("combinations[].runs", "how many runs there are"),
            (
                "combinations[].diverged.count, combinations[].diverged.share, combinations[].diverged.low, combinations[].diverged.high",
                "runs that diverged, with Wilson's interval of 95 %; `diverged` is `null` where nothing runs",
            ),
            (
                "combinations[].done.count, combinations[].done.share, combinations[].done.low, combinations[].done.high",
                "where the scene has a [task](tasks.md): runs in which the task was done, with the same interval",
            ),
            (
                "combinations[].verdict, combinations[].judged, combinations[].radius",
                "`stable`, `unstable`, `marginal`, `overflow` or `undecided`; by `spectral-radius`, `mean-square` or `two-runs`, which have no radius. `null` where nothing runs",
            ),
            ("combinations[].measures[].name, combinations[].measures[].count", "a measure; runs that did neither and have it"),
            (
                "combinations[].measures[].mean.value, combinations[].measures[].mean.low, combinations[].measures[].mean.high",
                "their mean with Student's interval of 95 %, whose ends are `null` of one run; `mean` is `null` of none",
            ),
            (
                "combinations[].measures[].difference.count, combinations[].measures[].difference.value, combinations[].measures[].difference.low, \
                 combinations[].measures[].difference.high",
                "the difference to the baseline over the seeds of which both runs have the measure; `null` of the baseline and of no seed",
            ),
        ],
    },
    Document {
        command: "stability point",
        lines: &[
            "cohaptic stability point scenarios/network/loss-independent.toml --json",
            "cohaptic stability point scenarios/paper/5-1-pd-1000.toml --losses-in-a-row 1 --json",
            "cohaptic stability point scenarios/network/push-contact.toml --switching --json",
            "cohaptic stability point scenarios/counterexamples/two-fingers.toml --switching --json",
            "cohaptic stability point scenarios/network/rate-and-queue.toml --every-number --certificate proof.json --json",
        ],
        rows: &[
            ("title", "of the scene"),
            ("verdict", "`stable`, `marginal`, `overflow` or `unstable`"),
            (
                "judged",
                "the question that it answers: `spectral-radius`; with random links `mean-square`, or `nominal` where that cannot be followed",
            ),
            ("left_out", "of a nominal verdict, the random parts of the links that it leaves out, such as `random loss`; else empty"),
            ("spectral_radius, error_bound", "with nothing left to chance; the true radius is within the bound"),
            ("mean_square_radius, mean_square_error_bound", "with random links whose second moment can be followed"),
            ("rigid_modes, dimension", "how many were removed; how many states are left"),
            ("method", "`reduced`, `determinant` or `full`"),
            ("frame_s", "the span that the radius is over"),
            (
                "per_second, time_constant_s",
                "the factor of the slowest disturbance in a second; after how long it is smaller by e, negative where it grows. `null` where the bounds of the radius leave more than a percent open",
            ),
            ("time_constant_bounds_s", "least and most, by the bounds of the radius; `null` where growth cannot be told"),
            ("parts[].@Parts of a scene", "of the worst combination of contacts"),
            (
                "modes[].contacts, modes[].verdict, modes[].spectral_radius, modes[].error_bound, modes[].parts[].@Parts of a scene",
                "each combination of contacts, in words (empty: as they are)",
            ),
            ("worst_case.verdict", "if asked for: `stable`, `undecided` or `unstable`"),
            (
                "worst_case.lower, worst_case.upper, worst_case.open, worst_case.certificate",
                "bounds of the growth in `worst_case.step_s`, and whether over 1 % apart",
            ),
            ("worst_case.links, worst_case.step_s, worst_case.dimension, worst_case.products, worst_case.notes", "what was searched, and how far"),
            ("worst_case.sequence, worst_case.period", "the pattern that grows as the lower bound"),
            ("switching.verdict, switching.notes", "if asked for: `stable`, `unstable` or `undecided`, and what it takes for granted"),
            ("switching.motions[].motion, switching.motions[].verdict", "each motion that has contacts, in words (empty: the only one)"),
            ("switching.motions[].rate", "the factor by which a norm is proven to shrink in a frame; `null` unless stable"),
            (
                "switching.motions[].growth, switching.motions[].frames, switching.motions[].changes",
                "of a motion found: its growth in a frame, its frames and changes of contacts; `null` unless unstable",
            ),
            ("every_number.peer", "the first of the equal peers"),
            (
                "every_number.spans[].from, every_number.spans[].to, every_number.spans[].verdict, every_number.spans[].reason",
                "numbers with one verdict; `to` is `null` without end; why, if undecided",
            ),
            ("every_number.mean_square, every_number.without_limit", "whether in the mean square; what has no limit as N grows, or `null`"),
            (
                "every_number.certificates, every_number.interrupted, every_number.file, every_number.uncertified[].from, every_number.uncertified[].to",
                "counts; whether numbers were left; the file of `--certificate`; decided numbers without",
            ),
            ("notes", "what the verdict leaves out; where there are two radii, each note names its own"),
        ],
    },
    Document {
        command: "stability map",
        lines: &[
            "cohaptic stability map scenarios/coordination/n3.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 3x3 --curve object.mass=1 --out map --json",
            "cohaptic stability map scenarios/network/loss-independent.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 2x2 --curve object.mass=1 --out lossy --json",
        ],
        rows: &[
            ("title, files, notes", "of the scene; the files written; the parts left out"),
            ("x_key, x_unit, x, y_key, y_unit, y", "the two keys and their values"),
            ("criterion", "`spectral-radius` or `mean-square`"),
            ("spectral_radius, mean_square_radius", "one of both: a row for each y; `null` where it is not finite"),
            ("nominal", "in the mean square: which cells leave out chance, a row for each y"),
            ("nominal_cells, stable_fraction", "how many these are; the share of stable cells, whatever question their verdicts answer"),
            (
                "verdicts[].judged, verdicts[].count, verdicts[].stable_fraction",
                "cells by that question, `spectral-radius`, `mean-square` or `nominal`: how many there are, and the share of them that is stable",
            ),
            ("left_out", "the random parts of the links that nominal cells leave out; empty where there are none"),
            ("curves[].name, curves[].overrides, curves[].file", "of each `--curve`"),
            (
                "curves[].criterion, curves[].spectral_radius, curves[].mean_square_radius, curves[].nominal, curves[].nominal_cells, curves[].stable_fraction",
                "as above",
            ),
            ("curves[].verdicts[].judged, curves[].verdicts[].count, curves[].verdicts[].stable_fraction, curves[].left_out", "as above"),
            ("wall_s, cells_per_s, cells_computed", "of this time; kept cells are not counted"),
        ],
    },
    Document {
        command: "stability map --prove",
        lines: &[
            "cohaptic stability map scenarios/coordination/n3.toml --set object.split-mass=false --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --prove 2 --every-number 3..4 --certificate --out proof --json",
        ],
        rows: &[
            ("title, x_key, x_unit, x_range, y_key, y_unit, y_range, files, wall_s", "as of a map"),
            ("halvings", "of a range at most"),
            ("every_number.from, every_number.to", "with `--every-number`"),
            ("regions[].name, regions[].overrides, regions[].file", "the scene, then each `--curve`"),
            ("regions[].stable, regions[].unstable, regions[].undecided", "shares of the area"),
            ("regions[].lines.stable, regions[].lines.unstable, regions[].lines.undecided", "boxes of a single delay, without area"),
            ("regions[].boxes, regions[].certificates, regions[].uncertified, regions[].interrupted", "counts; whether boxes were left"),
            ("regions[].stable_alone, regions[].unstable_alone", "the share proven so here, and proven otherwise for the first"),
        ],
    },
    Document {
        command: "stability boundary",
        lines: &["cohaptic stability boundary scenarios/paper/5-1-ap-2100.toml --along coordination.stiffness=100..6000 --tolerance 0.1 --json"],
        rows: &[
            ("title, key, unit, low, high", "of the scene; of the key"),
            ("criterion", "`spectral-radius` or `mean-square`"),
            ("first", "the verdict at `low`"),
            ("crossings[].value, crossings[].from, crossings[].to", "where the verdict changes, and how"),
            ("marginal", "stretches that cannot be told from 1, each with `low` and `high`"),
            ("tolerance, samples, finest, coarsest", "how exact a crossing is; how many values, and their least and greatest distance"),
            ("settled", "`false` if it ended after 100000 values"),
            ("nominal, left_out", "at how many values chance is left out, and which parts of it"),
            ("verdicts[].judged, verdicts[].count, verdicts[].stable_fraction", "the values looked at, as the cells of a map"),
            ("notes, files", "the parts left out; the files written"),
        ],
    },
    Document {
        command: "stability boundary --prove",
        lines: &[
            "cohaptic stability boundary scenarios/paper/5-1-ap-2100.toml --along coordination.stiffness=100..6000 --prove --certificate --out proof --json",
        ],
        rows: &[
            ("title, key, unit, low, high, files", "as of a boundary"),
            ("stretches[].low, stretches[].high, stretches[].verdict", "crossings lie in `undecided` ones"),
            ("tolerance, certificates, uncertified, interrupted", "length of an undecided stretch; counts; whether stretches were left"),
        ],
    },
    Document {
        command: "admittance",
        lines: &[
            "cohaptic admittance scenarios/coordination/n3.toml --peer left --at 0.1 --curve object.mass=1 --json",
            "cohaptic admittance scenarios/network/loss-independent.toml --peer left --at 0.1 --json",
        ],
        rows: &[
            ("title, peer", "of the scene; which peer was pushed"),
            ("@Curve of an admittance", "of the scene as it stands"),
            ("mean_square.verdict, mean_square.radius, mean_square.error_bound", "of the second moment, where chance can be followed"),
            ("curves[].name, curves[].overrides, curves[].@Curve of an admittance", "of each `--curve`"),
            ("files, interrupted", "what was written; whether frequencies are missing"),
        ],
    },
    Document {
        command: "live",
        lines: &[
            "cohaptic live scenarios/live/two-and-a-program.toml --set measure.names=all --for 50ms --listen 127.0.0.1:0 --no-priority --json",
            "cohaptic live scenarios/tasks/hold.toml --set task.fail.force=0.001 --for 50ms --no-priority --json",
        ],
        rows: &[
            ("measures.NAME", "each [measure](#measures) of the scene; of energy, only that of copies that the session simulates"),
            ("title, duration_s, ending, ticks, max_discrepancy_m, files", "as [of a run](#run)"),
            ("task.kind, task.outcome, task.time_s, task.reached_s, task.failed_by, task.reason", "as of a run"),
            ("valid", "whether at most one in a thousand ticks and datagrams was later than the tolerance"),
            ("late_ticks", "ticks later than the tolerance"),
            ("lateness_us.@Lateness", "of ticks"),
            ("release_lateness_us.@Lateness", "of datagrams to other programs"),
            ("behind_us", "logical time behind the clock at the last event"),
            ("peers[].kind, peers[].name, peers[].position_m, peers[].velocity_m_s, peers[].stale_samples, peers[].refused_samples", "as of a run"),
            (
                "peers[].seat.taken, peers[].seat.joined, peers[].seat.refused, peers[].seat.out_of_order",
                "of peers elsewhere: samples taken, joinings, samples refused and out of order",
            ),
            ("peers[].seat.late, peers[].seat.most_late_us", "late samples, counted at the next instant; the largest lateness"),
            ("link_totals.NAME, link_quantiles.NAME, links[].from, links[].to, links[].@Counters, access_lines", "as of a run"),
            ("door.address, door.handled", "with other programs: where it listens; `handled` = `admitted` + `welcomed` + all of `refused`"),
            ("door.admitted, door.welcomed, door.refused.NAME", "datagrams; refused ones [by cause](live-protocol.md#why-a-datagram-is-refused)"),
            ("door.joinings, door.sent, door.nobody_there, door.send_failures.NAME, door.oversized, door.kernel_drops", "what else was counted"),
            ("granted, refused_wishes", "what the system granted and refused"),
        ],
    },
    Document {
        command: "relay",
        lines: &["cohaptic relay --listen 127.0.0.1:0 --to 127.0.0.1:9 --for 50ms --no-priority --json"],
        rows: &[
            ("title, form", "of the file, or `LISTEN -> TO`; `mesh` or `proxy`"),
            ("duration_s, ending", "how long it ran; `complete` (`--for`) or `interrupted`"),
            ("valid", "whether releases were as late as tolerated"),
            ("packets", "datagrams that came in. With the copies that links made: sent at all `ports`, `dropped`, `in_flight` and `unsent`"),
            ("dropped", "datagrams and copies that did not go out; those that the kernel dropped unread are in `ports`"),
            ("release_error_us.@Lateness", "of sent datagrams"),
            ("clamped_us.@Lateness", "of datagrams read after time had passed their time stamp"),
            ("links[].from, links[].to, links[].@Counters", "of each directed link"),
            ("links[].asked_mean_delay_s, links[].changes", "at the beginning (`null` where only a recording knows); changes since"),
            ("links[].delivered_bytes, links[].overload, links[].undeliverable", "as in [the report](relay.md#dropped-datagrams)"),
            ("ports[].name, ports[].address, ports[].received, ports[].sent", "of a proxy: `listen`, and all `clients` together"),
            ("ports[].send_failures.NAME, ports[].oversized, ports[].receive_errors", "not sent or not read; failures by reason"),
            ("ports[].receive_buffer_bytes, ports[].kernel_drops", "what the system granted; `null` if it does not tell"),
            ("refused.NAME", "dropped on entry: `stranger`, `to-itself`, `no-room`, `overload`"),
            ("in_flight.packets, in_flight.bytes", "on their way at the end"),
            ("unsent", "out of their links, not sent before the end"),
            ("clients_without_socket", "clients for which no socket could be had"),
            ("granted, refused_wishes", "what the system granted and refused"),
        ],
    },
    Document {
        command: "router",
        lines: &[
            "cp programs/router.toml . && python3 programs/router.py router.toml --set 'rules=[{ protocol = \"icmp\", link = \"pass\" }]' --for 300ms --json",
        ],
        rows: &[
            ("title, duration_s", "the file; how long it ran"),
            ("ending", "`complete` (`--for`), `interrupted` or `failed`"),
            ("valid, release_error_us.@Lateness", "as of the relay"),
            ("packets, dropped", "what came in; what did not go out"),
            ("sides[].name, sides[].device", "left, right"),
            (
                "sides[].received.packets, sides[].received.bytes, sides[].received.not_ip, sides[].received.malformed, sides[].received.passed, sides[].received.dropped",
                "from the device",
            ),
            ("sides[].by_default.packets, sides[].by_default.bytes", "of those, what no rule decided"),
            (
                "sides[].written.packets, sides[].written.bytes, sides[].written.full, sides[].written.too_long, sides[].written.refused",
                "to the device",
            ),
            ("links[].name, links[].from, links[].to, links[].@Counters", "from the left, then from the right"),
            ("links[].delivered_bytes, links[].overload, links[].asked_mean_delay_s, links[].changes", "as of the [relay](#relay)"),
            ("rules[].packets, rules[].bytes", "what each rule decided"),
            ("in_flight.packets, in_flight.bytes", "inside all links at the end"),
            ("granted, refused_wishes", "what the system granted and refused"),
        ],
    },
    Document {
        command: "falcon probe",
        lines: &["cohaptic falcon probe --simulated --virtual-time --json"],
        rows: &[
            ("falcons[].@Falcon", "of each device"),
            ("falcons[].opened, falcons[].error", "whether it could be opened, and why not"),
            ("falcons[].@Exchanges with a Falcon", "of each device"),
        ],
    },
    Document {
        command: "falcon home",
        lines: &["cohaptic falcon home --simulated --virtual-time --json"],
        rows: &[
            ("@Falcon", "which device"),
            ("ending", "`complete`, `interrupted` or `failed`"),
            ("is_homed, is_active", "whether it was homed, and pulled out"),
            ("@Exchanges with a Falcon", "what was exchanged"),
        ],
    },
    Document {
        command: "falcon watch",
        lines: &["cohaptic falcon watch --simulated --virtual-time --for 2s --json"],
        rows: &[
            ("@Falcon", "which device"),
            ("ending", "`complete`, `interrupted` or `failed`"),
            ("active_after_s", "when forces first could go out"),
            ("@Exchanges with a Falcon", "what was exchanged"),
            ("lowest_m, highest_m, fastest_m_s", "of the grip"),
            ("forces.@Forces of a Falcon", "what became of the forces asked for"),
            ("files", "what was written"),
        ],
    },
    Document {
        command: "falcon simulate",
        lines: &["cohaptic falcon simulate --for 1s --json"],
        rows: &[
            ("hand, seed, asked_n, ending, driver_error", "what was asked for, and how it ended"),
            ("changes[].t_s, changes[].phase, changes[].light, more_changes", "the first hundred phases; how many more"),
            ("@Exchanges with a Falcon", "what was exchanged"),
            ("forces.@Forces of a Falcon", "what became of the force"),
            (
                "device.commands, device.garbage_bytes, device.misheard_bytes, device.largest_count, device.largest_count_unhomed, device.saturated, device.torque_timeouts",
                "what the device saw",
            ),
            (
                "true_position_m, largest_position_error_m, motor_force_n, largest_motor_force_n",
                "of the simulated device itself; the position from the base",
            ),
        ],
    },
    Document {
        command: "link",
        lines: &[
            "cohaptic link delay 20ms 2ms distribution normal loss 1% 25% duplicate 1% corrupt 1% rate 1mbit --packets 20000 --json",
            "cohaptic link rate=12Mbit 'cross-traffic={ poisson = { rate = \"6Mbit\" } }' --packets 1000 --json",
        ],
        rows: &[
            ("asked.spec", "as written"),
            (
                "asked.NAME",
                "what follows from the laws: `mean_s`, `sd_s`, `least_s`, `quantiles_s`, `autocorrelation` (lags 1 to 10), `loss`, `loss_run_mean`, `loss_autocorrelation`, `duplicated`, `damaged`, `rate_bit_s`; what does not follow is left out",
            ),
            ("achieved.NAME", "what was measured, with standard errors (`_se`) and intervals of 95 %, as defined by the RFCs; copies count"),
            ("compared[].name, compared[].asked, compared[].achieved, compared[].standard_error, compared[].outside", "the rows of the table"),
            ("fates.@Counters but mean_delay_s", "what became of the packets"),
            (
                "cross_traffic.offered, cross_traffic.dropped",
                "packets of the [cross-traffic](emulator-stages.md#cross-traffic) up to the last packet at the queue; absent where there were none",
            ),
            (
                "packets_per_s, measured_packets, interrupted, files",
                "how fast; of how many packets figures are, the first; whether cut short; what was written",
            ),
        ],
    },
    Document {
        command: "link --list, link --show",
        lines: &["cohaptic link --list --json"],
        rows: &[
            (
                "profiles[].name, profiles[].version, profiles[].grade",
                "the name without version, the version, and the worst grade of delay, rate and loss: A, B, C or preset",
            ),
            (
                "profiles[].what, profiles[].place, profiles[].when, profiles[].method, profiles[].not_modelled",
                "what is modelled, where and when it was measured, how the numbers were made, and what is missing",
            ),
            ("profiles[].down.keys.NAME, profiles[].up.keys.NAME", "the keys of the link in either direction, as TOML"),
            (
                "profiles[].down.reasons.NAME, profiles[].up.reasons.NAME",
                "of each key `grade`, the names of its `sources`, and `how` it follows from them",
            ),
            ("profiles[].down.between.NAME, profiles[].up.between.NAME", "how links of this kind differ, from the 10th to the 90th percentile"),
            ("profiles[].modulators", "the modulators of both directions, as TOML"),
            ("profiles[].sources.NAME", "of each source `cite`, how it was `read`, and the `licence` of its data"),
        ],
    },
    Document {
        command: "fit",
        lines: &[
            "python3 programs/captures.py && cohaptic fit sender.pcap receiver.pcap --skew --least 20ms --json",
            "python3 programs/measured.py && cohaptic fit line.json --direction up --json",
            "python3 programs/measured.py && cohaptic fit line.txt --split even --hold-out 50% --json",
            "python3 programs/measured.py && cohaptic fit rate.json --walk --json",
        ],
        rows: &[
            ("link.NAME", "the link that fits best; `link.jitter.distribution` is `empirical` where no law fits"),
            (
                "goodness.NAME",
                "what was measured, and how well each law and each model of loss fits: `resolution_s` of the clock, `effective` number of delays; of each law \
                 `kolmogorov`, its `p_value`, and whether it `fits`, with a distance of at most `kolmogorov_limit`; \
                 `independence` of the delays, or of what the correlation time does not explain: rank correlation of `neighbours`, and the `statistic` of several `lags` \
                 with its `p_value`",
            ),
            ("scene", "the `[link]` table as text"),
            (
                "skew.seconds_per_second, skew.standard_error, skew.interval_99, skew.significant, skew.location, skew.blocks",
                "with `--skew`: the [drift](commands-network.md#fit)",
            ),
            ("matched.unmatched_sent, matched.unmatched_arrived, matched.ambiguous", "of two captures: packets in one alone, or indistinguishable"),
            ("matched.left_out", "packets of the sender at its beginning and at its end that the other capture could not show"),
            ("matched.sender.@Contents of a capture, matched.receiver.@Contents of a capture", "what each file holds"),
            (
                "measured_by.program, measured_by.direction",
                "of a [file of another program](commands-network.md#files-of-other-programs): which one, and the way of the packets",
            ),
            (
                "measured_by.either_way, measured_by.other_way, measured_by.copies",
                "packets that are not counted: lost on a way that the file does not name, lost on the other way, answered again",
            ),
            ("measured_by.share", "with `--split`: the share of the round trip that is the delay"),
            ("measured_by.notes", "what was assumed, as sentences"),
            (
                "recorded.program, recorded.rate.NAME, recorded.notes",
                "of a file without delays of packets, in place of `link`, `goodness` and `clocks`: which program wrote it; of a measured rate `intervals`, `seconds`, \
                 `mean_bps`, `between_bps` (10 % and 90 % of the intervals), `loss`, and whether it `is_lower_bound`; what the link lacks",
            ),
            (
                "recorded.walk.NAME",
                "with `--walk`: measured `seconds`, `rates_bps` (means of the fifths), `sojourn_s` in an inner state (half of that at both ends), the autocorrelations of the \
                 rate after 1, 5 and 10 s (`measured`, and those of the `walk`), and why the walk is `refused`",
            ),
            (
                "hold_out.fitted, hold_out.held_out, hold_out.refused",
                "with `--hold-out`: packets of both parts, and why the [held-out packets](commands-network.md#packets-that-the-fit-has-not-seen) refuse the link",
            ),
            (
                "hold_out.measured.NAME, hold_out.best.NAME, hold_out.independent.NAME, hold_out.gilbert.NAME, hold_out.replay.NAME",
                "figures of the held-out packets, of this link, of independent packets, of Gilbert–Elliott losses with independent delays, and of the first part: \
                 `mean_s`, `quantiles_s` (95 %, 99 %), `wasserstein_s` (W₁ from the held-out delays), `autocorrelation` (1, 10 and 100 packets apart), `loss`, \
                 `mean_run`, `longer_runs` (shares of the runs of two or more and of three or more losses)",
            ),
            (
                "hold_out.transfer_s.measured, hold_out.transfer_s.best, hold_out.transfer_s.independent, hold_out.transfer_s.gilbert, hold_out.transfer_s.replay",
                "time in which a server that accepts a connection sends 10⁶ bytes over TCP, in both ways over the same link: median of 101 connections, `null` if \
                 half of the connections end before",
            ),
            ("clocks.added_s", "with `--offset` or `--least`, or where an offset is assumed: what was added to every delay"),
            ("clocks.is_assumed", "`true` where the offset is assumed: the least delays of both ways are then equal"),
            (
                "clocks.steps",
                "[steps](commands-network.md#clocks-that-are-apart) of the least delay: `at_s`, `by_s`, and the number of the first `packet` after it",
            ),
            ("clocks.fitted.first, clocks.fitted.packets", "the packets that were fitted, the first one counted from 0"),
        ],
    },
    Document {
        command: "paper",
        lines: &["cohaptic paper --quick --json"],
        rows: &[
            (
                "claims[].id, claims[].claim, claims[].paper, claims[].says, claims[].ours, claims[].verdict",
                "the claim, its place in the paper, what the paper says there, what was computed, and the verdict",
            ),
            (
                "claims[].tables[].title, claims[].tables[].groups[].name, claims[].tables[].groups[].columns, claims[].tables[].head, claims[].tables[].rows",
                "tables of the computed numbers: title, groups of columns with their names and numbers of columns, names of the columns, and cells; ✗ marks where the claim fails",
            ),
            ("claims[].why", "why paper and result differ, as far as it is known; empty if they do not"),
            ("claims[].scene, claims[].how, claims[].commands", "text of a scene that shows the result, and commands for it with what they show"),
            ("figures[].id, figures[].file, figures[].title", "`file` is `null` without `--out`"),
            ("wall_s", "the time it took"),
        ],
    },
    Document {
        command: "Errors",
        lines: &["cohaptic run scenarios/network/ideal.toml --set link.dlay=8ms --json 2> said"],
        rows: &[
            ("status, message", "the exit status; the message as on standard error, without `error:`"),
            ("place", "where a text is refused, else `null`"),
            ("place.file, place.argument", "the file (`null` for an option), and the argument, such as `--set link.dlay=8ms` (`null` for a file)"),
            ("place.line, place.column, place.key", "from 1; the dotted path or `null`"),
            ("place.fault", "fault and expected form"),
        ],
    },
];
