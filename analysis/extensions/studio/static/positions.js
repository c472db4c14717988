// The list of positions, and the one that is chosen.
import { $, act, focus, make, page, refocus } from "./page.js";

export function choose(name) {
  page.selected = name;
  const focused = focus();
  page.view.show(page.state.design, name);
  positions();
  refocus(focused);
}

export function positions() {
  const { state, selected } = page;
  const list = state.design?.scene.positions ?? [];
  const unclear = Object.entries(state.design?.scene.unclear ?? {}).map(([name, problem]) =>
    make("li", { class: "wrong", title: problem },
      make("input", { type: "checkbox", checked: true, title: "switch this position off",
        "aria-label": `read ${name}`, onchange: () => act({ do: "off", position: name }) }),
      make("span", { class: "name" }, name), make("small", {}, "unclear")));
  $("positions").replaceChildren(...list.map(item), ...unclear);
  const place = list.find((one) => one.name === selected);
  $("position").hidden = !place;
  if (place) details(place);
}

function item(place) {
  const { name, enabled, problem } = place;
  const look = [name === page.selected && "chosen", !enabled && "off", problem && "wrong"];
  const does = enabled ? "off" : "on";
  return make("li", { class: look.filter(Boolean).join(" "), title: problem ?? undefined },
    make("input", { type: "checkbox", checked: enabled, title: `switch this position ${does}`,
      "aria-label": `read ${name}`, onchange: () => act({ do: does, position: name }) }),
    make("button", { class: "name", "aria-label": `choose ${name}`, onclick: () => choose(name) },
      name),
    make("small", { title: "readings" }, enabled ? `${place.readings}` : "off"),
  );
}

function details(place) {
  const { scene } = page.state.design;
  const { name } = place;
  const many = place.groups > 1;
  const axes = scene.dimension === 3 ? ["x", "y", "z"] : [];
  const balls = scene.artefacts[place.artefact];
  const across = Math.max(1, Math.round(Math.sqrt(balls.length)));
  const read = (k) => balls.filter((_, other) => (other === k) !== place.read[other]);
  const grid = make("div", { class: "balls", role: "group", "aria-label": "balls that are read" },
    ...balls.map((ball, k) => make("button", {
      title: ball, "aria-label": ball, "aria-pressed": String(place.read[k]), disabled: many,
      onclick: () => act({ do: "balls", position: name, balls: read(k) }),
    })));
  grid.style.gridTemplateColumns = `repeat(${across}, 24px)`;
  const probes = Object.keys(scene.probes);
  const with_probe = (probe, isRead) =>
    probes.filter((other) => (other === probe ? isRead : place.probes.includes(other)));
  const button = (words, action, attributes = {}) =>
    make("button", { ...attributes, onclick: () => act({ ...action, position: name }) }, words);
  $("position").replaceChildren(
    make("strong", {}, name), make("div", {}, `${place.artefact}; ${place.readings} readings`),
    place.problem ? make("div", { class: "field-error" }, place.problem) : "",
    make("div", { class: "bar" },
      button("Turn", { do: "turn" }, { id: "turn" }),
      ...axes.map((axis) => button(`⟂ ${axis}`, { do: "stand", across: axis },
        { disabled: place.plane === axis, title: `stand across ${axis}` })),
      button("Copy", { do: "copy" }), button("Remove", { do: "remove" }),
    ),
    make("div", {}, "read with: ", ...probes.map((probe) => make("label", {},
      make("input", { type: "checkbox", checked: place.probes.includes(probe), disabled: many,
        "aria-label": `probe ${probe}`, onchange: (event) =>
          act({ do: "probes", position: name, probes: with_probe(probe, event.target.checked) }) }),
      `${probe} `))),
    grid,
    many ? make("small", {}, "several groups of readings: change them in the text") : "",
  );
}
