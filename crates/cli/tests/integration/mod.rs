//! The command line as its users meet it. Every test types a command in a folder of its own and looks at what comes back: the exit status, standard
//! output, standard error and files. Expected numbers come from counting, from a closed form or from another record of the same run.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
#![allow(clippy::print_stderr, reason = "a test that cannot run here says so")]
#![expect(clippy::float_cmp, reason = "what is printed is what was computed, to the bit")]

mod admittance;
mod against;
mod answer_pages;
mod campaign;
mod campaign_pictures;
mod campaign_verdicts;
mod certificate_checker;
mod check;
mod check_page;
mod compare;
mod completions;
mod desk;
mod documents;
#[cfg(all(target_os = "linux", not(feature = "falcon")))]
mod driverless;
mod errors;
#[cfg(unix)]
mod exec;
#[cfg(unix)]
mod exec_hosts;
#[cfg(unix)]
mod exec_loopback;
#[cfg(unix)]
mod exec_trials;
mod existing;
mod explain;
#[cfg(feature = "falcon")]
mod falcon;
mod fit;
mod fit_captures;
mod fit_hold_out;
mod fit_programs;
mod help;
#[cfg(unix)]
mod interrupt;
#[cfg(all(target_os = "linux", feature = "inverse3"))]
mod inverse3;
#[cfg(target_os = "linux")]
mod join;
mod link;
#[cfg(unix)]
mod live;
#[cfg(all(unix, feature = "falcon"))]
mod live_falcons;
mod measured;
mod messages;
mod output;
mod overrides;
mod page_pictures;
mod pages;
mod paper;
mod records;
#[cfg(target_os = "linux")]
mod relay;
#[cfg(target_os = "linux")]
mod relay_tcp;
#[cfg(unix)]
mod replays;
#[cfg(target_os = "linux")]
mod router;
mod run;
mod run_page;
#[cfg(target_os = "linux")]
mod running;
mod scenes;
#[cfg(unix)]
mod shards;
#[cfg(target_os = "linux")]
mod signals;
mod stability_boundary;
mod stability_certificates;
mod stability_chance;
mod stability_claims;
mod stability_map;
mod stability_point;
mod stability_proofs;
mod stability_server_certificates;
mod stability_switching;
mod stability_topology_certificates;
mod stability_wall_certificates;
mod stability_wave_certificates;
mod standard_input;
#[cfg(target_os = "linux")]
mod stop;
mod study;
mod svg;
mod sweep;
#[cfg(target_os = "linux")]
mod targets;
#[cfg(unix)]
mod two_processes;
