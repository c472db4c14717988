// Forms for the sections of a design, made from the schema of its file.
import { make } from "./page.js";

const SECTIONS = [
  "title", "machine", "error_model", "probes", "artefacts", "positions", "calibration",
  "influences", "evaluation", "target_uncertainty", "coverage_factor", "expected_rank_deficiency",
];

function resolve(schema, root) {
  let found = schema;
  while (found?.$ref) found = found.$ref.split("/").slice(1).reduce((at, key) => at[key], root);
  return found ?? {};
}

// The forms that data may have there: alternatives are narrowed to those whose constants fit.
function forms(schema, data, root) {
  const found = resolve(schema, root);
  const alternatives = found.anyOf ?? found.oneOf;
  if (!alternatives) return [found];
  const every = alternatives.flatMap((one) => forms(one, data, root));
  const fitting = every.filter((one) => fits(one, data, root));
  return fitting.length ? fitting : every;
}

function fits(schema, data, root) {
  if (data === undefined) return true;
  if (Array.isArray(data)) return schema.type === "array";
  if (data !== null && typeof data === "object") {
    const { type, properties, additionalProperties } = schema;
    if (type !== "object" && !properties && !additionalProperties) return false;
    return Object.entries(schema.properties ?? {}).every(([key, value]) => {
      const part = resolve(value, root);
      return part.const === undefined || data[key] === part.const;
    });
  }
  return schema.type !== "object" && schema.type !== "array";
}

function choices(schemas, root) {
  const found = new Set();
  for (const one of schemas) {
    if (one.const !== undefined) found.add(String(one.const));
    (one.enum ?? []).forEach((value) => found.add(String(value)));
    if (one.type === "boolean") ["true", "false"].forEach((value) => found.add(value));
  }
  const free = schemas.some((one) =>
    one.enum === undefined && one.const === undefined && !["boolean", "null"].includes(one.type));
  return free ? null : [...found];
}

// A value as the file would state it, in one line.
export function flow(value) {
  if (value === null || value === undefined) return "";
  if (Array.isArray(value)) return `[${value.map(flow).join(", ")}]`;
  if (typeof value === "object") {
    const entries = Object.entries(value).map(([key, one]) => `${key}: ${flow(one)}`);
    return `{${entries.join(", ")}}`;
  }
  return String(value);
}

// Only sections that are open have fields, and only those whose data have changed are made anew.
export function build(container, data, schema, messages, onSet) {
  for (const section of SECTIONS) {
    const part = schema.properties?.[section];
    if (!part) continue;
    let details = container.querySelector(`:scope > [data-section="${section}"]`);
    if (!details) {
      details = make("details", { "data-section": section });
      const description = resolve(part, schema).description ?? part.description ?? "";
      const heading = section.replaceAll("_", " ");
      details.append(make("summary", { title: description }, heading), make("div"));
      details.addEventListener("toggle", () => details.fill());
      container.append(details);
    }
    const wrong = messages.filter((one) => one.path.split(/[.[]/)[0] === section);
    details.classList.toggle("wrong", wrong.length > 0);
    const said = JSON.stringify([data?.[section], wrong]);
    details.fill = () => {
      if (!details.open || details.said === said) return;
      details.said = said;
      const unfolded = [...details.querySelectorAll("details[open]")];
      const open = new Set(unfolded.map((one) => one.dataset.of));
      const box = make("div");
      const form = { schema, messages, onSet };
      fields(box, [section], data?.[section], part, form, section);
      box.querySelectorAll("details").forEach((one) => {
        one.open = open.has(one.dataset.of);
      });
      details.lastElementChild.replaceWith(box);
    };
    details.fill();
  }
}

const isMapping = (one) => one !== null && typeof one === "object" && !Array.isArray(one);

// `form` has the schema, the messages and what sets a value.
function fields(into, path, data, part, form, label) {
  const possible = forms(part, data, form.schema);
  const deep = path.length > 1;
  if (isMapping(data)) {
    for (const [key, value] of Object.entries(data)) {
      const name = deep ? `${label}.${key}` : key;
      const { schema } = form;
      const below = key === "kind" ? kinds(part, schema) : property(possible, key, schema);
      fields(into, [...path, key], value, below, form, name);
    }
    adding(into, path, data, possible, form, label);
  } else if (Array.isArray(data) && data.some(isMapping)) {
    into.append(table(path, data, possible.find((one) => one.items)?.items ?? {}, form));
  } else {
    const title = description(part, possible, form);
    const handle = make("span", { title }, deep ? label : "value");
    const [input, ...errors] = control(path, data, possible, form, handle);
    into.append(make("label", {}, handle, input, ...errors));
  }
}

// All kinds that there are, not the present one alone.
function kinds(part, schema) {
  const every = forms(part, undefined, schema).map((one) => one.properties?.kind);
  return { anyOf: every.filter(Boolean) };
}

function description(part, possible, { schema }) {
  return part.description ?? resolve(part, schema).description ?? possible[0]?.description ?? "";
}

// The field of a value, and what is wrong with it.
function control(path, data, possible, form, handle) {
  const options = data === undefined ? null : choices(possible, form.schema);
  const said = flow(data);
  let input;
  if (options && options.length > 1) {
    input = make("select", {}, ...[...new Set([said, ...options])].map((one) =>
      new Option(one, one, one === said, one === said)));
  } else {
    input = make("input", { value: said, placeholder: data === undefined ? "not stated" : "" });
    draggable(input, handle, () => form.onSet(path, input.value, input));
  }
  input.dataset.path = JSON.stringify(path);
  input.addEventListener("change", () => form.onSet(path, input.value, input));
  const joined = (text, step) =>
    (typeof step === "number" ? `${text}[${step}]` : text ? `${text}.${step}` : step);
  const steps = path.reduce(joined, "");
  const errors = form.messages.filter((one) => one.path === steps)
    .map((message) => make("span", { class: "field-error" }, message.text));
  if (errors.length) input.classList.add("bad-field");
  return [input, ...errors];
}

// A list of entries, each a row; keys that only some have are columns too.
function table(path, data, part, form) {
  const leaves = (value, steps) => (!isMapping(value) ? [steps]
    : Object.entries(value).flatMap(([key, one]) => leaves(one, [...steps, key])));
  const columns = new Map(data.flatMap((entry) => leaves(entry, []))
    .map((steps) => [steps.join("."), steps]));
  const below = (value, steps) => steps.reduce((found, step) => found?.[step], value);
  const cell = (entry, k, steps) => {
    const { schema } = form;
    const parts = steps[0] === "kind" ? forms(kinds(part, schema), undefined, schema)
      : steps.reduce((schemas, step, depth) =>
        forms(property(schemas, step, schema), below(entry, steps.slice(0, depth + 1)), schema),
      forms(part, entry, schema));
    const found = control([...path, k, ...steps], below(entry, steps), parts, form);
    found[0].setAttribute("aria-label", `${steps.join(" ")} of ${entry?.name ?? k + 1}`);
    return make("td", {}, ...found);
  };
  const rows = data.map((entry, k) => make("tr", {},
    ...[...columns.values()].map((steps) => cell(entry, k, steps)),
    make("td", {}, make("button", { title: "remove", "aria-label": `remove ${entry?.name ?? k + 1}`,
      onclick: () => form.onSet([...path, k], "") }, "×"))));
  const again = data.at(-1);
  const add = make("button", { onclick: () => form.onSet([...path, "+"], flow(again)) },
    "Add one like the last");
  return make("div", { class: "scrolled", tabindex: "0" },
    make("table", {},
      make("thead", {}, make("tr", {}, ...[...columns.keys()].map((name) =>
        make("th", { scope: "col" }, name)), make("th", {}))),
      make("tbody", {}, ...rows)), path[0] === "positions" ? "" : add);
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

// A number with its unit is changed by the arrow keys, and by dragging its name.
function draggable(input, handle, onDone) {
  if (!NUMBER.test(input.value)) return;
  let waiting = null;
  input.addEventListener("keydown", (event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    const next = sign && stepped(input.value, sign);
    if (!next) return;
    event.preventDefault();
    input.value = next;
    clearTimeout(waiting);
    waiting = setTimeout(onDone, 400);
  });
  if (!handle) return;
  handle.classList.add("handle");
  handle.addEventListener("pointerdown", (event) => {
    const before = input.value;
    handle.setPointerCapture(event.pointerId);
    const move = (next) => {
      input.value = stepped(before, Math.round((next.clientX - event.clientX) / 8)) ?? before;
    };
    const end = (last) => {
      handle.removeEventListener("pointermove", move);
      document.removeEventListener("keydown", cancel);
      if (last.type !== "pointerup") input.value = before;
      else if (input.value !== before) onDone();
    };
    const cancel = (key) => { if (key.key === "Escape") end(key); };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("pointerup", end, { once: true });
    handle.addEventListener("pointercancel", end, { once: true });
    document.addEventListener("keydown", cancel);
  });
}

function property(possible, key, root) {
  for (const one of possible) {
    if (one.properties?.[key]) return one.properties[key];
    if (typeof (one.additionalProperties ?? false) === "object") return one.additionalProperties;
  }
  return {};
}

// A key that is not there yet: one of the schema's, or a name of the user's own.
function adding(into, path, data, possible, { schema, onSet }, label) {
  const keys = new Set(possible.flatMap((one) => Object.keys(one.properties ?? {})));
  const known = [...keys].filter((key) => !(key in data));
  const isOpen = possible.some((one) => one.additionalProperties);
  if (!known.length && !isOpen) return;
  const list = `keys-${path.join("-")}`;
  const names = make("datalist", { id: list });
  known.forEach((key) =>
    names.append(new Option(property(possible, key, schema).description ?? "", key)));
  const key = make("input", { list, placeholder: "another key",
    "aria-label": `another key of ${label}`, "data-key": path.join(".") });
  const value = make("input", { placeholder: "value",
    "aria-label": `value of another key of ${label}` });
  const set = () => {
    const name = key.value.trim();
    if (name && value.value.trim()) onSet([...path, name], value.value, value);
  };
  value.addEventListener("change", set);
  into.append(make("details", { "data-of": path.join(".") },
    make("summary", {}, `add to ${label.replaceAll("_", " ")}`), key, names, value));
}
