// ---- Numbers as text, and text as numbers.

const $ = (id) => document.getElementById(id);

/** Writes a text into an element, unless the element has this text already. So a page with a hundred links changes few elements. */
function put(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Makes an element. */
function make(tag, className, text) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

function significant(number, digits) {
  if (number === 0) return '0';
  const before = Math.max(0, Math.floor(Math.log10(Math.abs(number))) + 1);
  return number.toFixed(Math.max(0, digits - before));
}

function inUnits(number, units, digits = 3) {
  if (number === null || number === undefined || Number.isNaN(number)) return '–';
  const size = Math.abs(number);
  const [factor, unit] = units.find(([from]) => size >= from) || units[units.length - 1];
  return significant(number / factor, digits) + ' ' + unit;
}

const span = (s, digits) => (s === 0 ? '0 ms' : inUnits(s, [[1, 's'], [1e-3, 'ms'], [1e-6, 'µs'], [1e-9, 'ns']], digits));
const bits = (rate, digits) => inUnits(rate, [[1e9, 'Gbit/s'], [1e6, 'Mbit/s'], [1e3, 'kbit/s'], [1, 'bit/s']], digits);
const signed = (text) => text.replace('-', '\u2212');
/** Returns a number as text: with decimals below a million, otherwise with a power of ten, because diverging scenes have numbers of any size. */
const decimals = (number, digits) => signed(Math.abs(number) < 1e6 ? number.toFixed(digits) : number.toExponential(3));
const place = (position) => {
  const large = position.some((m) => Math.abs(m) >= 1);
  return position.map((m) => (m === null ? '–' : large ? decimals(m, 3) : decimals(m * 1e3, 2))).join(', ') + (large ? ' m' : ' mm');
};
const newtons = (force, digits) => (Number.isFinite(force) ? decimals(force, digits) : '–') + ' N';
const percent = (p) => (p === null || p === undefined || Number.isNaN(p) ? '–' : significant(p * 100, p !== 0 && p < 0.1 ? 2 : 3) + ' %');
const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, '\u202f');

/** Returns minutes and seconds of a run as text. */
function clock(s) {
  const whole = Math.floor(s);
  const two = (n) => String(n).padStart(2, '0');
  const hours = Math.floor(whole / 3600);
  return (hours ? hours + ':' + two(Math.floor(whole / 60) % 60) : Math.floor(whole / 60)) + ':' + two(whole % 60);
}

/** Returns the number of a text such as "40ms" or "1%", in the base unit; null for anything else, such as a table. */
function measured(text, units) {
  const match = /^\s*([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)\s*([a-zµ%/]*)\s*$/i.exec(text);
  if (!match || !(match[2] in units)) return null;
  const number = Number(match[1]) * units[match[2]];
  return Number.isFinite(number) ? number : null;
}

/** Colours of the drawings, from the style of the page. Read again when the system changes between light and dark. */
let ink = {};
function readInk() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  ink = { text: of('--ink'), accent: of('--accent'), bad: of('--bad'), soft: of('--soft'), line: of('--line'), faint: of('--faint'), ground: of('--card'), series: [] };
  for (let i = 0; i < 8; i += 1) ink.series.push(of('--c' + i));
}
const colour = (i) => ink.series[i % ink.series.length];
/** Colours of links. Many links are told apart by choosing one of them, not by colour. */
const COLOURED = 8;
const linkColour = (i, links) => (links > COLOURED ? ink.accent : colour(i));
