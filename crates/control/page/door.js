// The page has stored its token in the tab before removing the token from the address. A token that was just refused is not tried again.
const kept = sessionStorage.getItem('token');
// The token opens the requested page. An address with a ticket opens `/`, because a ticket is valid once.
const page = location.pathname === '/open' ? '/' : location.pathname;
document.querySelector('form').action = page;
if (kept && !new URLSearchParams(location.search).has('token')) {
  sessionStorage.removeItem('token');
  location.replace(page + '?token=' + encodeURIComponent(kept));
} else if (page === '/join') {
  // Guests and people of a study were given an address, and nobody printed a token for them.
  document.querySelector('form').remove();
  document.querySelector('p').textContent = 'This address is not valid any more. Ask the person who gave it to you for another one.';
}
