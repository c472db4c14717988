// What all parts of the page share: what is known, requests, and elements of the page.

export const $ = (id) => document.getElementById(id);

export const page = {
  state: null, // the studio's last answer
  design: null, // that of the state, or as it would be while something moves
  schema: null,
  selected: null, // the name of the chosen position
  effects: [], // of influences that the file does not state, with usual values
  motion: null, // the number of the direction that swings
  stopped: false, // nothing swings unless it is asked for
  typed: false, // the text beside the design has changes that are not applied
  view: null,
  show: () => {}, // draws everything anew
};

export const micro = (value) =>
  value === null || value === undefined || Number.isNaN(value)
    ? "undetermined" : `${Number((1e6 * value).toPrecision(3))}`;
export const share = (value) =>
  value === null || value === undefined ? "" : `${Math.floor(1000 * value) / 10} %`;

// An element; of its children, lists are taken apart and what is absent is left out.
export function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => {
    if (key.startsWith("on")) made[key] = value;
    else if (value !== undefined && value !== false) {
      made.setAttribute(key, value === true ? "" : value);
    }
  });
  made.handlers = Object.keys(attributes).filter((key) => key.startsWith("on"));
  const absent = [null, undefined, false];
  made.append(...children.flat(Infinity).filter((child) => !absent.includes(child)));
  return made;
}

export const button = (words, onclick, attributes = {}) =>
  make("button", { type: "button", ...attributes, onclick }, words);

// Head and body of a table; cells are contents, or elements of their own.
export const table = (heads, rows) => {
  const cell = (name, content) => (/^T[DH]$/.test(content?.tagName) ? content
    : make(name, name === "th" ? { scope: "col" } : {}, content));
  const row = (name) => (cells) => make("tr", {}, cells.map((content) => cell(name, content)));
  return [make("thead", {}, row("th")(heads)), make("tbody", {}, rows.map(row("td")))];
};

// Give a container other children. What is alike stays, with focus, scroll and folds, and with
// what was typed: so handlers find their element in the event.
export function fill(container, ...children) {
  become(container, make("div", {}, children));
}

function become(old, made) {
  const [there, wanted] = [[...old.childNodes], [...made.childNodes]];
  wanted.forEach((node, k) => {
    const { value } = node;
    const present = there[k];
    if (!present) old.append(node);
    else if (present.nodeName !== node.nodeName || present.id !== node.id) {
      present.replaceWith(node);
    } else if (node.nodeType === Node.TEXT_NODE) present.data = node.data;
    else {
      dress(present, node);
      become(present, node);
      if (node.localName === "select" && !("own" in node.dataset)) present.value = value;
    }
  });
  there.slice(wanted.length).forEach((node) => node.remove());
}

function dress(old, made) {
  if (old.getAttribute("value") !== made.getAttribute("value")) old.value = made.value;
  if (made.type === "checkbox") old.checked = made.checked;
  [...old.attributes].filter(({ name }) => name !== "open" && !made.hasAttribute(name))
    .forEach(({ name }) => old.removeAttribute(name));
  [...made.attributes].forEach(({ name, value }) => old.setAttribute(name, value));
  [old, made].forEach(({ handlers = [] }) =>
    handlers.forEach((name) => { old[name] = made[name]; }));
  old.handlers = made.handlers;
}

export function options(select, names, chosen) {
  fill(select, names.map((name) => new Option(name, name, name === chosen)));
  select.value = chosen;
}

export function tell(text, bad = false) {
  $("notice").textContent = text;
  $("notice").classList.toggle("bad", bad);
}

const SILENT = "The studio does not answer.";
const KEPT = "Start it again with the same command: changes that are not saved are there again.";
const UNKEPT = "Changes are not saved, and could not be kept in the folder of the file: copy the"
  + " text of the file before you leave this page.";

export async function ask(path, body) {
  const request = body === undefined ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  };
  let response;
  try {
    response = await fetch(path, request);
  } catch {
    refresh_in(2000);
    const isKept = !page.state || page.state.recoverable;
    throw new Error(`${SILENT} ${isKept ? KEPT : UNKEPT}`);
  }
  const text = await response.text();
  const data = /^[[{]/.test(text) ? JSON.parse(text) : { error: text.trim() };
  if (data.error !== undefined) throw Object.assign(new Error(data.error), data);
  return data;
}

const views = {}; // by name: the last answer and what it is of, what is asked and wanted
const key_of = (body) => JSON.stringify([page.state.fingerprint, body]);
// Mark what shows a view of an earlier design.
export const mark = (name, body) => document.querySelectorAll(`[data-of=${name}]`)
  .forEach((one) => one.classList.toggle("stale", views[name]?.of !== key_of(body)));

// Show a view of the present design, once nothing moves; what came after a later question is not.
export function follow(name, body, show, after = 300) {
  const { fingerprint } = page.state;
  const view = (views[name] ??= {});
  const key = key_of(body);
  const finish = () => {
    if (view.of === key) show(view.answer);
    mark(name, body);
  };
  view.wanted = key;
  clearTimeout(view.wait);
  finish();
  if ([view.of, view.asked].includes(key)) return;
  view.wait = setTimeout(async () => {
    view.asked = key;
    const answer = await ask(`/api/${name}`, body).catch(({ message }) => ({ error: message }));
    if (view.asked === key) view.asked = null;
    if (view.wanted !== key || page.state.fingerprint !== fingerprint) return;
    if (answer.error) show(answer);
    else Object.assign(view, { answer, of: key });
    finish();
  }, after);
}

// What another window did, or a studio that was started anew, is shown instead of what was here.
export async function refresh() {
  try {
    const found = await ask("/api/state");
    const { session, revision, pending } = page.state ?? {};
    if ($("notice").textContent.startsWith(SILENT)) tell("the studio answers again");
    // What was asked for before the last change and answered after it is not shown.
    const isNew = found.session !== session || found.revision > revision;
    if (isNew || (found.revision === revision && found.pending !== pending)) {
      page.state = found;
      page.show();
    } else watch();
  } catch (error) {
    tell(error.message, true);
  }
}

let waiting = null;
function refresh_in(milliseconds) {
  clearTimeout(waiting);
  waiting = setTimeout(() => (acting ? refresh_in(milliseconds) : refresh()), milliseconds);
}

// Figures that were not there in time are asked for until they are.
export function watch() {
  if (page.state.pending) refresh_in(500);
}

let queue = Promise.resolve();
let acting = 0;
// Change the design, and return whether that was done. Changes come one after the other: each goes
// on from the answer before.
export function act(action, said = "") {
  acting += 1;
  queue = queue.then(async () => {
    const slow = setTimeout(() => tell("computing …"), 400);
    try {
      const { revision, session } = page.state;
      page.state = await ask("/api/do", { ...action, revision, session })
        .finally(() => clearTimeout(slow));
      tell(said);
      page.show();
      return true;
    } catch (error) {
      tell(error.message, true);
      if (error.outdated) await refresh();
      else page.show();
      return false;
    }
  }).catch(() => false).finally(() => { acting -= 1; });
  return queue;
}

let wanted = null;
let previewing = false;
// Ask for the figures of a design as it would be, the last one that is asked for alone; what comes
// after the drop is of another design.
export async function preview(action, onFigures) {
  wanted = action;
  if (previewing) return;
  previewing = true;
  while (wanted && !acting) {
    const { revision, session } = page.state;
    const asked = { ...wanted, revision, session };
    wanted = null;
    const design = await ask("/api/preview", asked).catch(({ message }) => ({ error: message }));
    if (acting || page.state.revision !== revision) break;
    tell(design.error ?? "", Boolean(design.error));
    if (!design.error) onFigures(design);
  }
  previewing = false;
}
