// ---- The first minute: three steps, each with a sentence and an action.

const delayNow = () => measured(network.delay ?? '0ms', SPANS) ?? 0;
/** Distance that the own hand has moved since the beginning of the step [m]. */
let moved = 0;
let lastPlace = null;

/** Time since the hand has let go [ms]. A step ends only after the visitor has seen the effect. */
const idle = (now) => (hand.holding ? 0 : now - (hand.released ?? now));

const isUnder = (strategy) => facts.strategy === strategy && delayNow() >= 100;
const under = (strategy) => { if (facts.strategy !== strategy) beginAnew({ strategy }); };

const STEPS = [
  {
    text: 'Every peer has a copy of the cube of its own. Drag yours, the large one, to and fro: the others follow late, because the network takes a while.',
    done: () => moved > 0.15,
  },
  {
    text: 'Raise the delay to 100 ms, drag, and let go: under AP the cube is heavier in the hand, and comes to rest.',
    button: 'Delay 100 ms',
    act: () => {
      slide('delay', '100ms');
      under('average-position');
    },
    done: (now) => isUnder('average-position') && moved > 0.15 && idle(now) > 2500,
  },
  {
    text: 'Now PD, with the same springs and the same network: drag, and let go. The copies swing up by themselves.',
    button: 'Now PD',
    act: () => {
      if (delayNow() < 100) slide('delay', '100ms');
      under('proportional-derivative');
    },
    done: (now) => isUnder('proportional-derivative') && moved > 0.1 && idle(now) > 1500 && farthestOut() > 0.05,
  },
];
const WHY = 'Why: each copy is pulled to where the others were 100 ms ago. A pull that comes so late does not brake a swing but pushes it on, the more the stiffer it is. Under PD each of the other copies pulls with a whole spring; under AP they share one, and the damping wins. Compare, below, runs your own motion under both.';
let step = 0;

function makeSteps() {
  for (const { text, button, act } of STEPS) {
    const item = make('li');
    // A narrow screen shows one step alone. Without its number a screen reader would count this step as the first.
    item.value = $('steps').children.length + 1;
    item.append(make('p', '', text));
    if (button) {
      const node = make('button', '', button);
      node.type = 'button';
      node.addEventListener('click', act);
      item.append(node);
    }
    $('steps').append(item);
  }
  $('back').addEventListener('click', () => under('average-position'));
  showSteps();
}

function showSteps() {
  [...$('steps').children].forEach((item, i) => {
    item.className = i < step ? 'done' : i === step ? 'now' : '';
    if (i === step) item.setAttribute('aria-current', 'step');
    else item.removeAttribute('aria-current');
  });
  const all = step === STEPS.length;
  $('answered').hidden = !all;
  put($('why'), all ? WHY : '');
}

/** Measures the motion of the hand and ends a finished step. Called once per picture. */
function watchSteps(now) {
  if (step >= STEPS.length || !facts.guided) return;
  if (hand.holding) {
    if (lastPlace) moved += lengthOf(add3(hand.at, lastPlace, -1));
    lastPlace = [...hand.at];
  } else lastPlace = null;
  if (STEPS[step].done(now)) {
    step += 1;
    moved = 0;
    showSteps();
  }
}
