// ---- Facts in words: validity, lateness, causes.

function showRun(state) {
  put($('kind'), 'cohaptic ' + state.kind);
  put($('title'), state.title);
  document.title = 'cohaptic ' + state.kind + ' · ' + state.title;
  put($('elapsed'), clock(state.elapsed_s));
  put($('valid'), state.valid ? 'valid' : 'not valid: ' + state.invalid);
  $('valid').className = 'pill ' + (state.valid ? 'good' : 'bad');
  $('valid').title = state.valid ? 'so far at most one in a thousand was too late' : state.invalid;
}

function showClocks(clocks) {
  $('late-section').hidden = clocks.length === 0;
  const body = $('clocks');
  while (body.rows.length > clocks.length) body.deleteRow(-1);
  clocks.forEach(({ name, lateness }, i) => {
    let tr = body.rows[i];
    if (!tr) {
      tr = body.insertRow();
      const head = make('th', 'name');
      head.scope = 'row';
      tr.append(head, ...[0, 1, 2, 3, 4].map(() => make('td', 'n')));
    }
    put(tr.cells[0], name);
    [lateness.p50_s, lateness.p99_s, lateness.p999_s, lateness.max_s].forEach((value, k) => put(tr.cells[k + 1], span(value)));
    put(tr.cells[5], count(lateness.count));
  });
}

/** Shows the measures of the run so far. A scene without measures shows none. */
function showMeasures(measures) {
  $('measures-section').hidden = measures.length === 0;
  const body = $('measures');
  while (body.rows.length > measures.length) body.deleteRow(-1);
  measures.forEach(({ name, value, unit, about }, i) => {
    let tr = body.rows[i];
    if (!tr) {
      tr = body.insertRow();
      const head = make('th', 'name');
      head.scope = 'row';
      tr.append(head, make('td', 'n'));
    }
    put(tr.cells[0], name);
    tr.cells[0].title = about;
    put(tr.cells[1], value === null ? 'no value' : Number(value.toPrecision(4)) + ' ' + unit);
  });
}

/** Shows causes with their counts, each with a bar of its share. */
function showCauses(list, causes, none) {
  const entries = Object.entries(causes).filter(([, n]) => n > 0).sort((one, other) => other[1] - one[1]);
  const wanted = entries.length === 0 ? [[none, null]] : entries;
  while (list.children.length > wanted.length) list.lastChild.remove();
  const most = Math.max(1, ...entries.map(([, n]) => n));
  wanted.forEach(([cause, n], i) => {
    let item = list.children[i];
    if (!item) {
      item = make('li');
      item.append(make('span', 'cause'), make('span', 'bar'), make('span', 'n'));
      list.append(item);
    }
    const [word, bar, number] = item.children;
    item.className = n === null ? 'none' : '';
    put(word, cause);
    bar.hidden = n === null;
    bar.style.setProperty('--share', (100 * (n || 0)) / most + '%');
    put(number, n === null ? '' : count(n));
  });
}
