// The pool that a plan chooses from: filled, drawn and limited; all of it is in its form.
import { $, act, follow, page } from "./page.js";

let probes = {}; // that read each plane

// Show the pool of the present design, once it is unfolded or drawn.
export function pool() {
  const isDrawn = $("show-pool").checked;
  if (!isDrawn) page.view.set({ outlines: [], boxes: [] });
  if (isDrawn || $("pool").open) follow("pool", {}, show);
}

function show({ error, ...found }) {
  $("pool-said").textContent = error ?? found.words;
  $("pool-said").classList.toggle("field-error", Boolean(error));
  $("pool-parts").hidden = Boolean(error);
  if (error) return;
  ({ probes } = found);
  if ($("show-pool").checked) page.view.set({ outlines: found.outlines, boxes: found.boxes });
}

$("filling").onsubmit = (event) => {
  event.preventDefault();
  const { planes, turns, count } = event.target.elements;
  const ticked = [...planes].filter(({ value, checked }) => checked && probes[value]);
  $("show-pool").checked = true;
  act({ do: "fill", probes: Object.fromEntries(ticked.map(({ value }) => [value, probes[value]])),
    quarter_turns: turns.value.split(",").map(Number), count: count.valueAsNumber },
  "the pool fills the volume; undo leads back");
};

$("forbidding").onsubmit = (event) => {
  event.preventDefault();
  const corner = [...event.target.querySelectorAll("select")].map(({ value }) => value);
  $("show-pool").checked = true;
  act({ do: "forbid", corner }, "no artefact may enter the red box");
};
