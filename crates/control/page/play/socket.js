// ---- The WebSocket: the places of the hand go out, pictures of the motion come in.

/** A connection that says nothing for so long is dead [ms]. */
const DEAD = 4000;
const AGAIN = 1000;

/** The hand that this page has; null if it only looks on. */
let ownHand = null;
let socket = null;

/** Ends the connection for good. */
let disconnect = () => {};

/** Connects for ever. `onFrame` gets each picture, `onNews` what a study says, `onTrouble` a text when the connection is lost, and null when it is back. */
function connect(onFrame, onTrouble, onNews) {
  let ended = false;
  disconnect = () => {
    ended = true;
    socket.close();
  };
  let wanted = new URLSearchParams(location.search).get('hand');
  const open = () => {
    const query = new URLSearchParams({ token });
    if (wanted !== null) query.set('hand', wanted);
    const own = (socket = new WebSocket('ws://' + location.host + '/api/hand?' + query));
    let timer;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(() => own.close(), DEAD);
    };
    alive();
    own.onmessage = ({ data }) => {
      alive();
      const said = JSON.parse(data);
      if ('hand' in said) {
        ownHand = said.hand;
        // Of a connection that was lost the server may not know yet: then any hand will do.
        wanted = said.hand === null ? null : String(said.hand);
        onTrouble(said.refused ? 'You look on: ' + said.refused : null, said.hand === null);
      } else if (said.page) onNews(said);
      else if (said.peers) onFrame(said);
    };
    own.onclose = () => {
      clearTimeout(timer);
      if (ended) return;
      letGo();
      onTrouble('The server does not answer. What is shown is old. Trying again …', false);
      setTimeout(open, AGAIN);
    };
  };
  open();
}

/** Says where the hand is; null: it lets go. */
function tellHand(place) {
  if (socket && socket.readyState === WebSocket.OPEN && ownHand !== null) socket.send(JSON.stringify(place));
}
