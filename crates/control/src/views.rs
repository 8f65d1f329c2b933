//! JSON of the routes. Spans are in seconds, sizes in bytes, positions in metres, forces in newtons, and orientations quaternions (w, x, y, z).

use core::time::Duration;

use serde_json::{Map, Value, json};

use crate::{Description, Latest, LinkCounters, MeasureLabel, PeerView, Quantiles, Snapshot};

/// Returns the whole state of a run with its names: clocks, links, peers, measures.
pub(crate) fn state(latest: &Latest) -> Value {
    let (description, snapshot) = (&*latest.description, &*latest.snapshot);
    let mut state = json!({
        "kind": description.kind,
        "title": description.title,
        "number": latest.number,
        "elapsed_s": snapshot.elapsed.as_secs_f64(),
        "valid": snapshot.invalid.is_none(),
        "invalid": snapshot.invalid,
        "clocks": clocks(description, snapshot),
        "links": (0..description.links.len()).map(|number| link(description, snapshot, number)).collect::<Vec<_>>(),
        "peers": peers(description, snapshot),
        "refused": counted(&snapshot.refused),
    });
    if !description.measures.is_empty() {
        state["measures"] = measures(description, snapshot).into();
    }
    if let Some(body) = &description.body {
        state["body"] = json!({ "edges": body.edges });
    }
    state
}

/// Returns a link's names and counters. `number` is below the number of links.
pub(crate) fn link(description: &Description, snapshot: &Snapshot, number: usize) -> Value {
    let none = LinkCounters::default();
    let name = &description.links[number];
    // A snapshot shorter than the description counts as filled up with defaults.
    let counters = snapshot.links.get(number).unwrap_or(&none);
    json!({
        "link": number,
        "name": name.name,
        "from": name.from,
        "to": name.to,
        "offered": counters.offered,
        "duplicated": counters.duplicated,
        "delivered": counters.delivered,
        "delivered_bytes": counters.delivered_bytes,
        "dropped": counted(&counters.dropped),
        "dropped_in_all": counters.dropped_in_all(),
        "marked": counters.marked,
        "damaged": counters.damaged,
        "in_flight": counters.in_flight,
        "mean_delay_s": counters.mean_delay.map(|delay| delay.as_secs_f64()),
        "recent_delay": quantiles(&counters.recent_delay),
    })
}

/// Returns the distributions of clock lateness and of recent link delay.
pub(crate) fn histograms(latest: &Latest) -> Value {
    let (description, snapshot) = (&*latest.description, &*latest.snapshot);
    let links = description.links.iter().enumerate().map(|(number, name)| {
        let delays = snapshot.links.get(number).map(|counters| counters.recent_delay).unwrap_or_default();
        json!({ "link": number, "name": name.name, "recent_delay": quantiles(&delays) })
    });
    json!({
        "number": latest.number,
        "elapsed_s": snapshot.elapsed.as_secs_f64(),
        "clocks": clocks(description, snapshot),
        "links": links.collect::<Vec<_>>(),
    })
}

fn clocks(description: &Description, snapshot: &Snapshot) -> Vec<Value> {
    let clock = |(number, name): (usize, &String)| {
        let lateness = snapshot.lateness.get(number).copied().unwrap_or_default();
        json!({ "name": name, "lateness": quantiles(&lateness) })
    };
    description.clocks.iter().enumerate().map(clock).collect()
}

/// Returns the measures; a measure without a value is `null`.
fn measures(description: &Description, snapshot: &Snapshot) -> Vec<Value> {
    let measure = |(number, label): (usize, &MeasureLabel)| {
        let value = snapshot.measures.get(number).copied().flatten();
        json!({ "name": label.name, "value": value, "unit": label.unit, "about": label.about })
    };
    description.measures.iter().enumerate().map(measure).collect()
}

fn peers(description: &Description, snapshot: &Snapshot) -> Vec<Value> {
    let none = PeerView::default();
    let peer = |(number, name): (usize, &crate::PeerName)| {
        let view = snapshot.peers.get(number).unwrap_or(&none);
        let mut shown = json!({
            "name": name.name,
            "kind": name.kind,
            "status": view.status.name(),
            "age_s": view.age.map(|age| age.as_secs_f64()),
            "position": view.position,
            "force": view.force,
        });
        // An entry only for participants that another program runs.
        if let Some(joined) = &view.joined {
            shown["joined"] = json!({ "device": joined.device, "address": joined.address, "lost": joined.lost, "sent": joined.sent });
        }
        // Without a body nothing rotates, and the entries would be `null` in every state.
        if let Some(body) = &description.body {
            shown["grasp"] = json!(body.grasps.get(number));
            shown["orientation"] = json!(view.turn.map(|turn| turn.orientation));
            shown["device"] = json!({
                "position": view.turn.and_then(|turn| turn.device),
                "orientation": view.turn.and_then(|turn| turn.device_orientation),
            });
        }
        shown
    };
    description.peers.iter().enumerate().map(peer).collect()
}

/// Returns a distribution in seconds. Without observations all quantiles are `null`.
fn quantiles(quantiles: &Quantiles) -> Value {
    let seconds = |span: Duration| (quantiles.count > 0).then_some(span.as_secs_f64());
    json!({
        "count": quantiles.count,
        "sum_s": quantiles.sum.as_secs_f64(),
        "p50_s": seconds(quantiles.p50),
        "p99_s": seconds(quantiles.p99),
        "p999_s": seconds(quantiles.p999),
        "max_s": seconds(quantiles.max),
    })
}

/// Returns counts by cause. Counts of a cause listed twice are added, because a JSON object has each name once.
fn counted(causes: &[(&'static str, u64)]) -> Map<String, Value> {
    let mut map = Map::new();
    for (cause, count) in causes {
        let before = map.get(*cause).and_then(Value::as_u64).unwrap_or_default();
        map.insert((*cause).to_owned(), before.saturating_add(*count).into());
    }
    map
}
