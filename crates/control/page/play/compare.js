// ---- Comparison: the curves of the same hand under both strategies, and without a network.

let compared = null;

function makeCompare() {
  $('compare').addEventListener('click', compareNow);
  $('record').addEventListener('click', () => beginAnew({}));
  $('get-scene').addEventListener('click', () => download('scene.toml'));
  $('get-inputs').addEventListener('click', () => download('inputs.csv'));
}

async function compareNow() {
  $('compare').disabled = true;
  tellCompared('Running it again …', false);
  try {
    compared = await ask('/api/compare', { method: 'POST' });
    const { lasted_s, took_s, hand: name } = compared;
    const whose = facts.peers[ownHand]?.name === name ? 'your hand' : 'the hand of ' + name;
    tellCompared('The last ' + span(lasted_s, 2) + ' of ' + whose + ', run three times in ' + span(took_s, 2) + '.', false);
    showRuns();
  } catch (error) {
    tellCompared(error.message, true);
  }
  $('compare').disabled = !facts.host;
}

function tellCompared(text, bad) {
  put($('compared'), text);
  $('compared').className = bad ? 'bad' : '';
}

function showRuns() {
  $('curves').hidden = false;
  put($('command'), compared.command);
  const rows = compared.runs.map((run, i) => {
    const tr = make('tr');
    const name = make('th', 'name');
    name.scope = 'row';
    const swatch = make('span', 'swatch');
    swatch.style.background = colour(i);
    name.append(swatch, make('span', '', run.name + (run.diverged_s === null ? '' : ', falls apart after ' + span(run.diverged_s, 2))));
    tr.append(name, make('td', 'n', place([run.largest_discrepancy_m])), make('td', 'n', newtons(run.largest_force_n, 1)));
    return tr;
  });
  $('runs').replaceChildren(...rows);
  drawCurves();
}

function drawCurves() {
  if (compared === null || $('curves').hidden) return;
  drawCurve('discrepancy-plot', 'discrepancy_m', 1e3, 'mm');
  drawCurve('force-plot', 'force_n', 1, 'N');
}

/** Draws three curves over time. A curve far above the others is cut, because a diverging run would hide the other curves. */
function drawCurve(id, key, factor, unit) {
  const { context, width, height } = sized($(id));
  const peaks = compared.runs.map((run) => Math.max(...run[key])).sort((one, other) => one - other);
  const top = Math.max(Math.min(peaks[peaks.length - 1], 4 * Math.max(peaks[1], 1e-9)), 1e-6) * 1.05;
  const area = { left: 44, right: width - 6, top: 6, bottom: height - 18 };
  const x = (t) => area.left + ((area.right - area.left) * t) / compared.lasted_s;
  const y = (value) => area.bottom - ((area.bottom - area.top) * Math.min(value, top)) / top;
  context.font = '11px system-ui, sans-serif';
  context.fillStyle = ink.soft;
  context.strokeStyle = ink.line;
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  for (const share of [0, 0.5, 1]) {
    const at = Math.round(y(share * top)) + 0.5;
    context.beginPath();
    context.moveTo(area.left, at);
    context.lineTo(area.right, at);
    context.stroke();
    context.fillText(significant(share * top * factor, 2) + ' ' + unit, area.left - 4, at);
  }
  context.fillText(span(compared.lasted_s, 2), area.right, height - 7);
  context.lineWidth = 1.6;
  compared.runs.forEach((run, i) => {
    context.strokeStyle = colour(i);
    context.setLineDash(i === 2 ? [4, 3] : []);
    context.beginPath();
    run[key].forEach((value, k) => context.lineTo(x(k * compared.step_s), y(value)));
    context.stroke();
  });
  context.setLineDash([]);
}

async function download(name) {
  try {
    const response = await fetch('/api/files/' + name, { cache: 'no-store', headers: { Authorization: 'Bearer ' + token } });
    if (!response.ok) throw new Error('the server says ' + response.status);
    const link = make('a');
    link.href = URL.createObjectURL(await response.blob());
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
  } catch (error) {
    tellCompared(error.message, true);
  }
}
