// ---- The pages of a person: what the server says is shown, one page after the other.

/** The latest message of the server about the page. */
let now = { page: '' };
/** Pages after which nothing comes: the connection ends. */
const LAST = ['refused', 'thanks', 'abandoned'];

function note(text, bad) {
  put($('note'), text);
  $('note').className = bad ? 'bad' : '';
}

/** Says something to the server, whose answer is the next page. */
async function say(words) {
  for (const button of document.querySelectorAll('#buttons button')) button.disabled = true;
  try {
    await ask('/api/person', { method: 'POST', body: JSON.stringify(words) });
  } catch (error) {
    note(error.message, true);
    for (const button of document.querySelectorAll('#buttons button')) button.disabled = false;
  }
}

function button(text, className, act) {
  const node = make('button', className, text);
  node.type = 'button';
  node.addEventListener('click', act);
  return node;
}

const trialName = ({ number, of, practice }) => 'Trial ' + number + ' of ' + of + (practice ? ', for practice' : '');

/** Content of each page: heading, text and buttons. `read`: the heading has the focus at first. */
const PAGES = {
  code: () => ({ title: 'Your code', content: [make('p', 'code', now.code), make('p', '', 'The code stands for you in all that is kept. No name is kept. Note the code: with it you can ask to have all of yours removed, also later.')], buttons: [button('Begin', '', () => say({ do: 'begin' }))] }),
  consent: () => ({ title: 'Consent', content: blocks(now.text), buttons: [button('I agree', '', () => say({ do: 'consent' })), button('I do not agree', 'plain', () => say({ do: 'refuse' }))], read: true }),
  refused: () => ({ title: 'You do not take part', content: [make('p', '', 'Nothing was kept. You can close this page. Thank you for your time.')] }),
  instructions: () => ({ title: 'What to do', content: blocks(now.text), buttons: [button('Go on', '', () => say({ do: 'go on' }))], read: true }),
  wait: () => ({ title: 'One moment', content: [make('p', '', now.words)] }),
  ready: () => ({ title: trialName(now.trial), content: [make('p', '', 'The trial begins when everybody is ready. Then the object appears, and the arrow keys, a mouse or a finger move it.')], buttons: [button('I am ready', '', () => say({ do: 'ready' }))] }),
  questions: () => ({ title: 'Questions', content: [make('p', '', 'The questions are ' + now.about + '.')], buttons: [button('Send the answers', '', () => { const answers = answersOfAll(); if (answers) say({ do: 'answer', answers }); })], read: true }),
  break: () => ({ title: 'A break', content: [make('p', '', 'Rest your hand and your eyes.')], buttons: now.may_end ? [button('Go on', '', () => say({ do: 'ready' }))] : [] }),
  thanks: () => ({ title: 'Thank you', content: [make('p', '', 'That was all. Your code is ' + now.code + '. You can close this page.')] }),
  abandoned: () => ({ title: 'The study ends here', content: [make('p', '', 'The experimenter has ended it for this group. You can close this page. Thank you for your time.')] }),
};

/** Takes what the server says of this person's page. */
function onNews(news) {
  const before = now;
  now = news;
  put($('title'), now.title);
  put($('code'), now.code);
  $('code').hidden = false;
  if (now.facts) {
    facts = now.facts;
    // The number of the own peer in the scene, which is drawn; the server knows the hand by the token.
    ownHand = facts.hand;
  }
  const inTrial = now.page === 'trial';
  $('trial').hidden = !inTrial;
  $('words').hidden = inTrial;
  if (inTrial) {
    put($('trial-title'), trialName(now.trial));
    if (before.page !== 'trial') {
      // The object of the trial before is not where this one begins.
      frame = null;
      shown = [];
      $('rooms').focus();
    }
  } else {
    if (before.page === 'trial') letGo();
    showWords(before);
  }
  if (LAST.includes(now.page)) disconnect();
}

function showWords(before) {
  const { title, content, buttons = [], read } = PAGES[now.page]();
  // Given answers stay when the same page is told again, such as after a lost connection.
  if (JSON.stringify({ ...before, left_s: 0 }) === JSON.stringify({ ...now, left_s: 0 })) {
    // A button that was pressed before the connection was lost may have had no effect.
    for (const button of document.querySelectorAll('#buttons button')) button.disabled = false;
    return;
  }
  put($('words-title'), title);
  $('words-text').replaceChildren(...content);
  const isAsking = now.page === 'questions';
  $('questions').hidden = !isAsking;
  if (isAsking) askAll(now.questions);
  else $('questions').replaceChildren();
  $('left').hidden = now.page !== 'break' || now.may_end;
  breakEnd = performance.now() + 1000 * (now.left_s || 0);
  showLeft();
  $('buttons').replaceChildren(...buttons);
  note(now.note || '', false);
  // A page to be read begins at its heading, and any other at what is pressed next.
  if (read || buttons.length === 0) $('words-title').focus();
  else buttons[0].focus();
  scrollTo(0, 0);
}

/** Instant at which the break may end, by the clock of this page [ms]. */
let breakEnd = 0;
function showLeft() {
  if (!$('left').hidden) put($('left'), clock(Math.ceil(Math.max(0, breakEnd - performance.now()) / 1000)) + ' left');
}

// ---- The connection.

let refused = null;
function onTrouble(text, looksOn) {
  if (LAST.includes(now.page)) return;
  // Another window has the address. The server frees the seat when that window is closed.
  refused = looksOn && text ? text : refused;
  if (looksOn && text) setTimeout(() => socket.close(), 1000);
  else if (text === null) refused = null;
  const said = refused === null ? text : 'Another window has this address open: close one of the two.';
  put($('trouble'), said || '');
  $('trouble').hidden = !said;
  put($('server'), said ? 'disconnected' : 'connected');
  $('server').className = 'pill ' + (said ? 'bad' : 'good');
  if (said === null) tellSeen();
  else ask('/join').catch((error) => {
    if (!error.message.startsWith('no token')) return;
    put($('trouble'), 'This address is not valid any more: ask the experimenter for another one.');
  });
}

/** Says whether anybody can see this page: a trial with a hidden page does not count. */
function tellSeen() {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(document.hidden ? 'hidden' : 'seen');
}

/** Instant of the latest message to the server, by the clock of this page [ms]. A hand that holds tells its place with each picture. */
let heard = 0;
const STILL_HERE = 100;

readInk();
makeHand();
makeKeyboard();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', readInk);
document.addEventListener('visibilitychange', tellSeen);
setInterval(showTask, 250);
setInterval(showLeft, 250);
// Enter in a field must not load the page anew.
$('questions').addEventListener('submit', (event) => event.preventDefault());
let shownAt = performance.now();
requestAnimationFrame(function next(at) {
  const passed = Math.min(100, Math.max(0, at - shownAt));
  shownAt = at;
  if (now.page === 'trial') {
    stepKeyboard(passed);
    stepGamepad(passed, at);
    stepHand(at);
    drawAll(passed, at);
    if (hand.holding) heard = at;
    else if (at > heard + STILL_HERE && socket && socket.readyState === WebSocket.OPEN) {
      heard = at;
      socket.send('here');
    }
  }
  requestAnimationFrame(next);
});
connect(takeFrame, onTrouble, onNews);
