// ---- Lines over time.

/** Sets the resolution of a canvas to that of the screen. Returns the context, and the size in points. */
function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = '11px system-ui, sans-serif';
  return { context, width, height };
}

/** Returns the smallest number of the form 1, 2 or 5 times a power of ten that is not below `number`. */
function round125(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return [1, 2, 5, 10].map((n) => n * power).find((n) => n >= number * 0.999999);
}

const PLOTS = [
  { canvas: 'delay-plot', key: 'delay', high: 'high', least: 1e-3, most: Infinity, word: (v) => span(v, 2) },
  { canvas: 'loss-plot', key: 'loss', least: 0.01, most: 1, word: percent },
  { canvas: 'rate-plot', key: 'rate', least: 1e3, most: Infinity, word: (v) => bits(v, 2) },
];

/** Draws a plot. The link `chosen` is drawn last, with a thick line. */
function drawPlot(plot, links, chosen) {
  const { context, width, height } = prepare($(plot.canvas));
  if (width === 0 || past.length === 0) return;
  const left = 62;
  const right = width - 8;
  const top = 8;
  const bottom = height - 20;
  const now = past[past.length - 1].t;
  // A run shorter than the span of the plot uses the whole width.
  const shown = Math.min(SHOWN, Math.max(12, Math.ceil((now - past[0].t) / 6) * 6));
  let most = plot.least;
  for (const row of past) {
    if (row.gap || row.t < now - shown) continue;
    for (const value of row[plot.key]) if (value > most) most = value;
    if (plot.high && row[plot.high][chosen] > most) most = row[plot.high][chosen];
  }
  const step = round125(most / 3);
  const scale = Math.min(plot.most, Math.ceil((most * 1.02) / step) * step);
  const x = (t) => right - ((now - t) / shown) * (right - left);
  const y = (value) => bottom - (value / scale) * (bottom - top);

  context.lineWidth = 1;
  context.strokeStyle = ink.line;
  context.fillStyle = ink.soft;
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  for (let value = 0; value <= scale * 1.0001; value += step) {
    const at = Math.round(y(value)) + 0.5;
    context.beginPath();
    context.moveTo(left, at);
    context.lineTo(right, at);
    context.stroke();
    context.fillText(value === 0 ? '0' : plot.word(value), left - 6, at);
  }
  context.textBaseline = 'alphabetic';
  for (const ago of [shown, (shown * 2) / 3, shown / 3, 0]) {
    context.textAlign = ago === 0 ? 'right' : ago === shown ? 'left' : 'center';
    context.fillText(ago === 0 ? 'now' : '−' + ago + ' s', x(now - ago), height - 5);
  }

  context.save();
  context.beginPath();
  context.rect(left, top - 2, right - left, bottom - top + 4);
  context.clip();
  context.lineJoin = 'round';
  const many = links > COLOURED;
  for (let link = 0; link < links; link += 1) {
    if (link === chosen) continue;
    context.globalAlpha = many ? 0.35 : 0.8;
    stroke(context, plot.key, link, x, y, many ? ink.faint : colour(link), many ? 1 : 1.5);
  }
  if (chosen >= 0 && chosen < links) {
    context.globalAlpha = 0.16;
    if (plot.high) band(context, plot, chosen, x, y, linkColour(chosen, links));
    context.globalAlpha = 1;
    stroke(context, plot.key, chosen, x, y, linkColour(chosen, links), 2.5);
  }
  context.restore();
}

/** Draws a line, with gaps where no value is known. */
function stroke(context, key, link, x, y, style, lineWidth) {
  context.strokeStyle = style;
  context.lineWidth = lineWidth;
  context.beginPath();
  let down = false;
  for (const row of past) {
    const value = row.gap ? null : row[key][link];
    if (value === null || value === undefined) {
      down = false;
    } else if (down) {
      context.lineTo(x(row.t), y(value));
    } else {
      context.moveTo(x(row.t), y(value));
      down = true;
    }
  }
  context.stroke();
}

/** Draws the area from the median to the 99th percentile. */
function band(context, plot, link, x, y, style) {
  context.fillStyle = style;
  let run = [];
  const fill = () => {
    if (run.length > 1) {
      context.beginPath();
      for (const row of run) context.lineTo(x(row.t), y(row[plot.high][link]));
      for (const row of run.reverse()) context.lineTo(x(row.t), y(row[plot.key][link]));
      context.fill();
    }
    run = [];
  };
  for (const row of past) {
    if (row.gap || row[plot.key][link] === null || row[plot.high][link] === null) fill();
    else run.push(row);
  }
  fill();
}
