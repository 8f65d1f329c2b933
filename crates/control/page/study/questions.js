// ---- Questions: scales and choices, by pointer or by keyboard.

/** The questions on the page, each with its number in the study, its fields, and its answer: a list of numbers with null for what is not answered yet. */
let asked = [];

function askAll(questions) {
  asked = questions.map((question) => (question.scales ? makeScales(question) : makeChoice(question)));
  $('questions').replaceChildren(...asked.map(({ fields }) => fields));
}

function ends(low, high) {
  const node = make('div', 'ends');
  node.setAttribute('aria-hidden', 'true');
  node.append(make('span', '', low), make('span', '', high));
  return node;
}

/** Scales from 0 to 100 by 5, as those of the NASA task load index. */
function makeScales({ question, scales }) {
  const fields = make('fieldset');
  fields.append(make('legend', '', 'How was the task?'));
  const answer = scales.map(() => null);
  const rows = scales.map(({ text, ends: [low, high] }, i) => {
    const row = make('div', 'scale');
    const range = Object.assign(make('input'), { type: 'range', id: 'scale-' + question + '-' + i, min: '0', max: '100', step: '5', value: '50' });
    const said = make('output', '', 'not answered');
    const label = make('label');
    label.htmlFor = range.id;
    said.htmlFor = range.id;
    label.append(make('span', '', text), said);
    range.setAttribute('aria-valuetext', 'not answered, from ' + low + ' to ' + high);
    // A range always has a value. The middle is an answer once somebody has touched the range, or pressed Space or Enter on it.
    const take = () => {
      answer[i] = Number(range.value);
      put(said, range.value);
      range.setAttribute('aria-valuetext', range.value + ' of 100, from ' + low + ' to ' + high);
      row.classList.remove('missing');
    };
    range.addEventListener('input', take);
    range.addEventListener('pointerup', take);
    range.addEventListener('keydown', (event) => {
      if (event.key !== ' ' && event.key !== 'Enter') return;
      event.preventDefault();
      take();
    });
    row.append(label, range, ends(low, high));
    return { row, range, text };
  });
  fields.append(...rows.map(({ row }) => row));
  const missing = () => rows.filter((_, i) => answer[i] === null).map(({ row, range, text }) => ({ row, field: range, name: text }));
  return { question, fields, answer, missing };
}

/** Makes a choice of equal steps, with words at both ends. */
function makeChoice({ question, text, ends: [low, high], steps }) {
  const fields = make('fieldset');
  const row = make('div');
  const choices = make('div', 'choices');
  const answer = [null];
  const radios = Array.from({ length: steps }, (_, i) => {
    const radio = Object.assign(make('input'), { type: 'radio', name: 'choice-' + question, value: String(i + 1) });
    const end = i === 0 ? ', ' + low : i === steps - 1 ? ', ' + high : '';
    radio.setAttribute('aria-label', (i + 1) + ' of ' + steps + end);
    radio.addEventListener('change', () => {
      answer[0] = i + 1;
      row.classList.remove('missing');
    });
    const label = make('label');
    label.append(radio, make('span', '', String(i + 1)));
    choices.append(label);
    return radio;
  });
  row.append(choices, ends(low, high));
  fields.append(make('legend', '', text), row);
  return { question, fields, answer, missing: () => (answer[0] === null ? [{ row, field: radios[0], name: text }] : []) };
}

/** The answers, or null if some are missing: then the first of those has the focus, and the note says so. */
function answersOfAll() {
  const missing = asked.flatMap((one) => one.missing());
  for (const { row } of missing) row.classList.add('missing');
  if (missing.length === 0) return asked.map(({ question, answer }) => ({ question, answer }));
  note('Please answer this too: ' + missing[0].name, true);
  missing[0].field.focus();
  return null;
}
