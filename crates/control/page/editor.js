// ---- Changes.

const OTHER_KEYS = ['order', 'mark-instead-of-loss', 'duplicate', 'corrupt', 'reorder', 'queue', 'overhead', 'cells', 'token-bucket', 'slots', 'mtu', 'limit', 'outage', 'trace', 'modulated', 'replay', 'netem', 'netem-profile'];

function makeSliders() {
  for (const slider of SLIDERS) {
    const row = make('div', 'slider');
    const label = make('label', '', slider.key);
    slider.range = make('input');
    slider.range.type = 'range';
    slider.range.id = 'slider-' + slider.key;
    slider.range.min = '0';
    slider.range.max = String(slider.values.length - 1);
    label.htmlFor = slider.range.id;
    slider.field = make('input');
    slider.field.type = 'text';
    slider.field.id = 'field-' + slider.key;
    slider.field.spellcheck = false;
    slider.field.autocomplete = 'off';
    slider.field.setAttribute('aria-label', slider.key + ' as text; Enter sets it');
    row.append(label, slider.range, slider.field);
    $('sliders').append(row);
    slider.range.addEventListener('input', () => {
      slider.typing = false;
      slider.field.value = slider.text(slider.values[Number(slider.range.value)]);
      slider.range.setAttribute('aria-valuetext', slider.field.value);
      submit({ [slider.key]: slider.field.value });
    });
    // A text that the user has begun is not overwritten until the user sets it or gives it up.
    slider.field.addEventListener('input', () => { slider.typing = true; });
    slider.field.addEventListener('keydown', (event) => {
      if (event.key === 'Enter' && slider.field.value.trim() !== '') {
        slider.typing = false;
        submit({ [slider.key]: slider.field.value.trim() });
      } else if (event.key === 'Escape') {
        slider.typing = false;
        showKeys();
      }
    });
  }
  $('known-keys').append(...OTHER_KEYS.map((key) => Object.assign(make('option'), { value: key })));
  $('all').addEventListener('change', showTarget);
  $('other').addEventListener('submit', (event) => {
    event.preventDefault();
    const key = $('other-key').value.trim();
    if (key === '') $('other-key').focus();
    else submit({ [key]: $('other-value').value.trim() });
  });
  $('other-key').addEventListener('change', () => {
    const now = (keys[chosen] || {})[$('other-key').value.trim()];
    if (now !== undefined && $('other-value').value === '') $('other-value').value = now;
  });
}

function showTarget() {
  const row = rows[chosen];
  const name = row ? row.tr.querySelector('label').textContent : 'a link';
  put($('target'), $('all').checked && rows.length > 1 ? 'all ' + rows.length + ' links' : name);
  put($('drops-link'), name);
}

/** Sets sliders and texts to the values of the chosen link, apart from those that the user is changing now. */
function showKeys() {
  const now = keys[chosen];
  if (!now) return;
  for (const slider of SLIDERS) {
    const text = now[slider.key] ?? slider.empty;
    const number = text === 'unlimited' ? Infinity : measured(text, slider.units);
    if (!slider.typing && !waiting && !sending) {
      slider.field.value = text;
      // A law or a table has no place on a slider.
      slider.range.classList.toggle('elsewhere', number === null);
      slider.range.value = String(nearest(slider.values, number ?? 0));
      slider.range.setAttribute('aria-valuetext', text);
    }
  }
  const others = Object.entries(now).filter(([key]) => !SLIDERS.some((slider) => slider.key === key));
  const list = others.map(([key, value]) => {
    const button = make('button', 'key', key + ' = ' + value);
    button.type = 'button';
    button.title = 'change it';
    button.addEventListener('click', () => {
      $('other-key').value = key;
      $('other-value').value = value;
      $('other-value').focus();
    });
    return button;
  });
  const box = $('keys-now');
  if (box.textContent !== list.map((node) => node.textContent).join('')) box.replaceChildren(...list);
}

/** Value to send after the running request. While a slider moves fast, only its last position is sent. */
let waiting = null;
let sending = false;

function submit(change) {
  const path = $('all').checked ? '/api/links' : '/api/links/' + chosen;
  if (waiting && waiting.path === path) Object.assign(waiting.change, change);
  else waiting = { path, change: { ...change } };
  if (!sending) send();
}

async function send() {
  sending = true;
  while (waiting) {
    const { path, change } = waiting;
    waiting = null;
    const words = Object.entries(change).map(([key, value]) => key + ' = ' + value).join(', ');
    try {
      const body = await ask(path, { method: 'PATCH', body: JSON.stringify(change) });
      if (!waiting) sending = false;
      takeKeys(body.links || [body]);
      say(words + (body.links ? ' on all links' : ''), false);
    } catch (error) {
      if (!waiting) sending = false;
      // A refused text stays, so that the user can correct it. Escape discards the text.
      for (const slider of SLIDERS) if (slider.key in change) slider.typing = true;
      say(error.message, true);
    }
  }
  sending = false;
}

function say(text, bad) {
  put($('answer'), (bad ? '✗ ' : '✓ ') + text);
  $('answer').className = bad ? 'bad' : 'good';
}
