//! Documents of programs in real time: sessions, relay, router and Falcon.

use super::Document;

pub(super) const REAL_TIME: [Document; 7] = [
    Document {
        command: "live",
        lines: &[
            "cohaptic live scenarios/live/two-and-a-program.toml --set measure.names=all --for 50ms --listen 127.0.0.1:0 --no-priority --json",
            "cohaptic live scenarios/live/three-falcons.toml --for 50ms --no-priority --json",
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
            (
                "peers[].gate.zeroed.NAME",
                "of [devices](extending.md#a-device-of-your-own-in-rust) and pointers: ticks without force on the hand, by cause",
            ),
            ("peers[].gate.limited, peers[].gate.slewed", "ticks at which the force on the hand was shortened, and its change"),
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
];
