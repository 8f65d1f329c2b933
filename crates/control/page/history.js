// ---- The last minute of every link.

/** Span of the plots [s], and span over which loss and rate are averaged [s]. */
const SHOWN = 60;
const OVER = 1;

/** Rows, one per received state: { t, delay, high, loss, rate }. Lists are in the order of the links. */
let past = [];
let before = null;

/** Takes in a state. A run that has begun anew has no earlier rows. */
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
    // Over a very short time a single packet would give a high rate.
    const long = from !== null && t >= from.t + OVER / 2;
    const offered = long ? row.offered[i] - from.offered[i] : 0;
    row.loss.push(offered > 0 ? Math.min(1, (row.dropped[i] - from.dropped[i]) / offered) : null);
    row.rate.push(long ? ((row.bytes[i] - from.bytes[i]) * 8) / (t - from.t) : null);
  });
  past.push(row);
}

/** Marks the time until the next state as unknown. */
function forget() {
  const last = past[past.length - 1];
  if (last && !last.gap) past.push({ t: last.t, gap: true });
}
