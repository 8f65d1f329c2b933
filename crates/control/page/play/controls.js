// ---- Controls that act during a drag: strategy, number of peers, links.

/** Value to send after the running request. While a slider moves fast, only its last position is sent. */
let waiting = null;
let sending = false;

function say(text, bad) {
  put($('answer'), (bad ? '✗ ' : '✓ ') + text);
  $('answer').className = bad ? 'bad' : 'good';
}

function makeControls() {
  for (const slider of SLIDERS) {
    const row = make('div', 'slider');
    const label = make('label', '', slider.key);
    slider.range = Object.assign(make('input'), { type: 'range', id: 'slider-' + slider.key, min: '0', max: String(slider.values.length - 1) });
    slider.said = make('output', 'n');
    label.htmlFor = slider.range.id;
    slider.said.htmlFor = slider.range.id;
    row.append(label, slider.range, slider.said);
    $('sliders').append(row);
    slider.range.addEventListener('input', () => setLink(slider, slider.text(slider.values[Number(slider.range.value)])));
  }
  for (const radio of document.querySelectorAll('input[name=law]')) radio.addEventListener('change', () => beginAnew({ strategy: radio.value }));
  $('law-other').addEventListener('change', () => $('law-other').value && beginAnew({ strategy: $('law-other').value }));
  $('fewer').addEventListener('click', () => beginAnew({ peers: facts.peers.length - 1 }));
  $('more').addEventListener('click', () => beginAnew({ peers: facts.peers.length + 1 }));
  $('reset').addEventListener('click', () => beginAnew({ reset: true }));
  $('copy').addEventListener('click', () => {
    $('join').select();
    if (navigator.clipboard) navigator.clipboard.writeText($('join').value).catch(() => {});
  });
}

/** Sets a key of every link. */
function setLink(slider, text) {
  put(slider.said, text);
  slider.range.value = String(nearest(slider.values, text === 'unlimited' ? Infinity : measured(text, slider.units) ?? 0));
  slider.range.setAttribute('aria-valuetext', text);
  waiting = { ...waiting, [slider.key]: text };
  if (!sending) sendLinks();
}

const slide = (key, text) => setLink(SLIDERS.find((slider) => slider.key === key), text);

async function sendLinks() {
  sending = true;
  while (waiting) {
    const change = waiting;
    waiting = null;
    const words = Object.entries(change).map(([key, value]) => key + ' ' + value).join(', ');
    try {
      const { links } = await ask('/api/links', { method: 'PATCH', body: JSON.stringify(change) });
      Object.assign(network, links[0].keys);
      say(words + ' on every link', false);
    } catch (error) {
      say(error.message, true);
    }
  }
  sending = false;
}

/** Keys of the first link. */
let network = {};

async function readLinks() {
  const { links } = await ask('/api/links');
  network = links.length > 0 ? links[0].keys : {};
  if (waiting || sending) return;
  for (const slider of SLIDERS) {
    const text = network[slider.key] ?? slider.empty;
    const number = text === 'unlimited' ? Infinity : measured(text, slider.units);
    put(slider.said, text);
    // A law or a table has no place on a slider.
    slider.range.classList.toggle('elsewhere', number === null);
    slider.range.value = String(nearest(slider.values, number ?? 0));
    slider.range.setAttribute('aria-valuetext', text);
  }
}

async function beginAnew(wish) {
  try {
    await ask('/api/play', { method: 'POST', body: JSON.stringify(wish) });
    say(Object.entries(wish).map(([key, value]) => (value === true ? key : key + ': ' + value)).join(', ') || 'a recording begins', false);
  } catch (error) {
    say(error.message, true);
    showFacts();
  }
}

/** Takes up the beginning of another part. */
async function readFacts() {
  facts = await ask('/api/play');
  showFacts();
  showHolding();
  await readLinks();
}

const SHORT = { 'average-position': 'AP', 'proportional-derivative': 'PD' };

function showFacts() {
  const { strategy, strategies, peers, host, join } = facts;
  put($('title'), facts.title || '');
  put($('law-now'), (SHORT[strategy] || strategy) + ', ' + peers.length + ' peers');
  for (const radio of document.querySelectorAll('input[name=law]')) radio.checked = radio.value === strategy;
  const others = strategies.filter((name) => !(name in SHORT));
  if ($('law-other').options.length !== others.length + 1) $('law-other').append(...others.map((name) => new Option(name, name)));
  $('law-other').value = others.includes(strategy) ? strategy : '';
  put($('number'), String(peers.length));
  $('fewer').disabled = !host || peers.length <= facts.fewest_peers;
  $('more').disabled = !host || peers.length >= facts.most_peers;
  for (const node of document.querySelectorAll('#laws input, #laws select, #sliders input, #reset, #compare, #record, #guide button')) node.disabled = !host;
  if (!host) put($('answer'), 'Only whoever started the session can change it.');
  $('guide').hidden = !facts.guided;
  $('invite').hidden = !join;
  if (join) $('join').value = join;
  $('grasp').disabled = $('sway').disabled = ownHand === null;
}

/** Shows the numbers as text, four times a second. */
function showNumbers() {
  if (frame === null) return;
  const body = $('peers');
  while (body.rows.length > frame.peers.length) body.deleteRow(-1);
  frame.peers.forEach((peer, i) => {
    let tr = body.rows[i];
    if (!tr) {
      tr = body.insertRow();
      const name = make('th', 'name');
      name.scope = 'row';
      name.append(make('span', 'swatch'), make('span'));
      tr.append(name, make('td'), make('td', 'n'), make('td', 'n'));
    }
    tr.cells[0].firstChild.style.background = colour(i);
    put(tr.cells[0].lastChild, facts.peers[i] ? facts.peers[i].name : '');
    put(tr.cells[1], { present: 'holds', stale: 'let go', absent: 'nobody', here: 'simulated' }[peer.hand]);
    put(tr.cells[2], place(peer.at));
    put(tr.cells[3], newtons(peer.force.every(Number.isFinite) ? lengthOf(peer.force) : null, 2));
  });
  put($('apart'), place([farthest()]));
}
