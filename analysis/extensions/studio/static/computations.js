// Computations beside the page: suggestions, sweeps, plans, fits.
import { $, act, ask, make, micro, page, share, tell } from "./page.js";

let suggestions = [];
let fits = null;
let running = []; // computations as they were when they were asked after last

// What is drawn of them in the view.
export function drawn() {
  page.view.ghost(current().filter((one) => one.shown).flatMap((one) => one.places));
  if (fits?.fingerprint !== page.state.fingerprint) fits = null;
  page.view.residuals(fits, fits?.scale);
  suggested();
  computations(running);
}

export function forget_suggestions() {
  suggestions = [];
}

function current() {
  return suggestions.filter((one) => one.fingerprint === page.state.fingerprint);
}

// The settings of the next position that lowers U6 most for each reading, if it was asked for.
export function candidate() {
  const before = page.state.design?.quantities?.find(({ symbol }) => symbol === "U6")?.average;
  const gain = ({ average, place }) => (before - (average ?? before)) / place.readings;
  const added = current().filter((one) => one.settings);
  return added.sort((one, other) => gain(other) - gain(one) || 0)[0]?.settings;
}

function suggested() {
  const shown = current();
  $("suggestions").replaceChildren(...shown.map(suggestion));
  if (suggestions.length && !shown.length) {
    $("suggestions").append(
      make("p", {}, "The design has changed since these were asked for; ask again."));
  }
}

function suggestion(one, k) {
  const is_open = one.average === null || one.average === undefined;
  const figure = !is_open
    ? `U6 ${micro(one.average)} µm on average, ${micro(one.maximum)} µm at most`
    : one.deficiency ? `rank deficiency ${one.deficiency} left` : "";
  const weak = one.weak
    ? `; ${one.weak} ${one.weak > 1 ? "directions stay" : "direction stays"} weak` : "";
  const toggle = () => {
    one.shown = !one.shown;
    page.show();
  };
  return make("li", {}, make("div", {}, one.words),
    make("div", {}, figure, weak, one.faint ? "; barely determined" : ""),
    make("div", { class: "bar" },
      make("button", { "aria-pressed": String(!!one.shown), "data-focus": `show ${k}`,
        onclick: toggle }, one.shown ? "hide" : "show"),
      make("button", { "data-apply": "", "data-focus": `apply ${k}`, onclick: () => apply(one) },
        "apply")));
}

function apply(one) {
  suggestions = suggestions.filter((other) => other !== one);
  if (one.settings) act({ do: "add", settings: one.settings }, "position added");
  else if (one.plan) act(
    { do: "plan", positions: one.plan, calibration: one.calibration }, "planned; undo leads back");
  else act({ do: "repair", edits: one.edits }, "applied");
}

const BESIDE = "computing beside the studio …";
// What refuses the start, or nothing.
export async function start(job, settings = {}) {
  let refused = "";
  try {
    await ask("/api/start", { job, settings });
    tell(BESIDE);
  } catch (error) {
    refused = error.message;
    tell(refused, true);
  }
  poll();
  return refused;
}

const taken = new Set();
let polling = null;
export async function poll() {
  clearTimeout(polling);
  let list;
  try {
    list = await ask("/api/jobs");
  } catch (error) {
    tell(error.message, true);
    return;
  }
  for (const job of list.filter(({ id, state }) => state === "done" && !taken.has(id))) {
    taken.add(job.id);
    take(job);
  }
  running = list;
  computations(running);
  if (list.some((job) => job.state === "running")) polling = setTimeout(poll, 300);
  else if ($("notice").textContent === BESIDE) tell("");
}

function take({ job, result, fingerprint }) {
  if (job === "suggest" || job === "next") {
    suggestions = result.map((one, k) =>
      ({ ...one, places: one.places ?? [one.place], fingerprint, shown: k === 0 }));
    const none = job === "suggest"
      ? "nothing is undetermined or weak, or nothing was found that helps"
      : "no further position fits";
    tell(suggestions.length ? "" : none);
    page.show();
    $("suggested").scrollIntoView({ block: "nearest" });
  }
  if (job === "plan") {
    suggestions = [{ ...result, fingerprint, shown: true }];
    page.show();
  }
  if (job === "fit" && result.residuals) {
    const sizes = result.residuals.value.map((one) => Math.hypot(...one));
    const scale = (0.06 * page.view.size) / Math.max(...sizes, 1e-12);
    fits = { ...result.residuals, fingerprint, scale };
    page.show();
    const times = Number(scale.toPrecision(2)).toLocaleString("en");
    tell(`residuals are drawn ${times} times their size`);
  }
}

function computations(list) {
  // What was suggested is shown with the suggestions.
  const told = list.filter((job) =>
    job.state !== "done" || !["suggest", "next"].includes(job.job));
  // An item is made anew only where it has changed: nobody can press a button that is replaced
  // all the time.
  const there = new Map([...$("jobs").children].map((item) => [item.dataset.said, item]));
  const items = told.map((job) => {
    const is_current = job.fingerprint === page.state.fingerprint;
    const said = JSON.stringify([page.state.session, job.id, job.state, job.page, is_current,
      job.ending]);
    const item = there.get(said) ?? computation(job, said, is_current);
    const step = job.state === "running" && job.step ? `: ${job.step}` : "";
    item.querySelector(".step").textContent = step;
    return item;
  });
  const { children } = $("jobs");
  if (items.length !== children.length || items.some((item, k) => item !== children[k])) {
    $("jobs").replaceChildren(...items);
  }
}

function computation(job, said, is_current) {
  const stop = async () => {
    await ask("/api/stop", { id: job.id });
    poll();
  };
  const lines = job.state === "done" && job.result?.lines
    ? [...(job.result.notes ?? []), ...job.result.lines].join("\n") : null;
  return make("li", { "data-state": job.state, "data-said": said },
    make("strong", {}, job.job), ` ${job.state}`, make("span", { class: "step" }), " ",
    make("button", { "data-focus": `job ${job.id}`, onclick: stop },
      job.state !== "running" ? "close" : job.ending ? "stop without a plan" : "stop"),
    job.ending ? make("small", {}, " ends with the best so far") : null,
    " ",
    job.page ? make("a", { href: `/pages/${job.id}`, target: "_blank", rel: "noopener",
      "data-page": "" }, "open its page") : null,
    is_current ? null : make("small", {}, " of an earlier design"),
    job.state === "failed" ? make("pre", {}, String(job.result)) : null,
    lines === null ? null : make("pre", { tabindex: "0" }, lines),
    job.state === "done" && job.job === "sweep" ? table(job.result, job.page) : null,
  );
}

const MOST_ROWS = 60; // of a sweep's cells in its table here
const FIGURES = ["rank deficiency", "U6 average µm", "U6 max. µm", "lengths within target"];
function table(found, has_page) {
  // The last keys of paths, which tell enough where there is little room.
  const short = (paths) => paths.map((path) => path.split(".").at(-1)).join(", ");
  const heads = [
    ...found.axes.map((paths) => make("th", { title: paths.join(", ") }, short(paths))),
    ...FIGURES.map((head) => make("th", {}, head))];
  const figures = (cell) => [
    String(cell.deficiency), micro(cell.average), micro(cell.maximum),
    share(cell.within) || "no target"].map((text) => make("td", {}, text));
  const rows = found.cells.slice(0, MOST_ROWS).map((cell) => make("tr", {},
    ...cell.values.map((value) => make("td", {}, value)),
    ...(cell.reason ? [make("td", { colspan: "4" }, cell.reason)] : figures(cell))));
  const rest = found.cells.length - MOST_ROWS;
  return make("div", { class: "scrolled", tabindex: "0" },
    make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows)),
    rest > 0 ? make("p", {}, `${rest} more cases are on the page`) : null,
    has_page ? null
      : make("p", {}, "its page needs the extra report: python -m pip install 'ballplate[report]'"),
  );
}

// A dialogue with some fields, true if it was confirmed.
function opened(question, fields) {
  $("question").textContent = question;
  $("fields").replaceChildren(...fields);
  $("dialog").returnValue = "";
  $("dialog").showModal();
  return new Promise((resolve) => {
    const done = () => resolve($("dialog").returnValue === "ok");
    $("dialog").addEventListener("close", done, { once: true });
  });
}

export async function dialog(question, fields) {
  const inputs = fields.map(([name, value]) => [name, make("input", { name, value })]);
  const labels = inputs.map(([name, input]) => make("label", {}, name, input));
  return (await opened(question, labels)) ? inputs.map(([, input]) => input.value) : null;
}

// Paths of all values of a design, entries of lists by their names where they have any.
function keys(data, path) {
  if (Array.isArray(data)) {
    return data.flatMap((one, k) => keys(one, `${path}[${one?.name ?? k}]`));
  }
  if (data === null || typeof data !== "object") return [path];
  const below = Object.entries(data)
    .flatMap(([key, one]) => keys(one, path ? `${path}.${key}` : key));
  return path ? [path, ...below] : below;
}

export async function sweep() {
  const paths = keys(page.state.data, "").map((path) => new Option(path, path));
  const list = make("datalist", { id: "paths" }, ...paths);
  const field = (words, axis, value) =>
    make("label", {}, words, make("input", { value, "data-axis": axis, autocomplete: "off",
      list: axis === "paths" ? "paths" : undefined }));
  const row = (path, values) => make("fieldset", {},
    field("keys, separated by commas", "paths", path),
    field("values, separated by semicolons", "values", values));
  const rows = make("div", {}, row("machine.repeatability", "0.1 um; 0.2 um; 0.4 um"));
  const add = () => {
    rows.append(row("", ""));
    rows.lastElementChild.querySelector("input").focus();
  };
  const more = make("button", { type: "button", id: "more-axes", onclick: add }, "Another axis");
  const part = (one, key, mark) => one.querySelector(`[data-axis=${key}]`).value.split(mark)
    .map((text) => text.trim()).filter(Boolean);
  const error = make("p", { class: "field-error", role: "alert" });
  const question = "Compute every combination of some values";
  while (await opened(question, [rows, list, more, ...(rows.contains(error) ? [] : [error])])) {
    const axes = [...rows.children]
      .map((one) => ({ paths: part(one, "paths", ","), values: part(one, "values", ";") }))
      .filter((one) => one.paths.length);
    const refused = await start("sweep", { axes });
    if (!refused) return;
    // Beside the axis that is meant, whose key the words begin with, or below all.
    const meant = [...rows.children].find((one) =>
      part(one, "paths", ",").some((path) => refused.startsWith(`${path}: `)));
    error.textContent = refused;
    if (meant) meant.append(error);
    else error.remove();
  }
}

export async function fit(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (let k = 0; k < bytes.length; k += 32768) {
    text += String.fromCharCode(...bytes.subarray(k, k + 32768));
  }
  start("fit", { name: file.name, content: btoa(text) });
}
