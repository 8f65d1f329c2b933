// The page left its token in the tab before it took it out of the address. A token that was just refused is not tried again.
const kept = sessionStorage.getItem('token');
if (kept && !new URLSearchParams(location.search).has('token')) {
  sessionStorage.removeItem('token');
  location.replace('/?token=' + encodeURIComponent(kept));
}
