// Computations beside the page: suggestions, sweeps, plans, fits.
import { lengths_of } from "./answers.js";
import { $, act, ask, button, fill, make, micro, page, share, table, tell } from "./page.js";

const OFFERING = ["suggest", "next", "plan"]; // what is drawn and applied
let running = []; // computations as they were when they were asked after last
const shown = new Map(); // by the number of a computation and of a suggestion

const is_of_now = ({ fingerprint }) => fingerprint === page.state.fingerprint;
const is_current = (job) => is_of_now(job) && job.state === "done";

// What is suggested for the present design: what was computed last.
function current() {
  const last = running.findLast((one) => is_current(one) && OFFERING.includes(one.job));
  return [last?.result ?? []].flat().map((one, k) => ({ ...one, key: `${last.id} ${k}`,
    shown: shown.get(`${last.id} ${k}`) ?? k === 0, places: one.places ?? [one.place] }));
}

// All of them, in the view and beside it; what failed of an earlier text is not shown.
export function drawn() {
  const { view } = page;
  view.ghost(current().filter((one) => one.shown).flatMap((one) => one.places));
  const fitted = running.findLast((one) => is_current(one) && one.result?.residuals);
  view.set({ residuals: fitted && { ...fitted.result.residuals, scale: magnified(fitted) } });
  const is_listed = (job) => job.file === page.state.file && (job.state === "failed"
    ? is_of_now(job)
    : job.state === "running" || !["suggest", "next"].includes(job.job) || !job.result.length);
  const offered = current();
  fill($("suggestions"), offered.some(({ settings }) => settings)
    ? make("li", {}, next(offered)) : offered.map(suggestion));
  fill($("jobs"), running.filter(is_listed).map(computation));
}

// How many times their size residuals are drawn.
function magnified({ result }) {
  const sizes = result.residuals.value.map((one) => Math.hypot(...one));
  return Number(((0.06 * page.view.size) / Math.max(...sizes, 1e-12)).toPrecision(2));
}

// The settings of the next position that lowers U6 most, if it was asked for.
export const candidate = () => current().find((one) => one.settings)?.settings;

function suggestion(one) {
  const { average, maximum, deficiency, weak } = one;
  const figure = Number.isFinite(average)
    ? `U6 ${micro(average)} µm on average, ${micro(maximum)} µm at most`
    : deficiency ? `rank deficiency ${deficiency} left` : "";
  return make("li", {}, make("div", {}, one.words), make("div", {}, figure,
    weak ? `; ${weak} ${weak > 1 ? "directions stay" : "direction stays"} weak` : ""),
  make("div", { class: "bar" }, buttons(one)));
}

function buttons(one) {
  const toggle = () => {
    shown.set(one.key, !one.shown);
    page.show();
  };
  return [button(one.shown ? "hide" : "show", toggle, { "aria-pressed": String(one.shown) }), " ",
    button("apply", () => apply(one), { "data-apply": "" })];
}

// Next positions, with what an hour of each is worth.
function next(offered) {
  const before = lengths_of(page.state.design)?.average;
  const gain = ({ average, minutes }) =>
    (Number.isFinite(before - average) ? micro((before - average) * (60 / minutes)) : "–");
  return make("table", {}, table(
    ["next position", "readings", "min", "U6, µm", "less per h"],
    offered.flatMap((one) => [[make("td", { colspan: "5" }, one.words)],
      [make("td", {}, buttons(one)), one.place.readings, Math.round(one.minutes),
        one.deficiency ? `deficiency ${one.deficiency}` : micro(one.average), gain(one)]])));
}

const apply = ({ settings, plan: positions, calibration, edits }) =>
  act({ do: settings ? "add" : positions ? "plan" : "repair", settings, positions, calibration,
    edits }, "applied; undo leads back");

// What refuses the start, or nothing.
export async function start(job, settings = {}) {
  const refused = await ask("/api/start", { job, settings })
    .then(() => "", ({ message }) => message);
  tell(refused, Boolean(refused));
  poll();
  return refused;
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
  // A plan of positions, or a fit, is drawn.
  const is_new = running.some(({ id, state }) => before.get(id) !== state);
  if (is_new) page.show();
  else drawn();
  if (is_new && before.size) $("suggestions").scrollIntoView({ block: "nearest" });
  if (running.some((job) => job.state === "running")) polling = setTimeout(poll, 300);
}

const NOTHING = { suggest: "nothing was found that determines more",
  next: "no further position fits" };

// What there is to read of a computation.
function text_of(job) {
  const { state, result } = job;
  if (state !== "done") return state === "failed" ? result : "";
  const size = result.residuals && magnified(job).toLocaleString("en");
  return [NOTHING[job.job], size && `residuals are drawn ${size} times their size`, result.notes,
    result.lines].flat().filter(Boolean).join("\n");
}

function computation(job) {
  const { id, state, result, step, ending } = job;
  const text = text_of(job);
  const stop = async () => {
    await ask("/api/stop", { id });
    poll();
  };
  return make("li", { "data-state": state, id: `job-${id}` },
    make("strong", {}, job.job), ` ${state}`,
    make("span", { class: "step" }, state === "running" && step ? `: ${step}` : ""), " ",
    button(state !== "running" ? "close" : ending ? "stop without a plan" : "stop", stop), " ",
    ending ? make("small", {}, "ends with the best so far ") : null,
    job.page ? make("a", { href: `/pages/${id}`, target: "_blank", rel: "noopener",
      "data-page": "" }, "open its page") : null,
    // What is of an earlier design is read on request alone.
    is_of_now(job) ? null : make("small", {}, " of an earlier design"),
    text ? [make("button", { type: "button", popovertarget: `text-${id}` }, "read it whole"),
      make("pre", { popover: "auto", id: `text-${id}` }, text),
      is_of_now(job) && make("pre", { tabindex: "0" }, text)] : null,
    state === "done" && job.job === "sweep" ? cells(result) : null,
  );
}

function cells({ axes, cells: found }) {
  // The last keys of paths, which tell enough where there is little room.
  const heads = axes.map((paths) => paths.map((path) => path.split(".").at(-1)).join(", "));
  const rows = found.map(({ values, reason, deficiency, average, maximum, within }) =>
    [...values, ...(reason ? [make("td", { colspan: "4" }, reason)]
      : [deficiency, micro(average), micro(maximum), share(within) || "no target"])]);
  return make("div", { class: "scrolled", tabindex: "0" }, make("table", {}, table(
    [...heads, "rank deficiency", "U6 average µm", "U6 max. µm", "within target"], rows)));
}

// Paths of all values of a design, entries of lists by their names where they have any.
function keys(data, path = "") {
  if (Array.isArray(data)) return data.flatMap((one, k) => keys(one, `${path}[${one?.name ?? k}]`));
  if (data === null || typeof data !== "object") return [path];
  const below = Object.entries(data)
    .flatMap(([key, one]) => keys(one, path ? `${path}.${key}` : key));
  return path ? [path, ...below] : below;
}

$("sweep").onclick = () => {
  fill($("paths"), keys(page.state.data ?? {}).map((path) => make("option", { value: path })));
  $("sweep-error").textContent = "";
  $("sweeping").showModal();
};
// The dialogue stays until its sweep has begun.
$("sweeping").onsubmit = async (event) => {
  if (event.submitter.id === "cancel") return;
  event.preventDefault();
  const listed = (input, mark) =>
    input.value.split(mark).map((text) => text.trim()).filter(Boolean);
  const axes = [...$("axes").children].map((one) => one.querySelectorAll("input"))
    .map(([paths, values]) => ({ paths: listed(paths, ","), values: listed(values, ";") }));
  const refused = await start("sweep", { axes: axes.filter(({ paths }) => paths.length) });
  $("sweep-error").textContent = refused;
  if (!refused) $("sweeping").close();
};

// A plan within the hours that are stated, or else those of the present positions.
$("planning").onsubmit = (event) => {
  event.preventDefault();
  start("plan", $("hours").value ? { hours: $("hours").valueAsNumber } : {});
};

export function fit(file) {
  const reader = new FileReader();
  reader.onload = () => start("fit", { name: file.name, content: reader.result.split(",")[1] });
  reader.readAsDataURL(file);
}
