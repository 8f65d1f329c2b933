// ---- The last minute of every link.

/** How much is shown [s], and over how much loss and rate are taken [s]. */
const SHOWN = 60;
const OVER = 1;

/** One row per state that came in: { t, delay, high, loss, rate }, the last three lists in the order of the links. */
let past = [];
let before = null;

/** Takes a state in. A run that began anew has no past. */
function remember(state) {
  const t = state.elapsed_s;
  if (before && (t < before.t || state.links.length !== before.links)) past = [];
  before = { t, links: state.links.length };
  while (past.length > 2 && past[0].t < t - SHOWN - OVER - 1) past.shift();
  let from = null;
  for (let i = past.length - 1; i >= 0 && !past[i].gap; i -= 1) {
    from = past[i];
    if (from.t <= t - OVER) break;
  }
  const row = { t, gap: false, delay: [], high: [], loss: [], rate: [], offered: [], dropped: [], bytes: [] };
  state.links.forEach((link, i) => {
    row.offered.push(link.offered + link.duplicated);
    row.dropped.push(link.dropped_in_all);
    row.bytes.push(link.delivered_bytes);
    row.delay.push(link.recent_delay.p50_s);
    row.high.push(link.recent_delay.p99_s);
    // Over too little time one packet looks like a storm.
    const long = from !== null && t >= from.t + OVER / 2;
    const offered = long ? row.offered[i] - from.offered[i] : 0;
    row.loss.push(offered > 0 ? Math.min(1, (row.dropped[i] - from.dropped[i]) / offered) : null);
    row.rate.push(long ? ((row.bytes[i] - from.bytes[i]) * 8) / (t - from.t) : null);
  });
  past.push(row);
}

/** Nothing is known of the time until the next state. */
function forget() {
  const last = past[past.length - 1];
  if (last && !last.gap) past.push({ t: last.t, gap: true });
}
