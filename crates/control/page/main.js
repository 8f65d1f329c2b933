// ---- All together.

let latest = null;
let heard = 0;
let drawn = 0;
let trouble = null;

function take(state) {
  const another = latest === null || latest.links.length !== state.links.length;
  if (latest === null || latest.number !== state.number) heard = performance.now();
  latest = state;
  if (another) showTrouble();
  remember(state);
  showRun(state);
  makeRows(state.links);
  showRows(state.links);
  takePeers(state.peers, state.body);
  showClocks(state.clocks);
  showMeasures(state.measures || []);
  showCauses($('drops'), state.links[chosen] ? state.links[chosen].dropped : {}, 'nothing');
  showCauses($('refused'), state.refused, 'none');
  $('plots').hidden = state.links.length === 0;
  if (another) readKeys().catch(() => {});
  // A plot of many links takes long to draw, so a few pictures a second are drawn.
  if (performance.now() - drawn > (rows.length > 24 ? 400 : 80)) redraw();
}

function redraw() {
  if (document.hidden || !latest) return;
  drawn = performance.now();
  for (const plot of PLOTS) drawPlot(plot, rows.length, chosen);
}

/** Says that the server does not answer, and that the shown values are old. */
function onTrouble(text) {
  trouble = text;
  if (text !== null) forget();
  else readKeys().catch(() => {});
  showTrouble();
}

function showTrouble() {
  const silent = latest && trouble === null ? (performance.now() - heard) / 1000 : 0;
  let words = '';
  if (trouble !== null) words = trouble + (latest ? '. What is shown is from ' + clock(latest.elapsed_s) + ' of the run. Trying again …' : '. Trying again …');
  // The text changes in few steps, because a screen reader reads each of them.
  else if (silent > 2) words = 'The run has reported nothing for ' + [60, 10, 2].find((s) => silent > s) + ' s or more: it has ended, or it hangs.';
  put($('trouble'), words);
  $('trouble').hidden = words === '';
  document.body.classList.toggle('stale', words !== '');
  put($('server'), trouble !== null ? 'disconnected' : latest ? 'connected' : 'connecting');
  $('server').className = 'pill ' + (trouble !== null ? 'bad' : latest ? 'good' : '');
}

readInk();
makeSliders();
makeEye();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  readInk();
  recolourRows();
  redraw();
});
$('filter').addEventListener('input', filterRows);
addEventListener('resize', redraw);
document.addEventListener('visibilitychange', redraw);
setInterval(showTrouble, 500);
setInterval(() => {
  if (trouble === null) readKeys().catch(() => {});
}, 5000);
let frame = performance.now();
requestAnimationFrame(function next(now) {
  drawCopies(Math.max(0, now - frame));
  frame = now;
  requestAnimationFrame(next);
});
listen(take, onTrouble);
