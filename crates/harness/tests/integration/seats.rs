//! Peers of a live session that join, leave and come back, and the inputs that a session refuses.

use std::convert::Infallible;

use cohaptic_harness::live::{Inputs, InputsError, LiveScene, Presence, SampleError};
use cohaptic_harness::{Ending, NoObserver, Observer, PacketRow};
use cohaptic_peer::ReceiveError;
use cohaptic_peer::wire::{DecodeError, Sample};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, NodeId};
use proptest::prelude::*;

use crate::records::session;
use crate::remote::{millis, sample};
use crate::scenes::{Written, read};

/// Returns a scene of three peers: one simulated, one in another process, and one with a device. Each link delays by 3 ms.
pub(crate) fn trio() -> Written {
    read(
        "scene = { duration = \"2s\", seed = 5 }\nobject = { mass = 0.3 }\n\
         coordination = { strategy = \"average-position\", stiffness = 1000.0, damping = 5.0, update = \"8ms\" }\n\
         peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 1000.0, damping = 5.0 } }\n\
         peers = [{ name = \"here\" }, { name = \"there\", kind = \"udp\" }, { name = \"hand\", kind = \"falcon\" }]\nlink = { delay = \"3ms\" }\n"
            .to_owned(),
    )
}

fn take(live: &mut LiveScene, at: Instant, peer: usize, datagram: &[u8]) -> Result<Instant, SampleError> {
    let Ok(taken) = live.handle_sample(at, peer, datagram, &mut NoObserver);
    taken
}

fn pass(live: &mut LiveScene, now: Instant) {
    let Ok(()) = live.handle_timeout(now, &mut NoObserver);
}

#[test]
fn a_peer_joins_falls_silent_and_comes_back_with_its_numbers_going_on() {
    let Written { scene, .. } = trio();
    let mut live = LiveScene::new(&scene, |_| None);
    let who = |live: &LiveScene| [0, 1, 2].map(|peer| live.presence(peer).unwrap());
    assert_eq!(who(&live), [Presence::Here, Presence::Absent, Presence::Absent]);
    assert_eq!(live.presence(3), None);
    pass(&mut live, millis(50));
    for sequence in 0..5 {
        assert_eq!(take(&mut live, millis(60 + 8 * sequence), 1, &sample(&scene, 1, 70 + sequence, 0.01, 0.0)), Ok(millis(60 + 8 * sequence)));
    }
    // The last at 92 ms; stale 100 ms later.
    pass(&mut live, millis(191));
    assert_eq!(live.presence(1), Some(Presence::Present));
    assert_eq!([0, 1, 2].map(|peer| live.peer(peer).unwrap().heard), [None, Some(millis(92)), None]);
    pass(&mut live, millis(192));
    assert_eq!(live.presence(1), Some(Presence::Stale(millis(192))));
    assert_eq!(live.peer(1).unwrap().object.position, [0.01, 0.0, 0.0]);
    // A new process counts from 0.
    take(&mut live, millis(500), 1, &sample(&scene, 1, 0, 0.02, 0.0)).unwrap();
    assert_eq!(live.presence(1), Some(Presence::Present));
    assert_eq!(live.peer(1).unwrap().object.position[0], 0.02);
    assert_eq!(live.peer(1).unwrap().heard, Some(millis(500)));
    let stats = live.seat_stats(1).unwrap();
    assert_eq!((stats.taken, stats.joined, stats.late), (6, 2, 0));
    assert_eq!(live.seat_stats(0), None);
    pass(&mut live, millis(510));
    let link = live.link_stats(1, 0).unwrap();
    assert_eq!((link.offered(), link.delivered()), (6, 6));
    // All were newer than what was held: the receivers took every one.
    assert_eq!(live.summary().peers[0].stale_samples, 0);
}

#[test]
fn what_the_network_delivers_to_a_process_comes_out_at_its_arrival() {
    let Written { scene, .. } = trio();
    let mut live = LiveScene::new(&scene, |_| None);
    assert_eq!(live.poll_timeout(), Some(Instant::ZERO));
    pass(&mut live, Instant::ZERO);
    assert_eq!(live.poll_transmit(), None);
    // Between ticks at 2 and 3 ms nothing happens; the packets of the tick at 0 arrive at 3 ms.
    take(&mut live, Instant::from_nanos(2_200_000), 1, &sample(&scene, 1, 9, 0.5, 0.0)).unwrap();
    pass(&mut live, millis(3));
    for from in [0, 2] {
        let transmit = live.poll_transmit().unwrap();
        let read = Sample::<1>::decode(&transmit.datagram, 1).unwrap();
        assert_eq!((transmit.to, transmit.at, read.sender, read.sequence, read.session), (1, millis(3), from, 0, 5));
    }
    assert_eq!(live.poll_transmit(), None);
    // The sample arrives elsewhere at 5.2 ms. Nobody is woken for it, since peers here look at it at their next tick, but it has arrived then.
    pass(&mut live, millis(5));
    assert_eq!(live.poll_timeout(), Some(millis(6)));
    let mut arrivals = Arrivals::default();
    let Ok(()) = live.handle_timeout(millis(6), &mut arrivals);
    let (of_sample, when) = (NodeId::new(1), Instant::from_nanos(5_200_000));
    assert_eq!(arrivals.0, [(of_sample, NodeId::new(0), when), (of_sample, NodeId::new(2), when)]);
    // For the packets of the ticks at 8 ms it is woken, and only at ticks before.
    let mut woken = Vec::new();
    while let Some(at) = live.poll_timeout().filter(|at| *at <= millis(12)) {
        woken.push(at);
        pass(&mut live, at);
    }
    assert_eq!(woken, (7..=12).map(millis).collect::<Vec<_>>());
    assert_eq!(live.poll_transmit().map(|transmit| transmit.at), Some(millis(11)));
}

/// Sender, receiver and instant of each packet that arrives.
#[derive(Default)]
struct Arrivals(Vec<(NodeId, NodeId, Instant)>);

impl Observer for Arrivals {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        if let Fate::Delivered(at) = row.fate {
            self.0.push((row.path.from, row.path.to, at));
        }
        Ok(())
    }
}

/// A driver may move a session to another thread.
#[test]
fn a_session_can_be_sent_to_another_thread() {
    fn can_be_sent<T: Send>(_: &T) {}
    can_be_sent(&LiveScene::new(&trio().scene, |_| None));
}

#[test]
fn what_is_handed_in_late_counts_at_the_first_open_instant_and_is_counted() {
    let Written { scene, .. } = trio();
    let mut live = LiveScene::new(&scene, |_| None);
    pass(&mut live, millis(20));
    let first_open = Instant::from_nanos(20_000_001);
    assert_eq!(take(&mut live, millis(20), 1, &sample(&scene, 1, 0, 0.0, 0.0)), Ok(first_open));
    assert_eq!(live.seat_stats(1).unwrap().late, 0, "what comes at the instant just handled is not late");
    assert_eq!(take(&mut live, millis(12), 1, &sample(&scene, 1, 1, 0.0, 0.0)), Ok(first_open));
    let stats = live.seat_stats(1).unwrap();
    assert_eq!((stats.late, stats.most_late), (1, first_open - millis(12)));
    assert_eq!(live.open(), first_open);
}

#[test]
fn what_is_no_sample_of_the_peer_is_refused_and_changes_nothing() {
    let Written { scene, .. } = trio();
    let good = |sequence| sample(&scene, 1, sequence, 0.01, 0.0);
    let with = |place: usize, byte: u8| {
        let mut bytes = good(7);
        bytes[place] ^= byte;
        bytes
    };
    let mut nan = good(7);
    nan[48..56].copy_from_slice(&f64::NAN.to_le_bytes());
    let other_axes = {
        let mut other = scene.clone();
        other.axes = cohaptic_scene::Axes::Two;
        sample(&other, 1, 7, 0.0, 0.0)
    };
    let refused: [(usize, Vec<u8>, SampleError); 9] = [
        (1, Vec::new(), DecodeError::TooShort { len: 0 }.into()),
        (1, vec![0; 2000], DecodeError::Magic.into()),
        (1, with(8, 1), ReceiveError::Session { found: 4 }.into()),
        (1, with(16, 1), ReceiveError::Sender { sender: 0 }.into()),
        (1, nan, DecodeError::NotFinite { axis: 0, quantity: "position" }.into()),
        (1, other_axes, DecodeError::Axes { found: 2, expected: 1 }.into()),
        (0, good(7), SampleError::NoSeat { peer: 0 }),
        (2, good(7), SampleError::NoSeat { peer: 2 }),
        (99, good(7), SampleError::NoSeat { peer: 99 }),
    ];
    let run = |junk: bool| {
        session(
            &scene,
            |_| None,
            |live, observer, _| {
                for step in 0..40 {
                    live.handle_sample(millis(8 * step), 1, &good(step), observer).unwrap().unwrap();
                    for (peer, bytes, error) in refused.iter().filter(|_| junk) {
                        assert_eq!(live.handle_sample(millis(8 * step + 1), *peer, bytes, observer).unwrap().as_ref(), Err(error));
                    }
                    // Late and repeated ones.
                    if junk && step > 1 {
                        let error = SampleError::OutOfOrder { found: step - 1, newest: step };
                        assert_eq!(live.handle_sample(millis(8 * step + 2), 1, &good(step - 1), observer).unwrap(), Err(error));
                        let error = SampleError::OutOfOrder { found: step, newest: step };
                        assert_eq!(live.handle_sample(millis(8 * step + 2), 1, &good(step), observer).unwrap(), Err(error));
                    }
                }
                if junk {
                    let stats = live.seat_stats(1).unwrap();
                    assert_eq!((stats.taken, stats.refused, stats.out_of_order), (40, 6 * 40, 2 * 38));
                }
            },
        )
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn a_session_that_has_ended_takes_nothing_and_asks_for_nothing() {
    let Written { scene, keys, .. } = trio();
    let mut live = LiveScene::new(&scene, |_| None);
    assert_eq!(live.ended(), None);
    let Ok(()) = live.stop(millis(30), &mut NoObserver);
    assert_eq!((live.ended(), live.poll_timeout()), (Some(Ending::Interrupted(millis(30))), None));
    assert_eq!(live.summary().ticks, 31);
    assert_eq!(take(&mut live, millis(40), 1, &sample(&scene, 1, 0, 0.0, 0.0)), Err(SampleError::Ended));
    let Ok(changed) = live.set_link(millis(40), (0, 1), &keys, &keys.model("".as_ref()).unwrap(), &mut NoObserver);
    assert_eq!(changed, None);

    let mut live = LiveScene::new(&scene, |_| None);
    assert_eq!(take(&mut live, millis(2000), 1, &sample(&scene, 1, 0, 0.0, 0.0)), Err(SampleError::Ended), "the end itself is not open");
    pass(&mut live, millis(5000));
    assert_eq!((live.ended(), live.poll_timeout()), (Some(Ending::Complete), None));
}

#[test]
fn a_link_that_is_changed_has_its_new_delay_from_then_on() {
    let Written { scene, keys, .. } = trio();
    let mut live = LiveScene::new(&scene, |_| None);
    pass(&mut live, millis(4));
    let keys = keys.with("delay", "1ms");
    let Ok(at) = live.set_link(millis(6), (0, 1), &keys, &keys.model("".as_ref()).unwrap(), &mut NoObserver);
    assert_eq!(at, Some(millis(6)));
    pass(&mut live, millis(12));
    let arrivals: Vec<(Instant, u32)> =
        std::iter::from_fn(|| live.poll_transmit()).map(|t| (t.at, Sample::<1>::decode(&t.datagram, 1).unwrap().sender)).collect();
    assert_eq!(arrivals, [(millis(3), 0), (millis(3), 2), (millis(9), 0), (millis(11), 2)]);
    let Ok(none) = live.set_link(millis(13), (1, 1), &keys, &keys.model("".as_ref()).unwrap(), &mut NoObserver);
    assert_eq!(none, None);
}

#[test]
fn a_record_with_a_fault_is_refused_with_its_line_and_what_was_expected() {
    let Written { scene, keys, .. } = trio();
    let header = "at_ns,input,peer,to,value";
    for (rows, expected) in [
        ("+1,end,,,", "line 2, column at_ns: found \"+1\", expected a whole number of nanoseconds"),
        ("1,end,,", "line 2, column value: found \"1,end,,\", expected five cells"),
        ("1,packet,there,,00", "line 2, column input: found \"packet\", expected sample, device, link, end or closed"),
        ("1,closed,,,x", "line 2, column value: found \"x\", expected the number of rows before this one"),
        ("2,device,hand,,none\n1,closed,,,1", "line 3: a row at 0.000000001s behind one at 0.000000002s"),
        ("1,closed,,,0\n1,end,,,", "line 3: a row at 0.000000001s behind one"),
        ("1,closed,,,0\n1,closed,,,0", "line 3: a row at 0.000000001s behind one"),
        ("1,sample,here,,00", "line 2, column peer: found \"here\", expected the name of a peer of kind \"udp\""),
        ("1,sample,nobody,,00", "line 2, column peer: found \"nobody\""),
        ("1,sample,there,,0", "line 2, column value: found \"0\", expected the bytes of a sample"),
        ("1,sample,there,,0g", "line 2, column value"),
        ("1,device,there,,none", "line 2, column peer: found \"there\", expected the name of a peer of kind \"falcon\""),
        ("1,device,hand,,1", "line 2, column value: found \"1\", expected \"none\", or 2 finite numbers"),
        ("1,device,hand,,1 inf", "line 2, column value"),
        ("1,device,hand,,1 2 3", "line 2, column value"),
        ("1,device,hand,,1 2 x", "line 2, column value"),
        ("1,link,hand,hand,\"{}\"", "line 2, column to: found \"hand\", expected another peer"),
        ("1,link,hand,here,{}", "line 2, column value: found \"{}\", expected a table of link keys in quotes"),
        ("1,link,hand,here,\"{ dlay = 1 }\"", "expected keys of a link; link.dlay: unknown key"),
        ("2,end,,,\n1,end,,,", "line 3: a row at 0.000000001s behind one at 0.000000002s"),
        ("1,end,,,\n1,device,hand,,none", "line 3: a row at 0.000000001s behind one"),
    ] {
        let error = Inputs::read(&format!("{header}\n{rows}\n"), &scene, &keys).unwrap_err();
        assert!(error.to_string().contains(expected), "{rows}: {error}");
    }
    assert!(matches!(Inputs::read("", &scene, &keys), Err(InputsError::Header { .. })));
    assert_eq!(Inputs::read(&format!("\u{feff}{header}\r\n1,device,hand,,none\r\n1,closed,,,1\r\n"), &scene, &keys).unwrap().len(), 1);
    assert!(Inputs::read(&format!("{header}\n0,closed,,,0"), &scene, &keys).unwrap().is_empty());
}

/// A record that is cut at any byte, or that lacks any line, is not taken for a whole record. Its whole lines can be read.
#[test]
fn a_record_that_is_cut_anywhere_is_not_whole() {
    let Written { scene, keys, .. } = trio();
    let text = "at_ns,input,peer,to,value\n0,program,,,0.1.0\n1,device,hand,,0.01 -0.5\n21,device,hand,,0.012 -0.53\n321,end,,,\n321,closed,,,4\n";
    let whole = Inputs::read(text, &scene, &keys).unwrap();
    assert_eq!(whole.len(), 3);
    assert_eq!(Inputs::read(text.trim_end(), &scene, &keys).unwrap(), whole, "an editor may take the last line break");
    for length in text.find('\n').unwrap()..text.len() - 1 {
        let (read, missing) = Inputs::read_cut(&text[..length], &scene, &keys).unwrap();
        let lines = text[..length].matches('\n').count().max(1);
        let at = Instant::from_nanos([0, 0, 1, 21, 321][lines - 1]);
        assert_eq!(missing, Some(InputsError::NotClosed { line: lines, at }), "{length} bytes");
        // The last row, or an end at the last row, ends the session.
        assert_eq!((read.last_instant(), read.len()), (Some(at), lines.saturating_sub(2).min(2) + 1), "{length} bytes");
    }
    let lines: Vec<&str> = text.lines().collect();
    for gone in 1..=4 {
        let cut: String = lines.iter().enumerate().filter(|(place, _)| *place != gone).map(|(_, line)| format!("{line}\n")).collect();
        let (read, missing) = Inputs::read_cut(&cut, &scene, &keys).unwrap();
        assert_eq!((missing, read.len()), (Some(InputsError::Rows { said: 4, found: 3 }), if gone == 1 { 3 } else { 2 }), "without line {gone}");
    }
}

properties! {
    #![proptest_config(crate::cases(300))]

    #[test]
    fn no_text_makes_the_reader_panic(rows in "(([0-9]{0,3}|x),(sample|device|link|end|),(here|there|hand|),(here|),.{0,12}\n?){0,4}", any in ".{0,60}") {
        let Written { scene, keys, .. } = trio();
        let _ = Inputs::read(&format!("at_ns,input,peer,to,value\n{rows}"), &scene, &keys);
        let _ = Inputs::read(&any, &scene, &keys);
    }

    #[test]
    fn no_datagram_makes_a_session_panic(bytes in prop::collection::vec(any::<u8>(), 0..120), place in 0..64_usize, byte in any::<u8>()) {
        let Written { scene, .. } = trio();
        let mut live = LiveScene::new(&scene, |_| None);
        let _ = take(&mut live, millis(1), 1, &bytes);
        let mut damaged = sample(&scene, 1, 0, 0.0, 0.0);
        damaged[place] = byte;
        let _ = take(&mut live, millis(2), 1, &damaged);
        pass(&mut live, millis(40));
        prop_assert!(matches!(live.ended(), None | Some(Ending::Diverged(_))));
    }
}

/// Number of dropped packets.
#[derive(Default)]
struct Drops(usize);

impl Observer for Drops {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        self.0 += usize::from(matches!(row.fate, Fate::Dropped(_)));
        Ok(())
    }
}

/// A session without a simulated peer or device has no ticks. Silence is noticed with the next input all the same, and drops at once.
#[test]
fn a_session_of_nothing_but_processes_goes_without_ticks() {
    let Written { scene, .. } = read(
        "scene = { duration = \"2s\" }\nobject = { mass = 0.3 }\n\
         coordination = { strategy = \"average-position\", stiffness = 1000.0, update = \"8ms\" }\n\
         peers = [{ name = \"a\", kind = \"udp\" }, { name = \"b\", kind = \"udp\" }]\n\
         link = { delay = \"3ms\" }\nlinks = [{ from = \"b\", to = \"a\", loss = 1 }]\n"
            .to_owned(),
    );
    let mut live = LiveScene::new(&scene, |_| None);
    let mut drops = Drops::default();
    assert_eq!(live.poll_timeout(), Some(millis(2000)));
    let Ok(taken) = live.handle_sample(millis(10), 0, &sample(&scene, 0, 40, 0.1, 0.0), &mut drops);
    assert_eq!(taken, Ok(millis(10)));
    let Ok(taken) = live.handle_sample(millis(11), 1, &sample(&scene, 1, 0, 0.1, 0.0), &mut drops);
    assert_eq!((taken, live.poll_timeout()), (Ok(millis(11)), Some(millis(11))));
    let Ok(()) = live.handle_timeout(millis(11), &mut drops);
    assert_eq!((drops.0, live.poll_timeout()), (1, Some(millis(13))));
    let Ok(()) = live.handle_timeout(millis(13), &mut drops);
    assert_eq!(live.poll_transmit().map(|transmit| (transmit.to, transmit.at)), Some((1, millis(13))));
    // Nothing happens in between: only the sample itself can find that its peer was silent.
    let Ok(taken) = live.handle_sample(millis(500), 0, &sample(&scene, 0, 0, 0.2, 0.0), &mut drops);
    assert_eq!((taken, live.seat_stats(0).unwrap().joined), (Ok(millis(500)), 2));
    let Ok(()) = live.handle_timeout(millis(2000), &mut drops);
    assert_eq!((live.ended(), live.summary().ticks), (Some(Ending::Complete), 0));
}
