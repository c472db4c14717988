// Forms for the sections of a design, made from the schema of its file.
import { $, act, button, fill, make, options, page } from "./page.js";

const SECTIONS = [
  "title", "machine", "error_model", "probes", "artefacts", "positions", "calibration", "pool",
  "influences", "evaluation", "target_uncertainty", "coverage_factor", "expected_rank_deficiency",
];
const isMapping = (one) => one !== null && typeof one === "object" && !Array.isArray(one);
const spaced = (key) => String(key).replaceAll("_", " ");

// A schema that others refer to.
function resolve(schema) {
  let found = schema;
  while (found?.$ref) {
    found = found.$ref.split("/").slice(1).reduce((at, key) => at[key], page.schema);
  }
  return found ?? {};
}

// The forms that data may have there: alternatives are narrowed to those whose constants fit.
function forms(schema, data) {
  const found = resolve(schema);
  const every = (found.anyOf ?? found.oneOf)?.flatMap((one) => forms(one, data)) ?? [found];
  const fitting = every.filter((one) => fits(one, data));
  return fitting.length ? fitting : every;
}

function fits({ type, properties, additionalProperties }, data) {
  if (data === undefined) return true;
  if (!isMapping(data)) return Array.isArray(data) === (type === "array") && type !== "object";
  return [type === "object", properties, additionalProperties].some(Boolean)
    && Object.entries(properties ?? {}).every(([key, value]) =>
      [undefined, data[key]].includes(resolve(value).const));
}

// The schema of a key in one of some forms.
const property = (possible, key) => possible.flatMap(({ properties, additionalProperties }) =>
  properties?.[key] ?? (isMapping(additionalProperties) ? additionalProperties : []))[0] ?? {};

// All that a value can be, or null if it is free.
function choices(schemas) {
  const listed = schemas.map((one) => (one.const !== undefined ? [one.const] : one.enum
    ?? { boolean: [true, false], null: [] }[one.type]));
  return listed.includes(undefined) ? null : [...new Set(listed.flat().map(String))];
}

// All kinds of an entry that there are, not the present one alone.
const kinds = (part) => forms(part).map((one) => one.properties?.kind).filter(Boolean);

// A value as the file would state it, in one line.
export function flow(value) {
  if (value === null || value === undefined) return "";
  if (Array.isArray(value)) return `[${value.map(flow).join(", ")}]`;
  if (!isMapping(value)) return String(value);
  return `{${Object.entries(value).map(([key, one]) => `${key}: ${flow(one)}`).join(", ")}}`;
}

const set = (path, value) => act({ do: "set", path, value });

// Make the sections, and the fields of those that are open.
export function build() {
  const { data, messages } = page.state;
  const container = $("forms");
  if (!container.children.length) container.replaceChildren(...SECTIONS.map(section));
  for (const details of container.children) {
    const { section: key } = details.dataset;
    details.classList.toggle("wrong",
      messages.some(({ steps }) => steps[0] === key));
    const part = page.schema.properties[key];
    if (details.open) fill(details.lastElementChild, fields([key], data?.[key], part, "value"));
  }
}

const section = (key) => make("details", { "data-section": key, ontoggle: build },
  make("summary", { title: resolve(page.schema.properties[key]).description }, spaced(key)),
  make("div", {}));

// Unfold a section, and go to the last field of a key in it, or else to its first field.
export function lead(key, last) {
  const details = $("forms").querySelector(`[data-section="${key}"]`);
  details.open = true;
  build();
  const found = [...details.querySelectorAll("div :is(input, select)")];
  details.scrollIntoView({ block: "start" });
  (found.findLast((one) => one.dataset.path?.includes(last)) ?? found[0])?.focus();
}

// Fields of a value and of what is below it.
function fields(path, data, part, label) {
  const possible = forms(part, data);
  const items = possible.find((one) => one.items)?.items;
  if (isMapping(data)) {
    return [Object.entries(data).map(([key, value]) => {
      const below = key === "kind" ? { anyOf: kinds(part) } : property(possible, key);
      return fields([...path, key], value, below, path.length > 1 ? `${label} ${key}` : key);
    }), adding(path, data, possible, path.length > 1 ? label : path[0])];
  }
  if (Array.isArray(data) ? data.some(isMapping) : items && kinds(items).length) {
    return entries(path, data ?? [], items ?? {});
  }
  const [input, errors] = control(path, data, possible);
  return make("label", {}, make("span", { class: NUMBER.test(input.value) ? "handle" : "",
    title: part.description ?? resolve(part).description ?? possible[0]?.description },
  spaced(label)), input, errors);
}

// The field of a value, and what is wrong with it.
function control(path, data, possible) {
  const listed = data === undefined ? null : choices(possible);
  const said = flow(data);
  const steps = JSON.stringify(path);
  const wrong = page.state.messages.filter((one) => JSON.stringify(one.steps) === steps);
  const attributes = { "data-path": steps, class: wrong.length ? "bad-field" : "" };
  const input = make(listed?.length > 1 ? "select" : "input", listed?.length > 1 ? attributes
    : { value: said, placeholder: data === undefined ? "not stated" : "", ...attributes });
  if (listed?.length > 1) options(input, [...new Set([said, ...listed])], said);
  return [input, wrong.map(({ text }) => make("span", { class: "field-error" }, text))];
}

// An entry of a kind: an effect as the assumptions state it, or examples of what it needs.
function usual(kind, items) {
  const effect = page.effects.find((one) => one.kind === kind);
  const { properties, required = [] } = forms(items, { kind })[0];
  const example = (key) => {
    const { examples = [] } = { ...forms(properties[key])[0], ...properties[key] };
    return examples.find((one) => /um|ppm/.test(one)) ?? examples[0] ?? "";
  };
  const needed = Object.keys(properties).filter((key) =>
    required.includes(key) || key === "standard_uncertainty");
  const stated = Object.fromEntries(needed.map((key) => [key, example(key)]));
  return flow(effect ?? { ...stated, kind });
}

// A list of entries, to which one of a kind is added, or one like the last; positions are added
// where they are listed.
function entries(path, data, items) {
  const listed = choices(kinds(items)) ?? [];
  const add = ({ currentTarget: { previousElementSibling: select } }) =>
    set([...path, "+"], select ? usual(select.value, items) : flow(data.at(-1)));
  const title = (one, k) => one?.kind ?? one?.name ?? `${spaced(path.at(-1))} ${k + 1}`;
  const shown = data.map((one, k) => make("fieldset", {},
    make("legend", {}, title(one, k), " ", button("×", () => set([...path, k], ""),
      { title: "remove", "aria-label": `remove ${title(one, k)} ${k + 1}` })),
    make("div", { class: "entry" }, Object.entries(one ?? {}).map(([key, value]) =>
      (key === "kind" ? []
        : fields([...path, k, key], value, property(forms(items, one), key), key)))),
    adding([...path, k], one ?? {}, forms(items, one), title(one, k))));
  return [shown, path[0] === "positions" ? [] : make("div", { class: "bar" },
    listed.length ? make("select", { "aria-label": `kind of another entry of ${path.at(-1)}`,
      "data-own": "" }, listed.map((kind) => make("option", {}, kind))) : null,
    button(listed.length ? "Add" : "Add one like the last", add,
      { "aria-label": `add to ${path.at(-1)}` }))];
}

// A key that is not there yet: one of the schema's, or a name of the user's own.
function adding(path, data, possible, label) {
  const keys = new Set(possible.flatMap((one) => Object.keys(one.properties ?? {})));
  const known = [...keys].filter((key) => !(key in data));
  if (!known.length && !possible.some((one) => one.additionalProperties)) return [];
  const list = `keys-${path.join("-")}`;
  const add = ({ currentTarget: { parentElement, value } }) => {
    const name = parentElement.querySelector("input").value.trim();
    if (name && value.trim()) set([...path, name], value);
  };
  return make("details", { id: `add-${path.join("-")}` },
    make("summary", {}, `add to ${spaced(label)}`),
    make("input", { list, placeholder: "another key", "aria-label": `another key of ${label}` }),
    make("datalist", { id: list }, known.map((one) =>
      make("option", { value: one }, property(possible, one).description ?? ""))),
    make("input", { placeholder: "value", "aria-label": `value of another key of ${label}`,
      onchange: add }));
}

const NUMBER = /^(-?\d+(?:\.\d+)?)(\s*[^\d\s]*)$/;
// The value by some steps more, each a tenth of its size.
function stepped(text, steps) {
  const [, number, unit] = NUMBER.exec(text) ?? [];
  if (number === undefined) return null;
  const digits = 1 - Math.floor(Math.log10(Math.abs(Number(number)) || 10));
  const value = Number(number) + steps * 10 ** -digits;
  return `${Number(value.toFixed(Math.max(0, digits)))}${unit}`;
}

async function state({ target: { dataset, value }, target }) {
  if (!dataset.path) return;
  if (!(await set(JSON.parse(dataset.path), value))) target.classList.add("bad-field");
}

let waiting = null;
$("forms").onchange = state;
// A number with its unit is changed by the arrow keys, and by dragging its name.
$("forms").onkeydown = (event) => {
  const { target } = event;
  const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
  const next = sign && target.dataset.path && stepped(target.value, sign);
  if (!next) return;
  event.preventDefault();
  target.value = next;
  clearTimeout(waiting);
  waiting = setTimeout(state, 400, { target });
};

let dragged = null; // the field of a number whose name is dragged, and what was there
$("forms").onpointerdown = ({ target, clientX, pointerId }) => {
  if (!target.matches(".handle")) return;
  const input = target.parentElement.querySelector("input");
  dragged = { input, before: input.value, clientX };
  target.setPointerCapture(pointerId);
};
$("forms").onpointermove = ({ clientX }) => {
  if (!dragged) return;
  const { input, before, clientX: start } = dragged;
  input.value = stepped(before, Math.round((clientX - start) / 8)) ?? before;
};
$("forms").onpointerup = $("forms").onpointercancel = drop;
document.addEventListener("keydown", (event) => { if (event.key === "Escape") drop(event); });
function drop({ type }) {
  const { input, before } = dragged ?? {};
  dragged = null;
  if (!input || input.value === before) return;
  if (type === "pointerup") state({ target: input });
  else input.value = before;
}
