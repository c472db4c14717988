// Errors by positions: how much of each error's information goes with each position.
import { $, ask, button, make, micro, page } from "./page.js";

const UNITS = { m: "µm", rad: "µrad", 1: "ppm" };
const percent = (part) => `${Number((100 * part).toPrecision(part < 0.01 ? 1 : 2))}`;
const known = (value, words) => (value === null ? "–" : words(value));
const hint = (...words) => make("p", { class: "hint" }, ...words);
const row = (attributes, label, unit, cells) => make("tr", attributes,
  make("th", { scope: "row" }, label), make("td", {}, unit), cells);

function head({ positions, average }, onChoose) {
  const name = (one) => make("th", { scope: "col" },
    button(`${one.is_added ? "+ " : ""}${one.name}`, () => onChoose(one),
      { class: "link", "aria-label": `choose ${one.name}` }));
  const figures = (label, all, words) =>
    row({}, label, all, positions.map((one) => make("td", {}, words(one))));
  return make("thead", {}, make("tr", {}, ["error", "u"].map((words) =>
    make("th", { scope: "col" }, words)), positions.map(name)),
  figures("readings", "", ({ readings }) => readings),
  positions.some(({ minutes }) => minutes !== null)
    && figures("minutes", "", ({ minutes }) => known(minutes, Math.round)),
  figures("U6 without, µm", known(average, micro), (one) => known(one.average, micro)));
}

// A row that is pointed at or focused is given to `onHover`, with the index of the direction that
// hides it, or null; where several do, its name leads to the next.
function errorRow(error, parts, isLost, directions, onHover) {
  const { name, hidden_by: hidden, standard_uncertainty: u, unit } = error;
  const reasons = hidden.map((k) => directions[k]).join("; ");
  let k = 0;
  const point = () => onHover(error, hidden[k] ?? null);
  const turn = () => {
    k = (k + 1) % hidden.length;
    point();
  };
  const label = !hidden.length ? make("span", { title: error.meaning }, name)
    : button(name, turn, { class: "link", title: reasons, "data-focus": `error ${name}`,
      "aria-label": `${name}: ${reasons}`, onfocus: point });
  const cells = parts.map((part, position) => {
    const look = part === null ? "open" : isLost[position] ? "part lost" : "part";
    const words = isLost[position] ? () => "all" : percent;
    return make("td", { class: look, style: `--part: ${part ?? 0}` }, known(part, words));
  });
  return row({ class: hidden.length > 0 && "hidden-error", onmouseenter: point }, label,
    u === null ? "undetermined" : `${micro(u)} ${UNITS[unit] ?? unit}`, cells);
}

// What a candidate lowers U6 by, for each reading and minute that it costs.
function gain({ name, readings, minutes, average }, before) {
  const by = (cost) => `${Number((1e9 * (before - average) / cost).toPrecision(2))} nm`;
  const isKnown = before !== null && average !== null;
  return hint(`+ ${name}, the next position`,
    isKnown && `: U6 falls by ${micro(before - average)} µm, ${by(readings)} for each reading`,
    isKnown && minutes && ` and ${by(minutes)} for each minute`);
}

// The table in a box, and what there is to know about it.
function matrix(data, { onHover, onChoose }) {
  const { positions, undetermined_without: lost } = data;
  const rows = data.errors.map((error, k) =>
    errorRow(error, data.information[k], lost[k], data.directions, onHover));
  const box = make("div", { class: "scrolled whole", tabindex: "0", role: "region",
    "aria-label": "Errors by positions", onscroll: () => look() },
  make("table", { class: "matrix" }, head(data, onChoose), make("tbody", {}, rows)));
  const more = hint(`Scroll to the right for all ${positions.length} positions →`);
  // Its right edge fades as long as there is more behind it.
  const look = () => {
    more.hidden = box.scrollWidth <= box.clientWidth;
    box.classList.toggle("more", box.scrollLeft + box.clientWidth < box.scrollWidth - 2);
  };
  new ResizeObserver(look).observe(box);
  return [hint("Information of each error that goes with each position, %"), more, box,
    ...positions.filter((one) => one.is_added).map((one) => gain(one, data.average)),
    lost.flat().some(Boolean) ? hint("all: without it, the error is undetermined.") : ""];
}

let shown = null; // what the table is of
let waiting = null;
// Show the table of the present design with a candidate, once it is unfolded and nothing moves. A
// position whose head is pressed is given to `onChoose`.
export function errors(candidate, handlers) {
  clearTimeout(waiting);
  const { fingerprint, design, stale, pending } = page.state;
  const key = JSON.stringify([fingerprint, candidate ?? null]);
  $("matrix").classList.toggle("stale", key !== shown);
  if (!$("errors").open || key === shown || !design || stale || pending) return;
  waiting = setTimeout(async () => {
    try {
      const data = await ask("/api/matrix", candidate ? { settings: candidate } : {});
      if (data.fingerprint !== page.state.fingerprint) return;
      shown = key;
      if (data.errors) $("matrix").replaceChildren(...matrix(data, handlers));
      $("matrix").classList.remove("stale");
    } catch (error) {
      $("matrix").textContent = error.message;
    }
  }, 400);
}
