// The page of the studio: it asks, the engine answers, and everything that is shown comes from
// there.
import { ask_later, dress, figures, unfold_text } from "./answers.js";
import { begin, begins, open } from "./begin.js";
import { candidate, dialog, drawn, fit, plan, poll, start, sweep } from "./computations.js";
import { build, flow } from "./forms.js";
import { legend } from "./legend.js";
import { errors } from "./matrix.js";
import { $, act, ask, options, page, preview, refresh, tell, watch } from "./page.js";
import { pool } from "./pool.js";
import { choose, positions } from "./positions.js";
import { View } from "./view.js";

const view = new View($("view"), {
  onSelect: choose,
  onDrag: (name, by) =>
    preview({ do: "move", position: name, by }, (design) => figures(design, [])),
  onDrop: (name, by) => act({ do: "move", position: name, by }),
  onPlace: (at) => act({ do: "put", at, like: page.selected ?? undefined }, "position added"),
});
page.view = view;
page.show = show;

function show() {
  const { state } = page;
  const { design, file } = state;
  const title = `${file}${state.saved ? "" : " (not saved)"}`;
  const heading = `${title}${design ? ` — ${design.title}` : ""}`;
  $("title").textContent = begins() ? "ballplate studio" : heading;
  document.title = `${state.saved ? "" : "• "}${file} – ballplate studio`;
  options($("files"), [...new Set([...state.files, file])].sort(), file);
  $("variant-label").hidden = !state.variants.length;
  options($("variants"), state.variants, state.variant);
  $("undo").disabled = !state.back;
  $("redo").disabled = !state.forward;
  $("save").disabled = state.saved;
  $("keep").textContent = state.kept ? "Stop comparing" : "Keep to compare";
  state_hours();
  page.typed &&= $("text").value !== state.text;
  if (!page.typed) $("text").value = state.text;
  $("apply").disabled = !page.typed;
  if (design) draw(design);
  else view.empty();
  figures(design, state.messages, state.pending);
  watch();
  positions();
  build();
  drawn();
  pool();
  informed();
}

let stated = "";
// The hours of a plan are those of the data sheet that the file was drafted from, until changed.
function state_hours() {
  const { file, text } = page.state;
  const hours = /^#.* --hours ([\d.]+)/m.exec(text)?.[1] ?? "";
  if (stated !== `${file} ${hours}`) $("hours").value = hours;
  stated = `${file} ${hours}`;
}

// Errors by positions; what hides one swings.
function informed() {
  errors(candidate(), {
    onHover: (_, motion) => {
      if (motion === null || motion === page.motion) return;
      page.motion = motion;
      show();
    },
    onChoose: ({ name }) => choose(name),
  });
}

function draw(design) {
  const { positions: places, dimension } = design.scene;
  const count = design.rank?.directions.length ?? 0;
  if (!places.some(({ name }) => name === page.selected)) page.selected = null;
  if (page.motion >= count) page.motion = null;
  if (page.motion === null && design.rank?.deficiency && !page.stopped) page.motion = 0;
  dress(design);
  view.motion = page.motion;
  view.show(design, page.selected);
  $("stage").classList.toggle("flat", dimension === 2);
  legend();
}

const CLICKS = {
  undo: () => act({ do: "undo" }),
  redo: () => act({ do: "redo" }),
  save: () => act({ do: "save" }, "saved"),
  keep: () => {
    const off = Boolean(page.state.kept);
    $("details").open ||= !off;
    act({ do: "keep", off });
  },
  "save-as": async () => {
    const question = "Save under another name, in the same folder";
    const answer = await dialog(question, ["name", page.state.file]);
    if (answer) act({ do: "save", name: answer[0] }, "saved");
  },
  apply: () => act({ do: "text", text: $("text").value }),
  reopen: () => {
    page.typed = false;
    act({ do: "reopen" }, "read again; undo leads back to the text that was here");
  },
  "toggle-text": () => unfold_text($("text-box").hidden),
  home: () => view.home(),
  sweep,
  plan,
};
Object.entries(CLICKS).forEach(([id, does]) => { $(id).onclick = does; });
document.querySelectorAll("[data-job]").forEach((one) => {
  one.onclick = () => start(one.dataset.job);
});
$("files").onchange = async ({ target: { value } }) => {
  if (await open(value)) view.home();
  else show();
};
$("variants").onchange = ({ target: { value } }) => act({ do: "variant", name: value });
$("text").oninput = () => {
  page.typed = $("text").value !== page.state.text;
  $("apply").disabled = !page.typed;
};
$("step").onchange = ({ target: { value } }) => { view.step = Number(value); };
$("errors").ontoggle = informed;
$("pool").ontoggle = $("show-pool").onchange = pool;
$("map").onchange = () => {
  show();
  ask_later(0);
};
$("readings").onchange = ({ target }) => {
  if (target.files[0]) fit(target.files[0]);
  target.value = "";
};
// A message of what was refused ends with the next attempt.
document.addEventListener("input", () => {
  if ($("notice").classList.contains("bad")) tell("");
});
for (const type of ["dragover", "dragleave", "drop"]) {
  document.addEventListener(type, (event) => {
    event.preventDefault();
    $("drop").classList.toggle("over-it", type === "dragover" && $("drop").contains(event.target));
    if (event.dataTransfer?.files[0] && type === "drop") fit(event.dataTransfer.files[0]);
  });
}
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target === $("text") || begins()) return;
  const key = event.key.toLowerCase();
  const does = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[key];
  if (!does) return;
  event.preventDefault();
  CLICKS[does]();
});
// Axes of a plate and directions along them.
const ARROWS = {
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1],
  PageUp: [2, 1], PageDown: [2, -1],
};
let pressed = -Infinity;
$("view").addEventListener("keydown", (event) => {
  const { selected, state } = page;
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

window.studio = { view, state: () => page.state, act, flow };
try {
  [page.state, page.schema] = await Promise.all([ask("/api/state"), ask("/api/schema")]);
  show();
  if (page.state.note) tell(page.state.note);
  if (page.state.untouched) await begin();
  poll();
} catch (error) {
  tell(error.message, true);
}
