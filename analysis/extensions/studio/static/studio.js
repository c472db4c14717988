// The page of the studio: it asks, the engine answers, and everything that is shown comes from
// there.
import { ask_later, dress, figures, unfold_text } from "./answers.js";
import { begin, begins } from "./begin.js";
import {
  candidate, dialog, drawn, fit, forget_suggestions, poll, start, sweep,
} from "./computations.js";
import { build, flow } from "./forms.js";
import { legend } from "./legend.js";
import { errors } from "./matrix.js";
import {
  $, act, ask, focus, latency, options, page, preview, refocus, refresh, tell, watch,
} from "./page.js";
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
  const { design } = state;
  const focused = focus();
  const title = `${state.file}${state.saved ? "" : " (not saved)"}`;
  const heading = `${title}${design ? ` — ${design.title}` : ""}`;
  $("title").textContent = begins() ? "ballplate studio" : heading;
  document.title = `${state.saved ? "" : "• "}${state.file} – ballplate studio`;
  const is_listed = state.files.includes(state.file);
  options($("files"), is_listed ? state.files : [state.file, ...state.files], state.file);
  $("variant-label").hidden = !state.variants.length;
  options($("variants"), state.variants, state.variant);
  $("undo").disabled = !state.back;
  $("redo").disabled = !state.forward;
  $("save").disabled = state.saved;
  $("keep").textContent = state.kept ? "Stop comparing" : "Keep to compare";
  if (!page.typed && $("text").value !== state.text) $("text").value = state.text;
  $("apply").disabled = !page.typed;
  if (design) draw(design);
  else view.empty();
  figures(design, state.messages, state.pending);
  watch();
  positions();
  if (page.schema) build($("forms"), state.data, page.schema, state.messages, set);
  drawn();
  pool();
  informed();
  refocus(focused);
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
  const directions = design.rank?.directions ?? [];
  const { selected, motion } = page;
  if (!design.scene.positions.some((place) => place.name === selected)) page.selected = null;
  if (motion !== null && motion >= directions.length) page.motion = null;
  if (page.motion === null && design.rank?.deficiency) page.motion = 0;
  if (page.motion !== null && !directions.length) page.motion = null;
  dress(design);
  view.motion = page.motion;
  view.show(design, page.selected);
  const [along, does] = design.scene.dimension === 3
    ? [", with Shift along its normal", "turn"] : ["", "move"];
  $("hint").textContent = `Drag a plate along its plane${along}; Escape puts it back, Alt lets it`
    + ` through walls. Drag elsewhere to ${does} the view; double-click the floor to add a plate.`;
  legend();
}

async function set(path, value, input) {
  if (!(await act({ do: "set", path, value }))) input?.classList.add("bad-field");
}

$("undo").onclick = () => act({ do: "undo" });
$("redo").onclick = () => act({ do: "redo" });
$("keep").onclick = () => act({ do: "keep", off: !!page.state.kept });
$("save").onclick = () => act({ do: "save" }, "saved");
$("save-as").onclick = async () => {
  const question = "Save under another name, in the same folder";
  const answer = await dialog(question, [["name", page.state.file]]);
  if (answer) act({ do: "save", name: answer[0] }, "saved");
};
$("files").onchange = async (event) => {
  const name = event.target.value;
  const discard = !page.state.saved;
  const question = `${page.state.file} has changes that are not saved. Leave them?`;
  if (discard && !(await dialog(question, []))) {
    show();
    return;
  }
  forget_suggestions();
  await act({ do: "open", name, discard });
  view.home();
};
$("variants").onchange = (event) => act({ do: "variant", name: event.target.value });
$("text").addEventListener("input", () => {
  page.typed = $("text").value !== page.state.text;
  $("apply").disabled = !page.typed;
});
$("apply").onclick = async () => {
  const text = $("text").value;
  page.typed = false;
  if (await act({ do: "text", text })) return;
  $("text").value = text;
  page.typed = true;
  $("apply").disabled = false;
};
$("reopen").onclick = () => {
  page.typed = false;
  act({ do: "reopen" }, "read again; undo leads back to the text that was here");
};
$("toggle-text").onclick = () => unfold_text($("text-box").hidden);
$("step").onchange = (event) => { view.step = Number(event.target.value); };
$("errors").ontoggle = informed;
$("pool").ontoggle = $("show-pool").onchange = pool;
$("map").onchange = () => {
  show();
  ask_later(0);
};
$("home").onclick = () => view.home();
$("sweep").onclick = sweep;
document.querySelectorAll("[data-job]").forEach((button) => {
  button.onclick = () => start(button.dataset.job);
});
$("readings").onchange = (event) => {
  if (event.target.files[0]) fit(event.target.files[0]);
  event.target.value = "";
};
const drop = $("drop");
drop.addEventListener("dragover", (event) => {
  event.preventDefault();
  drop.classList.add("over-it");
});
drop.addEventListener("dragleave", () => drop.classList.remove("over-it"));
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over-it");
  if (event.dataTransfer.files[0]) fit(event.dataTransfer.files[0]);
});
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target === $("text") || begins()) return;
  const key = event.key.toLowerCase();
  const does = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[key];
  if (!does) return;
  event.preventDefault();
  act({ do: does }, does === "save" ? "saved" : "");
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

window.studio = { view, latency, state: () => page.state, act, flow };
try {
  [page.state, page.schema] = await Promise.all([ask("/api/state"), ask("/api/schema")]);
  page.motion = page.state.design?.rank?.deficiency ? 0 : null;
  show();
  if (page.state.note) tell(page.state.note);
  if (page.state.untouched) await begin();
  poll();
} catch (error) {
  tell(error.message, true);
}
