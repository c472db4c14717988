// Computations beside the page: suggestions, sweeps, plans, fits.
import { $, act, ask, button, fill, make, micro, page, share, table, tell } from "./page.js";

const OFFERING = ["suggest", "next", "plan"]; // what is drawn and applied
let running = []; // computations as they were when they were asked after last
const shown = new Map(); // by the number of a computation and of a suggestion

const is_current = ({ fingerprint, state }) =>
  fingerprint === page.state.fingerprint && state === "done";

// What is suggested for the present design: what was computed last.
function current() {
  const last = running.findLast((one) => is_current(one) && OFFERING.includes(one.job));
  return [last?.result ?? []].flat().map((one, k) => ({ ...one, key: `${last.id} ${k}`,
    shown: shown.get(`${last.id} ${k}`) ?? k === 0, places: one.places ?? [one.place] }));
}

// Everything of them, in the view and beside it.
export function drawn() {
  const { view } = page;
  view.ghost(current().filter((one) => one.shown).flatMap((one) => one.places));
  const fitted = running.findLast((one) => is_current(one) && one.result?.residuals);
  view.residuals(fitted?.result.residuals, fitted && magnified(fitted));
  lists();
}

// Of this file, what was suggested as suggestions; what failed of an earlier text nowhere.
function lists() {
  const { file, fingerprint } = page.state;
  fill($("suggestions"), current().map(suggestion));
  fill($("jobs"), running.filter((job) => job.file === file && (job.state === "failed"
    ? job.fingerprint === fingerprint
    : job.state === "running" || job.job === "plan" || !OFFERING.includes(job.job)
      || !job.result.length)).map(computation));
}

// How many times their size residuals are drawn.
function magnified({ result }) {
  const sizes = result.residuals.value.map((one) => Math.hypot(...one));
  return Number(((0.06 * page.view.size) / Math.max(...sizes, 1e-12)).toPrecision(2));
}

// The settings of the next position that lowers U6 most for each reading, if it was asked for.
export function candidate() {
  const before = page.state.design?.quantities?.find(({ symbol }) => symbol === "U6")?.average;
  const gain = ({ average, place }) => (before - (average ?? before)) / place.readings;
  const added = current().filter((one) => one.settings);
  return added.sort((one, other) => gain(other) - gain(one) || 0)[0]?.settings;
}

function suggestion(one) {
  const { average, maximum, deficiency, weak, faint, key } = one;
  const figure = Number.isFinite(average)
    ? `U6 ${micro(average)} µm on average, ${micro(maximum)} µm at most`
    : deficiency ? `rank deficiency ${deficiency} left` : "";
  const toggle = () => {
    shown.set(key, !one.shown);
    page.show();
  };
  return make("li", {}, make("div", {}, one.words), make("div", {}, figure,
    weak ? `; ${weak} ${weak > 1 ? "directions stay" : "direction stays"} weak` : "",
    faint ? "; barely determined" : ""),
  make("div", { class: "bar" },
    button(one.shown ? "hide" : "show", toggle, { "aria-pressed": String(one.shown) }),
    button("apply", () => apply(one), { "data-apply": "" })));
}

function apply({ settings, plan: positions, calibration, edits }) {
  if (settings) act({ do: "add", settings }, "position added");
  else if (positions) act({ do: "plan", positions, calibration }, "planned; undo leads back");
  else act({ do: "repair", edits }, "applied");
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

// A plan within the hours that are stated, or else those of the present positions.
export function plan() {
  const typed = $("hours").value.trim().replace(",", ".");
  const is_read = page.state.design?.scene.positions.some((place) => place.enabled);
  if (typed ? Number(typed) > 0 : is_read) {
    return start("plan", typed ? { hours: Number(typed) } : {});
  }
  $("hours").focus();
  return tell(typed ? `"${typed}" is no number of hours`
    : "There are no positions that hours could be taken from: state the hours.", true);
}

let polling = null;
export async function poll() {
  clearTimeout(polling);
  const before = new Map(running.map((job) => [job.id, job.state]));
  try {
    running = await ask("/api/jobs");
  } catch (error) {
    tell(error.message, true);
    return;
  }
  const is_new = running.some((job) => is_current(job) && before.get(job.id) === "running"
    && ["suggest", "next"].includes(job.job));
  // A plan of positions, or a fit, is drawn.
  if (running.some(({ id, state }) => before.get(id) !== state)) page.show();
  else lists();
  if (is_new) $("suggested").scrollIntoView({ block: "nearest" });
  if (running.some((job) => job.state === "running")) polling = setTimeout(poll, 300);
  else if ($("notice").textContent === BESIDE) tell("");
}

const NOTHING = { suggest: "nothing was found that determines more",
  next: "no further position fits" };

function computation(job) {
  const { id, state, result, step } = job;
  const isDone = state === "done";
  const is_old = job.fingerprint !== page.state.fingerprint;
  const stop = async () => {
    await ask("/api/stop", { id });
    poll();
  };
  const fitted = isDone && result?.residuals
    ? [`residuals are drawn ${magnified(job).toLocaleString("en")} times their size`] : [];
  const text = state === "failed" ? String(result) : isDone && NOTHING[job.job]
    ? NOTHING[job.job] : isDone && result?.lines
      ? [...fitted, ...(result.notes ?? []), ...result.lines].join("\n") : null;
  return make("li", { "data-state": state, id: `job-${id}` },
    make("strong", {}, job.job), ` ${state}`,
    make("span", { class: "step" }, state === "running" && step ? `: ${step}` : ""), " ",
    button(state !== "running" ? "close" : job.ending ? "stop without a plan" : "stop", stop), " ",
    job.ending ? make("small", {}, "ends with the best so far ") : null,
    job.page ? make("a", { href: `/pages/${id}`, target: "_blank", rel: "noopener",
      "data-page": "" }, "open its page") : null,
    text ? button("read it whole", () => opened(job.job, make("pre", {}, text))) : null,
    is_old ? make("small", {}, " of an earlier design") : null,
    // What is of an earlier design is read on request alone.
    text && !is_old ? make("pre", { tabindex: "0" }, text) : null,
    isDone && job.job === "sweep" ? cells(result, job.page) : null,
  );
}

const MOST_ROWS = 60; // of a sweep's cells in its table here
function cells(found, has_page) {
  // The last keys of paths, which tell enough where there is little room.
  const short = (paths) => paths.map((path) => path.split(".").at(-1)).join(", ");
  const heads = found.axes.map((paths) =>
    make("th", { scope: "col", title: paths.join(", ") }, short(paths)));
  const rows = found.cells.slice(0, MOST_ROWS).map((cell) => [...cell.values,
    ...(cell.reason ? [make("td", { colspan: "4" }, cell.reason)] : [cell.deficiency,
      micro(cell.average), micro(cell.maximum), share(cell.within) || "no target"])]);
  const rest = found.cells.length - MOST_ROWS;
  return make("div", { class: "scrolled", tabindex: "0" }, make("table", {}, table(
    [...heads, "rank deficiency", "U6 average µm", "U6 max. µm", "lengths within target"], rows)),
  rest > 0 ? make("p", {}, `${rest} more cases are on the page`) : null,
  has_page ? null
    : make("p", {}, "its page needs the extra report: python -m pip install 'ballplate[report]'"));
}

// True if a dialogue was confirmed.
function confirmed(dialogue) {
  Object.assign(dialogue, { returnValue: "" }).showModal();
  return new Promise((resolve) => {
    dialogue.onclose = () => resolve(dialogue.returnValue === "ok");
  });
}

function opened(question, ...fields) {
  $("question").textContent = question;
  $("fields").replaceChildren(...fields);
  return confirmed($("dialog"));
}

export async function dialog(question, ...fields) {
  const inputs = fields.map(([name, value]) => make("input", { name, value }));
  const labels = inputs.map((input) => make("label", {}, input.name, input));
  return (await opened(question, ...labels)) ? inputs.map((input) => input.value) : null;
}

// Paths of all values of a design, entries of lists by their names where they have any.
function keys(data, path = "") {
  if (Array.isArray(data)) return data.flatMap((one, k) => keys(one, `${path}[${one?.name ?? k}]`));
  if (data === null || typeof data !== "object") return [path];
  const below = Object.entries(data)
    .flatMap(([key, one]) => keys(one, path ? `${path}.${key}` : key));
  return path ? [path, ...below] : below;
}

export async function sweep() {
  const axes = $("axes");
  const part = (one, key, mark) => one.querySelector(`[data-axis=${key}]`).value.split(mark)
    .map((text) => text.trim()).filter(Boolean);
  fill($("paths"), keys(page.state.data ?? {}).map((path) => make("option", { value: path })));
  while (await confirmed($("sweeping"))) {
    const meant = [...axes.children].map((one) =>
      ({ paths: part(one, "paths", ","), values: part(one, "values", ";") }));
    const refused = await start("sweep", { axes: meant.filter(({ paths }) => paths.length) });
    // Beside the axis whose key the words begin with, or below all.
    const k = meant.findIndex(({ paths }) => paths.some((path) => refused.startsWith(`${path}: `)));
    [...axes.children].forEach((one, other) => {
      one.lastElementChild.textContent = k === other ? refused : "";
    });
    $("sweep-error").textContent = k < 0 ? refused : "";
    if (!refused) return;
  }
}
$("more-axes").onclick = () => {
  const axis = $("axes").lastElementChild.cloneNode(true);
  axis.querySelectorAll("input").forEach((input) => { input.value = ""; });
  $("axes").append(axis);
  axis.querySelector("input").focus();
};

export function fit(file) {
  const reader = new FileReader();
  reader.onload = () => start("fit", { name: file.name, content: reader.result.split(",")[1] });
  reader.readAsDataURL(file);
}
