//! Style sheet of pages, for light and dark, wide and narrow screens, and for paper. The background is the background of pictures.

pub(crate) const STYLE: &str = "\
:root { color-scheme: light dark; --ground: #fff; --ink: #1b1f24; --line: #c3c8ce; --good: #00603f; --partly: #7a4b00; --bad: #9b1c1c; }
@media (prefers-color-scheme: dark) { :root { --ground: #14181d; --ink: #e6e9ec; --line: #454d57; --good: #5fd3a6; --partly: #f0b84a; --bad: #ff8f8f; } }
body { margin: 0; background: var(--ground); color: var(--ink); font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: break-word; }
main { max-width: 64rem; margin: 0 auto; padding: 1rem; }
h1, h2, h3 { line-height: 1.25; overflow-wrap: anywhere; }
a { color: inherit; }
section, figure { margin: 0 0 2rem; padding: 0; border-top: 1px solid var(--line); }
dt { font-weight: 600; }
dd { margin: 0 0 .5rem 1rem; }
b.good { color: var(--good); }
b.partly { color: var(--partly); }
b.bad { color: var(--bad); }
p.warning { color: var(--bad); font-weight: 600; }
.wide { overflow-x: auto; }
.wide svg { max-width: max(100%, 40rem); height: auto; }
.wide svg.gauge { max-width: none; vertical-align: middle; }
table { border-collapse: collapse; margin: 1rem 0; font-size: .9rem; overflow-wrap: normal; }
td b, th b { white-space: nowrap; }
th, td { text-align: left; vertical-align: top; padding: .25rem .75rem .25rem 0; border-bottom: 1px solid var(--line); }
th.number, td.number { text-align: right; font-variant-numeric: tabular-nums; }
tbody th { font-weight: 400; }
caption { text-align: left; font-weight: 600; padding-bottom: .25rem; }
.group { text-align: center; }
.beside { display: grid; gap: 0 2rem; grid-template-columns: repeat(auto-fit, minmax(min(22rem, 100%), 1fr)); }
.beside > div { min-width: 0; }
pre { overflow-x: auto; padding: .5rem; border: 1px solid var(--line); white-space: pre-wrap; overflow-wrap: anywhere; }
@media (max-width: 40rem) { h1 { font-size: 1.4rem; } h2 { font-size: 1.2rem; } }
@media print {
main { max-width: none; padding: 0; }
.wide { overflow: visible; }
.wide svg { max-width: 100%; }
table { font-size: .7rem; }
th, td { padding-right: .4rem; }
tbody th, td { overflow-wrap: anywhere; }
tbody th.number, td.number { overflow-wrap: normal; }
h2, h3 { break-after: avoid; }
figure, tr { break-inside: avoid; }
details::details-content { display: block; content-visibility: visible; block-size: auto; }
}
";
