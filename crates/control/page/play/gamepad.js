// ---- Gamepads: the stick moves the hand, and the motors of the gamepad or of a phone pulse with the force.

const STICK_SPEED = 0.18;
const REST = 0.15;
const PULSE = 60;
let pulsed = 0;

const sticks = () => (navigator.getGamepads ? [...navigator.getGamepads()].filter((pad) => pad && pad.connected && pad.axes.length >= 2) : []);

function stepGamepad(passed, now) {
  const pads = sticks();
  for (const pad of pads) {
    const way = [pad.axes[0], -pad.axes[1]].map((value) => (Math.abs(value) < REST ? 0 : value));
    if (way.some((value) => value !== 0)) {
      hand.swaying = null;
      takeHold();
      moveHand([...way, 0].map((value) => (value * STICK_SPEED * passed) / 1000));
    }
  }
  if (!hand.holding || now < pulsed + PULSE || !shown[ownHand]) return;
  pulsed = now;
  pulse(pads, Math.min(1, lengthOf(shown[ownHand].force) / STRONG));
}

/** Gives a short pulse. On a gamepad the strength of the pulse follows the force; on a phone, whose motor is on or off, the length does. */
function pulse(pads, strength) {
  if (strength < 0.05 || still.matches) return;
  for (const { vibrationActuator } of pads) {
    if (vibrationActuator && vibrationActuator.playEffect) {
      vibrationActuator.playEffect('dual-rumble', { duration: 2 * PULSE, strongMagnitude: strength, weakMagnitude: strength / 2 }).catch(() => {});
    }
  }
  // Browsers allow vibration only after a tap or a click on the page. The first touch counts when it ends.
  if (hand.touched && navigator.vibrate && navigator.userActivation?.hasBeenActive !== false) navigator.vibrate(Math.round(PULSE * strength));
}
