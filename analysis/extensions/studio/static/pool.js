// The pool that a plan chooses from: drawn in the volume, filled, and limited.
import { $, act, ask_now, button, fill, make, options, page } from "./page.js";

let found = null; // the pool, as it was asked for last
let failed = ""; // why there is none
let waiting = null;

const listed = (text) => text.split(",").map((one) => one.trim()).filter(Boolean);

// Show the pool of the present design, once it is unfolded or drawn and nothing moves.
export function pool() {
  clearTimeout(waiting);
  const { fingerprint, pending, design } = page.state;
  draw();
  const is_current = found?.fingerprint === fingerprint;
  $("pool-box").classList.toggle("stale", !is_current && !failed);
  if (is_current || pending || !design) return;
  if (!$("pool").open && !$("show-pool").checked) return;
  waiting = setTimeout(async () => {
    try {
      const answer = await ask_now("/api/pool");
      if (!answer) return;
      [found, failed] = [answer, ""];
    } catch (error) {
      [found, failed] = [null, error.message];
    }
    build();
    draw();
  }, 300);
}

function draw() {
  const { scene } = page.state.design ?? {};
  const is_drawn = $("show-pool").checked && found && scene
    && found.outlines.every((outline) => outline[0].length === scene.dimension);
  page.view.pool(is_drawn ? found.outlines : [], is_drawn ? found.boxes : []);
}

const axes = () => ["x", "y", "z"].slice(0, page.state.design.scene.dimension);

function build() {
  $("pool-box").classList.remove("stale");
  $("pool-said").textContent = found ? said() : failed;
  $("pool-said").classList.toggle("field-error", !found);
  $("pool-parts").hidden = !found;
  if (!found) return;
  const planes = Object.entries(found.probes);
  fill($("planes"), planes.map(([plane, probes]) => {
    const words = planes.length > 1 ? `⟂ ${plane} with` : "read with";
    return make("div", { class: "bar plane", "data-plane": plane },
      make("input", { type: "checkbox", checked: true, hidden: planes.length < 2, "data-own": "",
        "aria-label": `fill planes across ${plane}` }),
      make("label", {}, words, " ", make("input", { value: probes.join(", ") })));
  }));
  const { forbidden = [], at_most = [] } = page.state.data?.pool?.limits ?? {};
  fill($("boxes"), forbidden.map((box, k) => make("div", { class: "bar box" },
    axes().map((axis) => make("label", {}, `${axis} `, make("input", { size: 14,
      value: box[axis]?.join(", ") ?? "", placeholder: "everywhere",
      "aria-label": `forbidden box ${k + 1}, from and to along ${axis}`,
      onchange: ({ currentTarget: { value } }) => act({ do: "set", value: value && `[${value}]`,
        path: ["pool", "limits", "forbidden", k, axis] }) }))),
    lift("forbidden", k, `Allow box ${k + 1} again`, "allow"))));
  const corners = axes().reduce((some, axis) => some.flatMap((one) =>
    ["low", "high"].map((end) => [...one, `${axis} ${end}`])), [[]]).map((one) => one.join(", "));
  const corner = $("corner").value;
  options($("corner"), corners, corners.includes(corner) ? corner : corners[0]);
  fill($("left-out"), at_most.map(({ of, count }, k) => (Number(count) === 0 && of?.name
    ? make("div", { class: "bar" }, of.name,
      lift("at_most", k, `Offer ${of.name} again`, "offer again")) : null)));
  fill($("candidates"), found.names.map((one) => make("option", { value: one })));
}

function said() {
  const { count, dropped, more } = found;
  const reasons = Object.entries(dropped).map(([why, number]) => `${number} ${why}`).join(", ");
  return `${count ? "" : "No candidates yet: fill the volume. "}${count} candidates besides the`
    + ` positions${reasons && `; not offered: ${reasons}`}${
      more ? `; ${more} outlines are not drawn` : ""}.`;
}

const lift = (limit, index, words, label) =>
  button(label, () => act({ do: "lift", limit, index }), { "aria-label": words });

$("fill").onclick = () => {
  const planes = [...$("planes").children].filter((one) => one.firstElementChild.checked);
  const probes = Object.fromEntries(planes.map((one) =>
    [one.dataset.plane, listed(one.lastElementChild.lastElementChild.value)]));
  $("show-pool").checked = true;
  act({ do: "fill", probes, quarter_turns: listed($("turns").value).map(Number),
    count: Number($("count").value) }, "the pool fills the volume; undo leads back");
};
$("forbid").onclick = () => {
  const { lower, upper } = page.state.design.scene;
  // A quarter of each edge; what touches a wall goes on beyond it.
  const ends = $("corner").value.split(", ").map((one) => one.endsWith("high"));
  const millimetres = (metres) => `${Number((1e3 * metres).toFixed(1))} mm`;
  const entry = Object.fromEntries(axes().map((axis, k) => {
    const edge = (upper[k] - lower[k]) / 4;
    const from = ends[k] ? upper[k] - edge : lower[k];
    return [axis, [millimetres(from), millimetres(from + edge)]];
  }));
  $("show-pool").checked = true;
  act({ do: "limit", limit: "forbidden", entry }, "no artefact may enter the red box");
};
$("leave-out").onclick = () => {
  const entry = { of: { name: $("candidate").value.trim() }, count: 0 };
  if (entry.of.name) act({ do: "limit", limit: "at_most", entry }, "left out");
};
