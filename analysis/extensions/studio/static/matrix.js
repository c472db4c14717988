// Errors by positions: how much of each error's information goes with each position.
import { $, ask, make, micro, page } from "./page.js";

const UNITS = { m: "µm", rad: "µrad", 1: "ppm" };
const percent = (part) => `${Number((100 * part).toPrecision(2))}`;

// A table of errors by positions. A row that is pointed at or focused is given to `onHover`, with
// the index of the direction that hides it, or null; a position whose head is pressed to
// `onChoose`.
export function matrix(container, data, { onHover, onChoose }) {
  const head = (position) => make("th", { scope: "col", class: position.is_added ? "added" : "" },
    make("button", { class: "link", "aria-label": `choose ${position.name}`,
      onclick: () => onChoose(position) }, `${position.is_added ? "+ " : ""}${position.name}`));
  const row = (label, unit, cell) => make("tr", {},
    make("th", { scope: "row" }, label), make("td", {}, unit),
    ...data.positions.map((position) => make("td", {}, cell(position))));
  const heads = [row("readings", "", ({ readings }) => `${readings}`)];
  if (data.positions.some(({ minutes }) => minutes !== null)) {
    heads.push(row("minutes", "", ({ minutes }) =>
      (minutes === null ? "–" : `${Math.round(minutes)}`)));
  }
  heads.push(row("U6 without, µm", micro(data.average), ({ average }) => micro(average)));
  const table = make("table", { class: "matrix" },
    make("caption", {}, "Information of each error that goes with each position, %"),
    make("thead", {}, make("tr", {}, make("th", { scope: "col" }, "error"),
      make("th", { scope: "col" }, "u"), ...data.positions.map(head)), ...heads),
    make("tbody", {}, ...data.errors.map((error, row) => errorRow(error, row, data, onHover))));
  const is_lost = data.undetermined_without.flat().some(Boolean);
  const shown = [make("div", { class: "scrolled whole", tabindex: "0", role: "region",
    "aria-label": "Errors by positions" }, table), ...gains(data)];
  if (is_lost) {
    shown.push(make("p", { class: "hint" }, "all: without it, the error is undetermined."));
  }
  container.replaceChildren(...shown);
}

function errorRow(error, row, data, onHover) {
  const is_open = error.standard_uncertainty === null;
  const words = error.hidden_by.map((k) => data.directions[k]).join("; ");
  let k = 0;
  const point = () => onHover(error, error.hidden_by.length ? error.hidden_by[k] : null);
  const turn = () => {
    k = (k + 1) % error.hidden_by.length;
    point();
  };
  const name = error.hidden_by.length
    ? make("button", { class: "link", title: words, "data-focus": `error ${error.name}`,
      "aria-label": `${error.name}: ${words}`, onclick: turn, onfocus: point }, error.name)
    : make("span", { title: error.meaning }, error.name);
  const u = is_open ? "undetermined"
    : `${micro(error.standard_uncertainty)} ${UNITS[error.unit] ?? error.unit}`;
  return make("tr", { class: error.hidden_by.length ? "hidden-error" : "", onmouseenter: point },
    make("th", { scope: "row" }, name), make("td", {}, u),
    ...data.information[row].map((part, k) => cell(part, data.undetermined_without[row][k])));
}

function cell(part, is_lost) {
  if (part === null) return make("td", { class: "open" }, "–");
  const made = make("td", { class: is_lost ? "part lost" : "part" },
    is_lost ? "all" : percent(part));
  made.style.setProperty("--part", part);
  return made;
}

// What candidates lower U6 by, for each reading and minute that they cost.
function gains({ average, positions }) {
  const added = positions.filter((position) => position.is_added);
  return added.map((position) => {
    const gain = average - position.average;
    const by = (cost) => `${Number((1e9 * gain / cost).toPrecision(2))} nm`;
    const per = average === null || position.average === null ? ""
      : `: U6 falls by ${micro(gain)} µm, ${by(position.readings)} for each reading${
        position.minutes ? ` and ${by(position.minutes)} for each minute` : ""}`;
    return make("p", { class: "hint" }, `+ ${position.name}, the next position`, per);
  });
}

let shown = null; // what the table is of
let waiting = null;
// Show the table of the present design with a candidate, once it is unfolded and nothing moves.
export function errors(candidate, { onHover, onChoose }) {
  clearTimeout(waiting);
  const { fingerprint, design, stale, pending } = page.state;
  const key = JSON.stringify([fingerprint, candidate ?? null]);
  const is_current = key === shown;
  $("matrix").classList.toggle("stale", !is_current);
  if (!$("errors").open || is_current || !design || stale || pending) return;
  waiting = setTimeout(async () => {
    try {
      const data = await ask("/api/matrix", candidate ? { settings: candidate } : {});
      if (data.fingerprint !== page.state.fingerprint) return;
      shown = key;
      if (data.errors) matrix($("matrix"), data, { onHover, onChoose });
      $("matrix").classList.remove("stale");
    } catch (error) {
      $("matrix").textContent = error.message;
    }
  }, 400);
}
