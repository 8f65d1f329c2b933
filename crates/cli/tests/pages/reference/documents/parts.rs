//! Keys that several documents have.

/// Table of keys. Each row has the keys that are explained together, separated by commas, and their meaning.
pub(super) struct Part {
    pub(super) name: &'static str,
    pub(super) rows: &'static [(&'static str, &'static str)],
}

/// Tables that several documents contain. A row of a document names such a table by its heading: `links[].@Counters`.
pub(super) const PARTS: [Part; 11] = [
    Part {
        name: "Counters",
        rows: &[
            ("offered, delivered", "packets sent into the line, and out of it"),
            ("duplicated", "copies that the line made"),
            ("dropped.NAME", "packets by [cause](emulator.md#fates-and-causes)"),
            ("in_flight", "packets on the way at the end. The counters [balance](emulator.md#conservation)"),
            ("marked, damaged", "delivered with a congestion mark; with flipped bits"),
            ("mean_delay_s", "of what was delivered, in this line alone; `null` if nothing was"),
        ],
    },
    Part { name: "Lateness", rows: &[("count", "how many"), ("p50, p99, p999, max", "quantiles [µs], and the largest value")] },
    Part {
        name: "Parts of a scene",
        rows: &[
            ("kind", "`whole`, `together` (equal peers as their average), `apart` (their differences), `mode` of a graph, `loose-device`"),
            ("peer", "the first peer that is meant; absent where all are"),
            ("dimension, multiplicity", "states, and how often the part occurs"),
            ("spectral_radius, error_bound", "of this part"),
        ],
    },
    Part {
        name: "Curve of an admittance",
        rows: &[
            (
                "points[].hz, points[].magnitude_db, points[].phase_deg",
                "magnitude relative to 1 m/(N·s), with turns to the unit of their axes; phase above −180 and up to 180, negative where the velocity lags",
            ),
            ("points[].ideal_db", "magnitude of the free mass, whose phase is −90"),
            ("viscosity.value, viscosity.error", "of slow motion [N·s/m]; `null` where there is no limit"),
            ("inertia.value, inertia.error", "of slow motion [kg]"),
            ("stiffness.value, stiffness.error", "of slow motion [N/m]"),
            ("verdict, spectral_radius, error_bound", "of the linear scene that is analysed"),
            ("warning", "what numbers do not mean where a verdict is not `stable`, else `null`"),
            ("object_mass_kg", "mass of the whole object, or as felt along or about the axes; `null` where infinite"),
            ("notes", "parts that are left out or taken as closed"),
        ],
    },
    Part {
        name: "Falcon",
        rows: &[("simulated, serial, product, bus, address", "which device"), ("firmware", "`running`, or `loaded` by this command")],
    },
    Part {
        name: "Exchanges with a Falcon",
        rows: &[
            ("seconds, exchanges, reports, reports_per_s", "how long, and how many packets"),
            ("timeouts, garbage_bytes, faults, implausible, unlocated, unhomed, farewells", "how often something was wrong"),
            ("late_turns, worst_late_us", "a turn is late by 0.1 ms or more"),
            ("phase, light, homed, encoders, buttons", "seen last; encoders top, right, left"),
            ("position_m, velocity_m_s, force_n", "seen last, from the origin; `null` where they mean nothing"),
        ],
    },
    Part {
        name: "Forces of a Falcon",
        rows: &[
            ("limit_n, largest_n", "the limit, and the largest force"),
            ("limited, slewed, saturated", "how many forces were changed"),
            ("zeroed.NAME", "how many were zero, by cause"),
        ],
    },
    Part {
        name: "Exchanges with an Inverse3",
        rows: &[
            ("readings, readings_per_s", "replies with a reading"),
            ("reply_p50_us, reply_p99_us, reply_max_us", "time from a message to its reply"),
            ("late, exchange_every", "replies that took longer than the scene says; the ticks that 99 of 100 replies fit in"),
            ("force_rms_n", "of the force asked for minus the device's force; `null` where the service does not say"),
            ("dropped.NAME", "replies without a meaning, by cause"),
            ("older, unasked, lost", "replies to messages before the latest, replies without a message, messages without a reply"),
            ("connections, losses", "how often the service was connected, and an armed device disarmed"),
            ("forces.largest_n, forces.limited, forces.slewed, forces.zeroed.NAME", "what became of the forces asked for"),
        ],
    },
    Part {
        name: "Inverse3",
        rows: &[
            ("simulated, device, service_version, hears_events", "which device, and whether events of the service arrive"),
            ("error", "the obstacle, or `null`"),
        ],
    },
    Part {
        name: "Figures of a study",
        rows: &[
            ("name, groups, groups_left_out", "of a measure or a question; groups with a value in every condition, and the others"),
            ("means[].mean, means[].half_width", "of each condition, with half of the interval of 95 % (`null` for one group)"),
            ("means[].timed_out, means[].trials", "trials that count as the timeout, of all with a value; `null` for a question"),
            ("differences[].mean, differences[].half_width, differences[].effect", "of each condition but the first to the first; effect size d_z"),
            ("differences[].p, differences[].p_holm", "of the sign flip test, before and after the correction of Holm"),
        ],
    },
    Part {
        name: "Contents of a capture",
        rows: &[
            ("frames", "how many"),
            ("kinds.NAME", "frames of each kind: `UDP` that were read, and everything else by name"),
            ("seen_again", "frames that show a packet again"),
            ("super_packets", "datagrams that hold several packets"),
            ("cut_off", "whether the file ends within a block"),
        ],
    },
];
