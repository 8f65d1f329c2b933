// ---- The page of the experimenter: who is there, where the group is, and what comes next.

const EVERY = 500;
/** The button that has to be pressed once more, and its text before. */
let sure = null;

function tell(text, bad) {
  put($('answer'), text);
  $('answer').className = bad ? 'bad' : 'good';
}

/** `expects` is what the button said: a second press must not do what comes after that. */
async function command(what, expects) {
  try {
    show(await ask('/api/study', { method: 'POST', body: JSON.stringify({ do: what, expects }) }));
    tell('✓ ' + what, false);
  } catch (error) {
    tell('✗ ' + error.message, true);
  }
}

/** Gives a button a command that cannot be taken back: the first press only asks, and the second press commands. */
function twice(button, what, question) {
  button.addEventListener('click', () => {
    if (sure && sure.button === button) {
      calm();
      command(what);
    } else {
      calm();
      sure = { button, text: button.textContent };
      put(button, question);
      tell('Press once more to do it, or Escape.', false);
    }
  });
  button.addEventListener('blur', calm);
}

function calm() {
  if (sure) put(sure.button, sure.text);
  sure = null;
}

const PAGE_NAMES = { code: 'code', consent: 'consent', instructions: 'instructions', ready: 'to press “ready”', trial: 'trial', questions: 'questions', break: 'break', wait: 'waits', thanks: 'done', abandoned: 'ended' };

function show(study) {
  put($('title'), study.title);
  put($('group'), study.group || 'no group');
  put($('where'), study.where);
  put($('condition'), study.condition || '');
  put($('last'), study.last || 'There was none.');
  $('last').className = study.last_valid === false ? 'late' : '';
  $('next').disabled = !study.may.next;
  $('repeat').disabled = !study.may.repeat;
  $('abandon').disabled = !study.may.abandon;
  put($('next'), study.next || 'Next');
  const rows = study.people.map(({ code, page, connected, hidden, round_trip_s: trip }) => {
    const tr = make('tr');
    const name = make('th', 'name', code);
    name.scope = 'row';
    const state = connected ? (hidden ? 'page hidden' : 'connected') : 'not connected';
    const cell = make('td');
    // A person on the last page may leave, so that a lost connection is no fault there.
    const missed = page === 'thanks' || page === 'abandoned' ? '' : 'bad';
    cell.append(make('span', 'pill ' + (connected && !hidden ? 'good' : missed), state));
    tr.append(name, make('td', '', PAGE_NAMES[page] || page), cell, make('td', 'n', trip === null || !connected ? '–' : span(trip, 2)));
    return tr;
  });
  replaceIfChanged($('people'), rows);
  replaceIfChanged($('addresses'), study.people.map(({ code, address }) => {
    const li = make('li');
    li.append(make('strong', '', code), make('code', '', address));
    return li;
  }));
}

/** Elements are replaced only by others, so that a selection stays. */
function replaceIfChanged(node, children) {
  const text = children.map((child) => child.outerHTML).join('');
  if (node.innerHTML !== text) node.replaceChildren(...children);
}

async function look() {
  try {
    show(await ask('/api/study'));
    $('trouble').hidden = true;
    put($('server'), 'connected');
    $('server').className = 'pill good';
  } catch (error) {
    put($('trouble'), error.message.startsWith('no token') ? 'The server has another token now: open the address that it printed.' : 'The study does not answer. Start the same command again: it goes on where it was.');
    $('trouble').hidden = false;
    put($('server'), 'disconnected');
    $('server').className = 'pill bad';
  }
  setTimeout(look, EVERY);
}

$('next').addEventListener('click', () => command('next', $('next').textContent));
twice($('repeat'), 'repeat', 'Really repeat it?');
twice($('abandon'), 'abandon', 'Really abandon the group?');
addEventListener('keydown', (event) => {
  if (event.key === 'Escape') calm();
});
look();
