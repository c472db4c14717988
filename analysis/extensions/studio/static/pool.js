// The pool that a plan chooses from: filled, drawn in the volume, and limited; its form has all of
// it.
import { flow } from "./forms.js";
import { $, act, fill, follow, make, page } from "./page.js";

let probes = {}; // that read each plane

// Show the pool of the present design, once it is unfolded or drawn.
export function pool() {
  const isDrawn = $("show-pool").checked;
  if (!isDrawn) page.view.set({ outlines: [], boxes: [] });
  if (isDrawn || $("pool").open) follow("pool", {}, show);
}

function show({ error, ...found }) {
  $("pool-said").textContent = error ?? said(found);
  $("pool-said").classList.toggle("field-error", Boolean(error));
  $("pool-parts").hidden = Boolean(error);
  if (error) return;
  ({ probes } = found);
  fill($("candidates"), found.names.map((one) => make("option", { value: one })));
  if ($("show-pool").checked) page.view.set({ outlines: found.outlines, boxes: found.boxes });
}

function said({ count, dropped, more }) {
  const reasons = Object.entries(dropped).map(([why, number]) => `${number} ${why}`).join(", ");
  return `${count ? "" : "No candidates yet: fill the volume. "}${count} candidates besides the`
    + ` positions${reasons && `; not offered: ${reasons}`}${
      more ? `; ${more} outlines are not drawn` : ""}.`;
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

$("leaving-out").onsubmit = (event) => {
  event.preventDefault();
  const value = flow({ of: { name: $("candidate").value.trim() }, count: 0 });
  act({ do: "set", path: ["pool", "limits", "at_most", "+"], value }, "left out");
};
