// The pool that a plan chooses from: drawn in the volume, filled, limited, and planned from.
import { start } from "./computations.js";
import { $, act, ask, make, page } from "./page.js";

let found = null; // the pool, as it was asked for last
let failed = ""; // why there is none
let waiting = null;

const listed = (text) => text.split(",").map((one) => one.trim()).filter(Boolean);
const limits = () => page.state.data?.pool?.limits ?? {};

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
      const answer = await ask("/api/pool");
      if (answer.fingerprint !== page.state.fingerprint) return;
      [found, failed] = [answer, ""];
    } catch (error) {
      failed = error.message;
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

// What is filled, as it was chosen last, by planes.
const chosen = { turns: "0, 1", count: "3", probes: {}, planes: {} };

function build() {
  const focused = document.activeElement?.dataset?.pool;
  $("pool-box").classList.remove("stale");
  $("pool-box").replaceChildren(
    ...(failed ? [make("p", { class: "field-error" }, failed)] : []),
    ...(found ? [said(), fill(), forbidden(), leftOut(), plan()] : []));
  if (focused) $("pool-box").querySelector(`[data-pool="${CSS.escape(focused)}"]`)?.focus();
}

function said() {
  const dropped = Object.entries(found.dropped).map(([why, count]) => `${count} ${why}`);
  const none = found.count ? "" : "No candidates yet: fill the volume. ";
  const not = dropped.length ? `; not offered: ${dropped.join(", ")}` : "";
  const more = found.more ? `; ${found.more} outlines are not drawn` : "";
  return make("p", { id: "pool-said" },
    `${none}${found.count} candidates besides the positions${not}${more}.`);
}

// A field whose value is kept in `chosen` while the panel is made anew.
function field(words, key, where, preset, attributes = {}) {
  where[key] ??= preset;
  return make("label", {}, words, " ", make("input", { value: where[key], "data-pool": words,
    onchange: (event) => { where[key] = event.target.value; }, ...attributes }));
}

function fill() {
  const planes = Object.entries(found.probes);
  const rows = planes.map(([plane, probes]) => {
    chosen.planes[plane] ??= true;
    const across = planes.length > 1 ? `⟂ ${plane} with` : "read with";
    const box = make("input", { type: "checkbox", checked: chosen.planes[plane],
      "aria-label": `fill planes across ${plane}`, "data-pool": `plane ${plane}`,
      onchange: (event) => { chosen.planes[plane] = event.target.checked; } });
    return make("div", { class: "bar plane" }, planes.length > 1 ? box : null,
      field(across, plane, chosen.probes, probes.join(", ")));
  });
  const run = () => {
    const probes = Object.fromEntries(planes.filter(([plane]) => chosen.planes[plane])
      .map(([plane]) => [plane, listed(chosen.probes[plane])]));
    const action = { do: "fill", probes, quarter_turns: listed(chosen.turns).map(Number),
      count: Number(chosen.count) };
    act(action, "the pool fills the volume; undo leads back");
    $("show-pool").checked = true;
  };
  return make("fieldset", {}, make("legend", {}, "Fill the volume"), ...rows,
    make("div", { class: "bar" },
      field("quarter turns", "turns", chosen, "0, 1", { size: 8 }),
      field("places along each axis", "count", chosen, "3", { size: 3, inputmode: "numeric" })),
    make("button", { id: "fill", "data-pool": "fill", onclick: run }, "Fill the volume"));
}

const CORNERS = ["low", "high"].flatMap((x) => ["low", "high"].flatMap((y) =>
  ["low", "high"].map((z) => [x, y, z])));
let corner = null;

function forbidden() {
  const { lower, upper, dimension } = page.state.design.scene;
  const axes = ["x", "y", "z"].slice(0, dimension);
  const rows = (limits().forbidden ?? []).map((box, k) => make("div", { class: "bar box" },
    ...axes.map((axis) => make("label", {}, `${axis} `, make("input", { size: 14,
      value: box[axis]?.join(", ") ?? "", placeholder: "everywhere",
      "aria-label": `forbidden box ${k + 1}, from and to along ${axis}`,
      "data-pool": `${k} ${axis}`,
      onchange: (event) => act({ do: "set", path: ["pool", "limits", "forbidden", k, axis],
        value: event.target.value.trim() && `[${event.target.value}]` }) }))),
    lift("forbidden", k, `Allow box ${k + 1} again`, "allow")));
  const names = CORNERS.slice(0, 8).filter((one) => dimension === 3 || one[2] === "low")
    .map((ends) => axes.map((axis, k) => `${axis} ${ends[k]}`).join(", "));
  corner = names.includes(corner) ? corner : names[0];
  const forbid = () => {
    // A quarter of each edge; what touches a wall goes on beyond it.
    const ends = corner.split(", ").map((one) => one.endsWith("high"));
    const millimetres = (metres) => `${Number((1e3 * metres).toFixed(1))} mm`;
    const entry = Object.fromEntries(axes.map((axis, k) => {
      const part = (upper[k] - lower[k]) / 4;
      const [from, to] = ends[k] ? [upper[k] - part, upper[k]] : [lower[k], lower[k] + part];
      return [axis, [millimetres(from), millimetres(to)]];
    }));
    $("show-pool").checked = true;
    act({ do: "limit", limit: "forbidden", entry }, "no artefact may enter the red box");
  };
  return make("fieldset", {}, make("legend", {}, "Forbidden boxes"), ...rows,
    make("div", { class: "bar" },
      make("select", { "aria-label": "corner", "data-pool": "corner",
        onchange: (event) => { corner = event.target.value; } },
      ...names.map((name) => new Option(name, name, name === corner, name === corner))),
      make("button", { id: "forbid", "data-pool": "forbid", onclick: forbid },
        "Forbid this corner")));
}

function lift(limit, index, words, label) {
  return make("button", { "aria-label": words, "data-pool": words,
    onclick: () => act({ do: "lift", limit, index }) }, label);
}

function leftOut() {
  const out = (limits().at_most ?? []).map((entry, k) => [entry, k])
    .filter(([{ of, count }]) => Number(count) === 0 && of?.name);
  const name = make("input", { list: "candidates", "aria-label": "candidate to leave out",
    placeholder: "candidate", "data-pool": "candidate" });
  const leave = () => name.value.trim() && act({ do: "limit", limit: "at_most",
    entry: { of: { name: name.value.trim() }, count: 0 } }, "left out");
  return make("fieldset", {}, make("legend", {}, "Candidates left out"),
    ...out.map(([{ of }, k]) => make("div", { class: "bar" }, of.name,
      lift("at_most", k, `Offer ${of.name} again`, "offer again"))),
    make("div", { class: "bar" }, name,
      make("datalist", { id: "candidates" }, ...found.names.map((one) => new Option(one, one))),
      make("button", { id: "leave-out", "data-pool": "leave", onclick: leave }, "Leave out")));
}

function plan() {
  const hours = field("hours at most", "hours", chosen, "", { size: 5, inputmode: "decimal",
    placeholder: "as now" });
  const run = () => start("plan", chosen.hours.trim() ? { hours: Number(chosen.hours) } : {});
  return make("div", { class: "bar" }, hours,
    make("button", { id: "plan", "data-pool": "plan", onclick: run }, "Plan from the pool"));
}
