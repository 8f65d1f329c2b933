// ---- The server: the token, and requests.

/** The token comes in the address and leaves it at once: it stays in this tab, and travels in headers. */
const token = (() => {
  const query = new URLSearchParams(location.search);
  const given = query.get('token');
  if (given) {
    sessionStorage.setItem('token', given);
    query.delete('token');
    history.replaceState(null, '', location.pathname + (query.size > 0 ? '?' + query : ''));
  }
  return given || sessionStorage.getItem('token') || '';
})();

/** Asks and gives back the JSON of the answer; throws an Error whose message is for the user. */
async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(path, { ...options, cache: 'no-store', headers: { Authorization: 'Bearer ' + token } });
  } catch {
    throw new Error('the server does not answer');
  }
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.error || 'the server says ' + response.status);
  return body;
}
