// Forms for the sections of a design, made from the schema of its file.

const SECTIONS = [
  "title", "machine", "error_model", "probes", "artefacts", "positions", "calibration", "influences", "evaluation",
  "target_uncertainty", "coverage_factor", "expected_rank_deficiency",
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

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => {
    if (key === "class") made.className = value;
    else if (value !== undefined) made.setAttribute(key, value);
  });
  made.append(...children);
  return made;
}

// Only sections that are open have fields, and only those whose data have changed are made anew.
export function build(container, data, schema, messages, onSet) {
  for (const section of SECTIONS) {
    const part = schema.properties?.[section];
    if (!part) continue;
    let details = container.querySelector(`:scope > [data-section="${section}"]`);
    if (!details) {
      details = element("details", { "data-section": section });
      const description = resolve(part, schema).description ?? part.description ?? "";
      const heading = section.replaceAll("_", " ");
      details.append(element("summary", { title: description }, heading), element("div"));
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
      const box = element("div");
      fields(box, [section], data?.[section], part, schema, messages, onSet, section);
      box.querySelectorAll("details").forEach((one) => {
        one.open = open.has(one.dataset.of);
      });
      details.lastElementChild.replaceWith(box);
    };
    details.fill();
  }
}

function fields(into, path, data, part, root, messages, onSet, label) {
  const possible = forms(part, data, root);
  const description =
    part.description ?? resolve(part, root).description ?? possible[0]?.description ?? "";
  const isMapping = (one) => one !== null && typeof one === "object" && !Array.isArray(one);
  const deep = path.length > 1;
  if (isMapping(data)) {
    for (const [key, value] of Object.entries(data)) {
      const below = property(possible, key, root);
      const name = deep ? `${label}.${key}` : key;
      fields(into, [...path, key], value, below, root, messages, onSet, name);
    }
    adding(into, path, data, possible, root, onSet, label);
    return;
  }
  if (Array.isArray(data) && data.some(isMapping)) {
    data.forEach((value, k) => {
      const below = possible.find((one) => one.items)?.items ?? {};
      const name = deep ? `${label}[${k + 1}]` : value?.name ?? `${k + 1}`;
      fields(into, [...path, k], value, below, root, messages, onSet, name);
    });
    return;
  }
  const options = data === undefined ? null : choices(possible, root);
  const said = flow(data);
  let input;
  if (options && options.length > 1) {
    input = element("select");
    [...new Set([said, ...options])].forEach((one) =>
      input.append(new Option(one, one, one === said, one === said)));
  } else {
    input = element("input", { value: said, placeholder: data === undefined ? "not stated" : "" });
  }
  input.dataset.path = JSON.stringify(path);
  input.addEventListener("change", () => onSet(path, input.value, input));
  const name = element("span", { title: description }, label === path[0] ? "value" : label);
  const box = element("label", {}, name, input);
  const joined = (text, step) =>
    (typeof step === "number" ? `${text}[${step}]` : text ? `${text}.${step}` : step);
  const steps = path.reduce(joined, "");
  for (const message of messages.filter((one) => one.path === steps)) {
    input.classList.add("bad-field");
    box.append(element("span", { class: "field-error" }, message.text));
  }
  into.append(box);
}

function property(possible, key, root) {
  for (const one of possible) {
    if (one.properties?.[key]) return one.properties[key];
    if (typeof (one.additionalProperties ?? false) === "object") return one.additionalProperties;
  }
  return {};
}

// A key that is not there yet: one of the schema's, or a name of the user's own.
function adding(into, path, data, possible, root, onSet, label) {
  const keys = new Set(possible.flatMap((one) => Object.keys(one.properties ?? {})));
  const known = [...keys].filter((key) => !(key in data));
  const isOpen = possible.some((one) => one.additionalProperties);
  if (!known.length && !isOpen) return;
  const list = `keys-${path.join("-")}`;
  const names = element("datalist", { id: list });
  known.forEach((key) =>
    names.append(new Option(property(possible, key, root).description ?? "", key)));
  const key = element("input", { list, placeholder: "another key",
    "aria-label": `another key of ${label}`, "data-key": path.join(".") });
  const value = element("input", { placeholder: "value",
    "aria-label": `value of another key of ${label}` });
  const set = () => {
    const name = key.value.trim();
    if (name && value.value.trim()) onSet([...path, name], value.value, value);
  };
  value.addEventListener("change", set);
  into.append(element("details", { "data-of": path.join(".") },
    element("summary", {}, `add to ${label.replaceAll("_", " ")}`), key, names, value));
}
