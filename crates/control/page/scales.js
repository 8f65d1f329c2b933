// ---- Keys with a slider.

/** Returns the numbers from `from` to `to` in steps, both included. */
function steps(...ranges) {
  const values = [];
  for (const [from, to, step] of ranges) {
    const n = Math.round((to - from) / step);
    for (let i = 0; i <= n; i += 1) values.push(Number((from + i * step).toPrecision(6)));
  }
  return values;
}

const SPANS = { ns: 1e-6, us: 1e-3, 'µs': 1e-3, ms: 1, s: 1e3, min: 6e4, h: 3.6e6 };
const RATES = { bit: 1, kbit: 1e3, Mbit: 1e6, Gbit: 1e9, 'bit/s': 1, 'kbit/s': 1e3, 'Mbit/s': 1e6, 'Gbit/s': 1e9 };
const DECADES = [1e4, 1e5, 1e6, 1e7, 1e8, 1e9].flatMap((decade) => [1, 1.5, 2, 3, 5, 7].map((n) => n * decade));

/** Keys with a slider. Every position of a slider is a useful value. */
const SLIDERS = [
  { key: 'delay', empty: '0ms', values: steps([0, 50, 1], [55, 200, 5], [250, 1000, 50]), units: SPANS, text: (ms) => ms + 'ms' },
  { key: 'jitter', empty: '0ms', values: steps([0, 10, 0.5], [12, 50, 2], [60, 200, 10]), units: SPANS, text: (ms) => ms + 'ms' },
  { key: 'loss', empty: '0%', values: steps([0, 1, 0.1], [1.5, 10, 0.5], [12, 20, 2], [25, 50, 5], [60, 100, 10]), units: { '%': 1, '': 100 }, text: (p) => p + '%' },
  { key: 'rate', empty: 'unlimited', values: [...DECADES, 1e10, Infinity], units: RATES, text: rateText },
];

function rateText(rate) {
  if (rate === Infinity) return 'unlimited';
  const [factor, unit] = [[1e9, 'Gbit'], [1e6, 'Mbit'], [1e3, 'kbit']].find(([from]) => rate >= from) || [1, 'bit'];
  return rate / factor + unit;
}

/** Returns the position of the nearest value. */
function nearest(values, number) {
  let best = 0;
  values.forEach((value, i) => {
    if (number === value || Math.abs(value - number) < Math.abs(values[best] - number)) best = i;
  });
  return best;
}
