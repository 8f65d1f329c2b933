// ---- The table of links.

let rows = [];
let chosen = 0;
/** Configured keys of each link, in the order of the links. */
let keys = [];

/** Makes new rows if the links have changed. */
function makeRows(links) {
  if (rows.length === links.length && rows.every((row, i) => row.name === links[i].name)) return;
  chosen = Math.min(chosen, Math.max(0, links.length - 1));
  rows = links.map((link, i) => {
    const tr = make('tr');
    const pick = make('input');
    pick.type = 'radio';
    pick.name = 'link';
    pick.id = 'link-' + i;
    pick.checked = i === chosen;
    pick.addEventListener('change', () => choose(i));
    const swatch = make('span', 'swatch');
    const first = make('td', 'pick');
    first.append(pick, swatch);
    const name = make('th', 'name');
    name.scope = 'row';
    const label = make('label', '', link.from + ' → ' + link.to);
    label.htmlFor = pick.id;
    label.title = link.name;
    name.append(label);
    tr.append(first, name);
    const cells = ['delay', 'loss', 'rate', 'offered', 'delivered', 'dropped', 'inside'].map((what) => make('td', 'n ' + what));
    const asked = make('td', 'asked');
    tr.append(...cells, asked);
    tr.addEventListener('click', () => {
      pick.checked = true;
      if (chosen !== i) choose(i);
    });
    return { name: link.name, words: (link.name + ' ' + label.textContent).toLowerCase(), tr, pick, swatch, cells, asked };
  });
  $('links').replaceChildren(...rows.map((row) => row.tr));
  $('filter-label').hidden = rows.length <= 8;
  $('all-label').hidden = rows.length < 2;
  put($('link-count'), rows.length > 1 ? String(rows.length) : '');
  filterRows();
  choose(chosen);
}

/** Applies the colours after the page has become light or dark. */
function recolourRows() {
  rows.forEach((row, i) => {
    row.swatch.style.background = rows.length <= COLOURED || i === chosen ? linkColour(i, rows.length) : '';
  });
}

function filterRows() {
  const words = $('filter').value.trim().toLowerCase();
  for (const row of rows) row.tr.hidden = rows.length > 8 && words !== '' && !row.words.includes(words);
}

/** Chooses a link: its line is drawn thick, and the editor changes it. */
function choose(link) {
  // A text that the user has begun was meant for the previously chosen link.
  if (chosen !== link) for (const slider of SLIDERS) slider.typing = false;
  chosen = link;
  rows.forEach((row, i) => row.tr.classList.toggle('chosen', i === link));
  recolourRows();
  showTarget();
  showKeys();
  redraw();
}

function showRows(links) {
  const last = past[past.length - 1];
  links.forEach((link, i) => {
    const { cells, tr } = rows[i];
    if (tr.hidden) return;
    put(cells[0], span(last.delay[i]));
    put(cells[1], percent(last.loss[i]));
    put(cells[2], bits(last.rate[i]));
    put(cells[3], count(link.offered));
    put(cells[4], count(link.delivered));
    put(cells[5], count(link.dropped_in_all));
    put(cells[6], count(link.in_flight));
    cells[1].classList.toggle('bad', last.loss[i] > 0.1);
  });
  if (links.length > 0) {
    put($('delay-now'), span(last.delay[chosen]));
    put($('loss-now'), percent(last.loss[chosen]));
    put($('rate-now'), bits(last.rate[chosen]));
  }
}

/** Asks the server for the keys of the links, because others can change the links too. */
async function readKeys() {
  const { links } = await ask('/api/links');
  takeKeys(links);
}

function takeKeys(links) {
  for (const link of links) keys[link.link] = link.keys;
  rows.forEach((row, i) => {
    put(row.asked, Object.entries(keys[i] || {}).map(([key, value]) => key + ' ' + value).join(' · ') || 'ideal');
    row.asked.title = row.asked.textContent;
  });
  showKeys();
}
