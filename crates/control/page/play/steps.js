// ---- The first minute: three sentences, each with something to do.

const delayNow = () => measured(network.delay ?? '0ms', SPANS) ?? 0;
/** How far the own hand has moved since the step began [m]. */
let moved = 0;
let lastPlace = null;

const STEPS = [
  {
    text: 'Every peer has a copy of the cube of its own. Drag yours to and fro: the others follow late, because the network takes a while.',
    done: () => moved > 0.15,
  },
  {
    text: 'Raise the delay to 100 ms, drag, and let go (Escape): under AP the cube is heavier in the hand, and comes to rest.',
    button: 'Delay 100 ms',
    act: () => slide('delay', '100ms'),
    done: () => delayNow() >= 100 && facts.strategy === 'average-position' && moved > 0.15 && !hand.holding,
  },
  {
    text: 'Now PD, with the same springs and the same network: drag, and let go. The copies swing up by themselves.',
    button: 'Now PD',
    act: () => beginAnew({ strategy: 'proportional-derivative' }),
    done: () => facts.strategy === 'proportional-derivative' && delayNow() >= 100 && moved > 0.1 && !hand.holding && farthestOut() > 0.05,
  },
];
const WHY = 'Why: under PD each of the other copies pulls at yours with a whole spring; under AP they share one. A spring that pulls to where a copy was 100 ms ago pushes a swing on, the more the stiffer it is. So PD swings up, and AP only brakes. Compare below runs your own motion under both.';
let step = 0;

function makeSteps() {
  for (const { text, button, act } of STEPS) {
    const item = make('li');
    item.append(make('p', '', text));
    if (button) {
      const node = make('button', '', button);
      node.type = 'button';
      node.addEventListener('click', act);
      item.append(node);
    }
    $('steps').append(item);
  }
  put($('why'), WHY);
  showSteps();
}

function showSteps() {
  [...$('steps').children].forEach((item, i) => {
    item.className = i < step ? 'done' : i === step ? 'now' : '';
    if (i === step) item.setAttribute('aria-current', 'step');
    else item.removeAttribute('aria-current');
  });
  $('why').hidden = step < STEPS.length;
}

/** Once a picture: how far the hand has moved, and whether that was the step. */
function watchSteps() {
  if (step >= STEPS.length) return;
  if (hand.holding) {
    if (lastPlace) moved += lengthOf(add3(hand.at, lastPlace, -1));
    lastPlace = [...hand.at];
  } else lastPlace = null;
  if (STEPS[step].done()) {
    step += 1;
    moved = 0;
    showSteps();
  }
}
