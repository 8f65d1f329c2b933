// ---- All together.

function onFrame(next) {
  if (takeFrame(next)) readFacts().catch(() => {});
}

let lost = true;
function onTrouble(text, looksOn) {
  lost = text !== null && !looksOn;
  put($('trouble'), text || '');
  $('trouble').hidden = text === null;
  document.body.classList.toggle('stale', lost);
  put($('server'), lost ? 'disconnected' : 'connected');
  $('server').className = 'pill ' + (lost ? 'bad' : 'good');
  // After a lost connection the server may have another token or other facts.
  if (!lost) readFacts().catch(() => {});
  else ask('/api/play').catch((error) => {
    if (error.message.startsWith('no token')) put($('trouble'), 'The server has another token now: open the address that it printed.');
  });
}

/** Returns a text about late ticks: how many were late and by how much, what this means, and what the visitor can do. */
const whyNotValid = (reason) => 'Not valid as a measurement, because ticks of the simulation came too late: ' + reason + '. The computer is too busy. The motion '
  + 'is computed right all the same, but the hand felt it later than the links say. Close other programs and pages, or take fewer peers; then “Put everything back” counts anew.';

async function showValid() {
  if (lost || document.hidden) return;
  const state = await ask('/api/state');
  put($('valid'), state.valid ? 'valid' : 'not valid');
  $('valid').className = 'pill ' + (state.valid ? 'good' : 'bad');
  $('valid').title = state.valid ? 'so far at most one tick in a thousand was too late' : '';
  put($('late'), state.valid ? '' : whyNotValid(state.invalid));
  $('late').hidden = state.valid;
}

readInk();
makeControls();
makeHand();
makeKeyboard();
makeSteps();
makeCompare();
showHolding();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  readInk();
  drawCurves();
});
addEventListener('resize', drawCurves);
setInterval(showNumbers, 250);
setInterval(showTask, 250);
setInterval(() => showValid().catch(() => {}), 2000);
let before = performance.now();
requestAnimationFrame(function next(now) {
  const passed = Math.min(100, Math.max(0, now - before));
  before = now;
  stepKeyboard(passed);
  stepGamepad(passed, now);
  stepHand(now);
  watchSteps(now);
  drawAll(passed, now);
  requestAnimationFrame(next);
});
connect(onFrame, onTrouble);
