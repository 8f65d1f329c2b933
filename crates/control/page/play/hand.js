// ---- The hand: the wanted position of the device, by mouse, pen or finger.

/** Largest distance of a hand from the origin [m]. */
const FARTHEST = 0.5;
const hand = { holding: false, at: [0, 0, 0], swaying: null, pressed: false, touched: false };

/** Takes hold of the device at its present position, so that the device does not jerk. */
function takeHold() {
  if (hand.holding || ownHand === null || !shown[ownHand]) return;
  hand.holding = true;
  hand.at = [...shown[ownHand].device];
  showHolding();
}

function letGo() {
  if (!hand.holding) return;
  hand.holding = hand.pressed = false;
  hand.swaying = null;
  hand.released = performance.now();
  tellHand(null);
  showHolding();
}

function moveHand(by) {
  hand.at = hand.at.map((value, axis) => (axis < facts.axes ? Math.max(-FARTHEST, Math.min(FARTHEST, value + by[axis])) : 0));
}

function showHolding() {
  const button = $('grasp');
  button.setAttribute('aria-pressed', String(hand.holding));
  put(button, hand.holding ? 'Let go' : 'Take hold');
  const holds = hand.pressed ? 'you hold it until you release' : 'you hold it: Escape lets go';
  put($('holding'), ownHand === null ? 'you look on' : hand.holding ? holds : 'nobody holds your device');
  // In a study only the person moves the hand.
  $('sway')?.setAttribute('aria-pressed', String(hand.swaying !== null));
  $('rooms').classList.toggle('held', hand.holding);
}

function makeHand() {
  const canvas = $('rooms');
  let last = null;
  canvas.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    // A press that takes hold lets go when it ends. A hand that already held keeps holding, so that the mouse is free for the controls.
    hand.pressed = !hand.holding || hand.pressed || hand.swaying !== null;
    hand.swaying = null;
    hand.touched = event.pointerType === 'touch';
    takeHold();
    showHolding();
    last = { id: event.pointerId, x: event.clientX, y: event.clientY };
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    event.preventDefault();
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!last || event.pointerId !== last.id || !rooms[ownPlace()]) return;
    moveHand(inWorld(rooms[ownPlace()], event.clientX - last.x, event.clientY - last.y));
    last = { ...last, x: event.clientX, y: event.clientY };
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => {
    if (!last || event.pointerId !== last.id) return;
    last = null;
    if (hand.pressed) letGo();
  });
  canvas.addEventListener('wheel', (event) => {
    if (facts.axes < 3 || !hand.holding) return;
    moveHand([0, 0, -event.deltaY / 10000]);
    event.preventDefault();
  }, { passive: false });
  $('grasp').addEventListener('click', () => (hand.holding ? letGo() : takeHold()));
  $('sway')?.addEventListener('click', () => {
    takeHold();
    hand.swaying = hand.swaying === null && hand.holding ? { begin: performance.now(), from: [...hand.at] } : null;
    showHolding();
  });
}

/** Sends the position of the hand. Called once per picture. */
function stepHand(now) {
  if (!hand.holding) return;
  if (hand.swaying) {
    // The hand moves along a figure of eight that begins at its position.
    const t = (now - hand.swaying.begin) / 1000;
    const [x, y] = [0.04 * Math.sin(2.2 * t), facts.axes > 1 ? 0.02 * Math.sin(4.4 * t) : 0];
    hand.at = hand.swaying.from.map((value, axis) => value + [x, y, 0][axis]);
  }
  tellHand(hand.at);
}
