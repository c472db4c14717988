// The page of the studio: it asks, the engine answers, and everything that is shown comes from
// there.
import { ask_later, figures } from "./answers.js";
import { begin, begins, open } from "./begin.js";
import { drawn, fit, poll, start } from "./computations.js";
import { build } from "./forms.js";
import { errors } from "./matrix.js";
import { $, act, ask, options, page, preview, refresh, tell, watch } from "./page.js";
import { pool } from "./pool.js";
import { choose, positions } from "./positions.js";
import { View } from "./view.js";

const view = new View($("view"), {
  onSelect: choose,
  onDrag: (name, by) => preview({ do: "move", position: name, by }, moving),
  onDrop: (name, by) => act({ do: "move", position: name, by }),
  onPlace: (at) => add(at),
});
page.view = view;
page.show = show;

function show() {
  const { state } = page;
  const { design, file } = state;
  page.design = design;
  document.title = `${file}${state.saved ? "" : " (not saved)"} – ballplate studio`;
  $("title").textContent = begins() || !design ? document.title
    : document.title.replace("ballplate studio", design.title);
  options($("files"), [...new Set([...state.files, file])].sort(), file);
  options($("variants"), state.variants, state.variant);
  $("undo").disabled = !state.back;
  $("redo").disabled = !state.forward;
  $("save").disabled = state.saved;
  $("keep").textContent = state.kept ? "Stop comparing" : "Keep to compare";
  // The hours of a plan are those of the data sheet that the file was drafted from, until changed.
  $("hours").defaultValue = /^#.* --hours ([\d.]+)/m.exec(state.text)?.[1] ?? "";
  page.typed &&= $("text").value !== state.text;
  if (!page.typed) $("text").value = state.text;
  if (design) draw(design);
  else view.empty();
  figures();
  watch();
  positions();
  build();
  drawn();
  // Of what cannot be evaluated, nothing more is asked.
  if (!state.pending && !state.stale) [ask_later, pool, errors].forEach((asks) => asks());
}

function draw(design) {
  const { positions: places, dimension } = design.scene;
  const count = design.rank?.directions.length ?? 0;
  if (!places.some(({ name }) => name === page.selected)) page.selected = null;
  if (page.motion >= count) page.motion = null;
  if (page.motion === null && design.rank?.deficiency && !page.stopped) page.motion = 0;
  if (page.motion === null) view.move(null);
  view.show(design, page.selected);
  $("design").classList.toggle("flat", dimension === 2);
}

// Figures of the design as it would be, and what is then wrong with its positions.
function moving(preview_of) {
  const { scene } = page.state.design;
  const places = scene.positions.map((place, k) =>
    ({ ...place, problem: preview_of.scene.positions[k]?.problem }));
  page.design = { ...preview_of, scene: { ...scene, positions: places } };
  figures();
  positions();
}

const add = (at) => act({ do: "put", at, like: page.selected ?? undefined }, "position added");

const CLICKS = {
  apply: () => act({ do: "text", text: $("text").value }),
  keep: () => act({ do: "keep", off: Boolean(page.state.kept) }),
  "save-as": () => {
    const name = window.prompt("Save under another name, in the same folder", page.state.file);
    if (name) act({ do: "save", name }, "saved");
  },
  reopen: () => {
    page.typed = false;
    act({ do: "reopen" }, "read again; undo leads back to the text that was here");
  },
  home: () => view.home(),
  put: () => add(),
};
Object.entries(CLICKS).forEach(([id, does]) => { $(id).onclick = does; });
document.querySelectorAll("[data-do]").forEach((one) => {
  one.onclick = () => act({ do: one.dataset.do }, one.dataset.said);
});
document.querySelectorAll("[data-job]").forEach((one) => {
  one.onclick = () => start(one.dataset.job);
});
$("files").onchange = async ({ target: { value } }) => {
  if (await open(value)) view.home();
  else show();
};
$("variants").onchange = ({ target: { value } }) => act({ do: "variant", name: value });
$("text").oninput = () => { page.typed = $("text").value !== page.state.text; };
$("step").onchange = ({ target: { value } }) => { view.step = Number(value); };
$("errors").ontoggle = errors;
$("pool").ontoggle = $("show-pool").onchange = pool;
$("map").onchange = ask_later;
$("readings").onchange = ({ target }) => {
  if (target.files[0]) fit(target.files[0]);
  target.value = "";
};
// A file that is dropped elsewhere does not replace the page.
for (const type of ["dragover", "drop"]) {
  document.addEventListener(type, (event) => {
    if (event.target !== $("readings")) event.preventDefault();
  });
}
// A message of what was refused ends with the next attempt.
document.addEventListener("input", () => {
  if ($("notice").classList.contains("bad")) tell("");
});
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target === $("text") || begins()) return;
  const key = event.key.toLowerCase();
  const does = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[key];
  if (!does) return;
  event.preventDefault();
  act({ do: does }, $(does).dataset.said);
});
// Axes of a plate and directions along them.
const ARROWS = {
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1],
  PageUp: [2, 1], PageDown: [2, -1],
};
let pressed = -Infinity;
$("view").addEventListener("keydown", (event) => {
  const { selected, state } = page;
  if (event.key.toLowerCase() === "n" && state.design) add();
  const place = state.design?.scene.positions.find((one) => one.name === selected);
  if (!place) return;
  const [axis, sign] = ARROWS[event.key] ?? [];
  // Keys in quick succession are one step back.
  const burst = event.timeStamp - pressed < 1000 ? true : undefined;
  if (event.key.toLowerCase() === "r") act({ do: "turn", position: selected });
  else if (event.key === "Delete") act({ do: "remove", position: selected });
  else if (axis < place.rotation.length) {
    const by = place.rotation.map((row) => sign * row[axis] * view.step);
    act({ do: "move", position: selected, by, burst });
    pressed = event.timeStamp;
  } else return;
  event.preventDefault();
});
window.addEventListener("beforeunload", (event) => { if (page.typed) event.preventDefault(); });
window.addEventListener("focus", () => { if (page.state) refresh(); });

window.studio = { view, state: () => page.state, act };
try {
  [page.state, page.schema] = await Promise.all([ask("/api/state"), ask("/api/schema")]);
  show();
  if (page.state.note) tell(page.state.note);
  if (page.state.untouched) await begin();
  poll();
} catch (error) {
  tell(error.message, true);
}
