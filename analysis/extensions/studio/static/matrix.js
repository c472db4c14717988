// Errors by positions: how much of each error's information goes with each position.
import { UNITS } from "./answers.js";
import { candidate } from "./computations.js";
import { $, button, fill, follow, make, micro, page } from "./page.js";
import { choose } from "./positions.js";

const percent = (part) => `${Number((100 * part).toPrecision(part < 0.01 ? 1 : 2))}`;
const known = (value, words) => (value === null ? "–" : words(value));
// As everywhere on the page, half a minute shows.
const in_minutes = (minutes) => `${Number(minutes.toFixed(1))}`;
const hint = (...words) => make("p", { class: "hint" }, ...words);
const row = (attributes, label, unit, cells) => make("tr", attributes,
  make("th", { scope: "row" }, label), make("td", {}, unit), cells);

function head({ positions, average }) {
  const name = ({ name: words, is_added }) => make("th", { scope: "col" },
    button(`${is_added ? "+ " : ""}${words}`, () => choose(words),
      { class: "link", "aria-label": `choose ${words}` }));
  const figures = (label, all, words) =>
    row({}, label, all, positions.map((one) => make("td", {}, words(one))));
  return make("thead", {}, make("tr", {}, ["error", "u"].map((words) =>
    make("th", { scope: "col" }, words)), positions.map(name)),
  figures("readings", "", ({ readings }) => readings),
  positions.some(({ minutes }) => minutes !== null)
    && figures("minutes", "", ({ minutes }) => known(minutes, in_minutes)),
  figures("U6 without, µm", known(average, micro), (one) => known(one.average, micro)));
}

function swing(motion) {
  if (motion === undefined || motion === page.motion) return;
  page.motion = motion;
  page.show();
}

// Where a row is pointed at or focused, the direction that hides its error swings; where several
// do, its name leads to the next.
function error_row(error, parts, isLost, directions) {
  const { name, hidden_by: hidden, standard_uncertainty: u, unit } = error;
  const reasons = hidden.map((k) => directions[k]).join("; ");
  const point = () => swing(hidden[0]);
  const turn = () => swing(hidden[(hidden.indexOf(page.motion) + 1) % hidden.length]);
  const label = !hidden.length ? make("span", { title: error.meaning }, name)
    : button(name, turn, { class: "link", title: reasons, "aria-label": `${name}: ${reasons}`,
      onfocus: point });
  const cells = parts.map((part, position) => {
    const look = part === null ? "open" : isLost[position] ? "part lost" : "part";
    const words = isLost[position] ? () => "all" : percent;
    return make("td", { class: look, style: `--part: ${part ?? 0}` }, known(part, words));
  });
  return row({ class: hidden.length > 0 && "hidden-error", onmouseenter: point }, label,
    u === null ? "undetermined" : `${micro(u)} ${UNITS[unit] ?? unit}`, cells);
}

// The table in a box, whose right edge fades as long as there is more behind it.
function matrix({ error, ...data }) {
  if (error || !data.errors) return error ?? "";
  const { positions, undetermined_without: lost } = data;
  const rows = data.errors.map((one, k) =>
    error_row(one, data.information[k], lost[k], data.directions));
  return [hint(`Information of each error that goes with each of ${positions.length} positions, %`),
    make("div", { class: "scrolled whole", tabindex: "0", role: "region",
      "aria-label": "Errors by positions" },
    make("table", { class: "matrix" }, head(data), make("tbody", {}, rows))),
    lost.flat().some(Boolean) ? hint("all: without it, the error is undetermined.") : ""];
}

// Show the table of the present design with the next position, if that was asked for.
export function errors() {
  const settings = candidate();
  if (!$("errors").open) return;
  follow("matrix", settings ? { settings } : {}, (data) => fill($("matrix"), matrix(data)), 400);
}
