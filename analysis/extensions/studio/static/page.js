// What all parts of the page share: what is known, requests, and elements of the page.

export const $ = (id) => document.getElementById(id);

export const page = {
  state: null, // the studio's last answer
  schema: null,
  selected: null, // the name of the chosen position
  motion: null, // the number of the direction that swings
  typed: false, // the text beside the design has changes that are not applied
  view: null,
  show: () => {}, // draws everything anew
};

export const micro = (value) =>
  value === null || value === undefined || Number.isNaN(value)
    ? "undetermined" : `${Number((1e6 * value).toPrecision(3))}`;
export const share = (value) =>
  value === null || value === undefined ? "" : `${Math.floor(1000 * value) / 10} %`;

export function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => {
    if (key === "class") made.className = value;
    else if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== undefined && value !== false) {
      made.setAttribute(key, value === true ? "" : value);
    }
  });
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export function options(select, names, chosen) {
  select.replaceChildren(
    ...names.map((name) => new Option(name, name, name === chosen, name === chosen)));
}

export function tell(text, bad = false) {
  $("notice").textContent = text;
  $("notice").classList.toggle("bad", bad);
}

// Parts of the page are made anew; whoever works with the keyboard stays where he was.
export function focus() {
  const active = document.activeElement;
  if (!active || active === document.body) return null;
  if (active.id) return `#${CSS.escape(active.id)}`;
  const owner = active.closest("[id]");
  const name = ["data-path", "data-key", "data-motion", "data-focus", "aria-label"]
    .find((key) => active.hasAttribute(key));
  return owner && name
    ? `#${CSS.escape(owner.id)} [${name}="${CSS.escape(active.getAttribute(name))}"]` : null;
}

export function refocus(selector) {
  const found = selector && document.querySelector(selector);
  if (found && found !== document.activeElement) found.focus({ preventScroll: true });
}

const KEPT = "Start it again with the same command: changes that are not saved are there again.";
const UNKEPT = "Changes are not saved, and could not be kept in the folder of the file: copy the"
  + " text of the file before you leave this page.";

export async function ask(path, body) {
  const options = body === undefined ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  };
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    await_studio();
    const isKept = !page.state || page.state.recoverable;
    throw new Error(`The studio does not answer. ${isKept ? KEPT : UNKEPT}`);
  }
  const text = await response.text();
  let data;
  try {
    data = JSON.parse(text);
  } catch {
    throw new Error(text.trim());
  }
  if (!response.ok || data.error !== undefined) {
    throw Object.assign(new Error(data.error), { outdated: data.outdated });
  }
  return data;
}

let lost = null; // waits for a studio that does not answer
function await_studio() {
  clearTimeout(lost);
  lost = setTimeout(async () => {
    lost = null;
    try {
      page.state = await ask("/api/state");
      page.show();
      tell("the studio answers again");
    } catch (error) {
      tell(error.message, true);
    }
  }, 2000);
}

// What another window did, or a studio that was started anew, is shown instead of what was here.
export async function refresh() {
  try {
    const { state } = page;
    const found = await ask("/api/state");
    // What was asked for before the last change and answered after it is not shown.
    const isNew = found.session !== state.session || found.revision > page.state.revision;
    const isComputed =
      found.revision === page.state.revision && found.pending !== page.state.pending;
    if (isNew || isComputed) {
      page.state = found;
      page.show();
    } else watch();
  } catch (error) {
    tell(error.message, true);
  }
}

let watching = null;
// Figures that were not there in time are asked for until they are.
export function watch() {
  clearTimeout(watching);
  if (page.state.pending) watching = setTimeout(() => (acting ? watch() : refresh()), 500);
}

export const latency = [];
let queue = Promise.resolve();
let acting = 0;
// Change the design. Changes come one after the other: each goes on from the answer before.
export function act(action, said = "") {
  acting += 1;
  const next = queue.then(async () => {
    const slow = setTimeout(() => tell("computing …"), 400);
    const started = performance.now();
    try {
      const { revision, session } = page.state;
      page.state = await ask("/api/do", { ...action, revision, session });
      const answered = performance.now();
      clearTimeout(slow);
      tell(said);
      page.show();
      latency.push({ answered: answered - started, shown: performance.now() - started });
      return true;
    } catch (error) {
      clearTimeout(slow);
      tell(error.message, true);
      if (error.outdated) await refresh();
      else page.show();
      return false;
    }
  });
  queue = next.catch(() => {}).finally(() => { acting -= 1; });
  return next;
}

let waiting = null;
let previewing = false;
// Ask for the figures of a design as it would be, the last one that is asked for alone.
export async function preview(action, onFigures) {
  // Of the design as it is now: what comes after the drop is of another one.
  waiting = { ...action, revision: page.state.revision, session: page.state.session };
  if (previewing) return;
  previewing = true;
  while (waiting) {
    const next = waiting;
    const isMeant = () => !acting && page.state.revision === next.revision;
    waiting = null;
    try {
      const design = isMeant() ? await ask("/api/preview", next) : null;
      if (!design || !isMeant()) continue;
      tell("");
      onFigures(design);
    } catch (error) {
      if (isMeant()) tell(error.message, true);
    }
  }
  previewing = false;
}
