// The list of positions, and the one that is chosen.
import { $, act, button, fill, make, page } from "./page.js";

export function choose(name) {
  page.selected = name;
  page.view.show(page.state.design, name);
  positions();
}

export function positions() {
  const { positions: list = [], unclear = {} } = page.design?.scene ?? {};
  // Those that cannot be understood have no place.
  const others = Object.entries(unclear).map(([name, problem]) =>
    ({ name, problem, enabled: true, readings: "unclear" }));
  fill($("positions"), [...list, ...others].map(item));
  const place = list.find((one) => one.name === page.selected);
  fill($("position"), place ? details(place) : []);
}

const box = (label, checked, onchange, attributes = {}) =>
  make("input", { type: "checkbox", "aria-label": label, checked, onchange, ...attributes });

function item({ name, enabled, problem, readings }) {
  const look = [name === page.selected && "chosen", !enabled && "off", problem && "wrong"];
  const does = enabled ? "off" : "on";
  return make("li", { class: look.filter(Boolean).join(" "), title: problem ?? undefined },
    box(`read ${name}`, enabled, () => act({ do: does, position: name }),
      { title: `switch this position ${does}` }),
    readings === "unclear" ? make("span", { class: "name" }, name)
      : button(name, () => choose(name), { class: "name", "aria-label": `choose ${name}` }),
    make("small", { title: "readings" }, enabled ? `${readings}` : "off"));
}

function details({ name, artefact, plane, problem, probes, read, readings }) {
  const { scene } = page.design;
  const axes = scene.dimension === 3 ? ["x", "y", "z"] : [];
  const does = (words, action, attributes = {}) =>
    button(words, () => act({ ...action, position: name }), attributes);
  // Everything that is read, with one of it changed.
  const changed = (all, is, k) => all.filter((_, other) => (other === k) !== is(other));
  const balls = scene.artefacts[artefact];
  const ball = (label, k) => does("",
    { do: "balls", balls: changed(balls, (other) => read[other], k) },
    { title: label, "aria-label": label, "aria-pressed": String(read[k]) });
  const across = Math.max(1, Math.round(Math.sqrt(balls.length)));
  const tips = Object.keys(scene.probes);
  const isUsed = (k) => probes.includes(tips[k]);
  return [make("strong", {}, name), make("div", {}, `${artefact}; ${readings} readings`),
    problem ? make("div", { class: "field-error" }, problem) : null,
    make("div", { class: "bar" }, does("Turn", { do: "turn" }, { id: "turn" }),
      axes.map((axis) => does(`⟂ ${axis}`, { do: "stand", across: axis },
        { disabled: plane === axis, title: `stand across ${axis}` })),
      does("Copy", { do: "copy" }), does("Remove", { do: "remove" })),
    make("div", {}, "read with: ", tips.map((tip, k) => make("label", {}, box(`probe ${tip}`,
      isUsed(k), () => act({ do: "probes", position: name, probes: changed(tips, isUsed, k) })),
    `${tip} `))),
    make("div", { class: "balls", role: "group", "aria-label": "balls that are read",
      style: `grid-template-columns: repeat(${across}, 24px)` }, balls.map(ball))];
}
