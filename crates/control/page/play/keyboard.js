// ---- Control by the keyboard alone.

/** Speed of the hand while a key is held [m/s]. */
const KEY_SPEED = 0.12;
const WAYS = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
const pressed = new Set();
let slowly = false;

function makeKeyboard() {
  const canvas = $('rooms');
  canvas.addEventListener('keydown', (event) => {
    slowly = event.shiftKey;
    if (event.key in WAYS) {
      hand.swaying = null;
      takeHold();
      pressed.add(event.key);
      event.preventDefault();
    } else if (event.key === ' ' || event.key === 'Enter') {
      if (hand.holding) letGo();
      else takeHold();
      event.preventDefault();
    } else if (event.key === 'Escape') letGo();
  });
  addEventListener('keyup', (event) => {
    slowly = event.shiftKey;
    pressed.delete(event.key);
  });
  for (const gone of ['blur', 'visibilitychange']) addEventListener(gone, () => pressed.clear());
  canvas.addEventListener('blur', () => pressed.clear());
}

function stepKeyboard(passed) {
  for (const key of pressed) moveHand(WAYS[key].map((way) => (way * KEY_SPEED * (slowly ? 0.25 : 1) * passed) / 1000));
}
