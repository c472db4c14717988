// The page of the studio: it asks, the engine answers, and everything that is shown comes from there.
import { View, colourOf } from "./view.js";
import { build, flow } from "./forms.js";

const $ = (id) => document.getElementById(id);
let state = null;
let schema = null;
let selected = null;
let motion = null;
let suggestions = [];
let fits = null;
let previewing = null;
let polling = null;
let running = []; // computations as they were when they were asked after last
let typed = false; // the text beside the design has changes that are not applied
let lost = null; // waits for a studio that does not answer
let watching = null; // waits for figures that are being computed
let scaling = null; // asks for what carries scale and what is assumed, once nothing else is asked
let all_assumed = false; // all assumptions are shown, not the first alone

async function ask(path, body) {
  const options = body === undefined ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  };
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    await_studio();
    throw new Error(`The studio does not answer. ${!state || state.recoverable ? "Start it again with the same command: changes that are not saved are there again." : "Changes are not saved, and could not be kept in the folder of the file: copy the text of the file before you leave this page."}`);
  }
  const text = await response.text();
  let data;
  try {
    data = JSON.parse(text);
  } catch {
    throw new Error(text.trim());
  }
  if (!response.ok || data.error !== undefined) throw Object.assign(new Error(data.error), { outdated: data.outdated });
  return data;
}

function await_studio() {
  clearTimeout(lost);
  lost = setTimeout(async () => {
    lost = null;
    try {
      state = await ask("/api/state");
      show();
      tell("the studio answers again");
    } catch (error) {
      tell(error.message, true);
    }
  }, 2000);
}

// What another window did, or a studio that was started anew, is shown instead of what was here.
async function refresh() {
  try {
    const found = await ask("/api/state");
    // What was asked for before the last change and answered after it is not shown.
    const isNew = found.session !== state.session || found.revision > state.revision;
    if (isNew || (found.revision === state.revision && found.pending !== state.pending)) { state = found; show(); }
    else watch();
  } catch (error) {
    tell(error.message, true);
  }
}

// Figures that were not there in time are asked for until they are.
function watch() {
  clearTimeout(watching);
  if (state.pending) watching = setTimeout(() => (acting ? watch() : refresh()), 500);
}

function tell(text, bad = false) {
  $("notice").textContent = text;
  $("notice").classList.toggle("bad", bad);
}

let queue = Promise.resolve();
let acting = 0;
function act(action, said = "") {
  acting += 1;
  // One after the other: each goes on from the answer before.
  const next = queue.then(async () => {
    const slow = setTimeout(() => tell("computing …"), 400);
    const started = performance.now();
    try {
      state = await ask("/api/do", { ...action, revision: state.revision, session: state.session });
      const answered = performance.now();
      clearTimeout(slow);
      tell(said);
      show();
      window.studio.latency.push({ answered: answered - started, shown: performance.now() - started });
      return true;
    } catch (error) {
      clearTimeout(slow);
      tell(error.message, true);
      if (error.outdated) await refresh();
      else show();
      return false;
    }
  });
  queue = next.catch(() => {}).finally(() => { acting -= 1; });
  return next;
}

const view = new View($("view"), {
  onSelect: (name) => choose(name),
  onDrag: (name, by) => preview({ do: "move", position: name, by }),
  onDrop: (name, by) => act({ do: "move", position: name, by }),
});

let waiting = null;
async function preview(action) {
  // Of the design as it is now: what comes after the drop is of another one.
  waiting = { ...action, revision: state.revision, session: state.session };
  if (previewing) return;
  previewing = true;
  while (waiting) {
    const next = waiting;
    const isMeant = () => !acting && state.revision === next.revision;
    waiting = null;
    try {
      const design = isMeant() ? await ask("/api/preview", next) : null;
      if (!design || !isMeant()) continue;
      tell("");
      figures(design, []);
    } catch (error) {
      if (isMeant()) tell(error.message, true);
    }
  }
  previewing = false;
}

function choose(name) {
  selected = name;
  const focused = focus();
  view.show(state.design, selected, { withMap: $("show-map").checked });
  places();
  refocus(focused);
}

const micro = (value) => (value === null || value === undefined || Number.isNaN(value) ? "undetermined" : `${Number((1e6 * value).toPrecision(3))}`);
const share = (value) => (value === null || value === undefined ? "" : `${Math.floor(1000 * value) / 10} %`);

function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => {
    if (key === "class") made.className = value;
    else if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  });
  made.append(...children.filter((one) => one !== null && one !== undefined));
  return made;
}

function show() {
  const { design } = state;
  const focused = focus();
  $("title").textContent = `${state.file}${state.saved ? "" : " (not saved)"}${design ? ` — ${design.title}` : ""}`;
  document.title = `${state.saved ? "" : "• "}${state.file} – ballplate studio`;
  options($("files"), state.files.includes(state.file) ? state.files : [state.file, ...state.files], state.file);
  $("variant-label").hidden = !state.variants.length;
  options($("variants"), state.variants, state.variant);
  $("undo").disabled = !state.back;
  $("redo").disabled = !state.forward;
  $("save").disabled = state.saved;
  $("keep").textContent = state.kept ? "Stop comparing" : "Keep to compare";
  if (!typed && $("text").value !== state.text) $("text").value = state.text;
  $("apply").disabled = !typed;
  if (design) {
    if (!design.scene.positions.some((place) => place.name === selected)) selected = null;
    if (motion !== null && motion >= design.motions.directions.length) motion = null;
    if (motion === null && design.rank.deficiency) motion = 0;
    if (motion !== null && !design.motions.directions.length) motion = null;
    view.motion = motion;
    view.show(design, selected, { withMap: $("show-map").checked });
    $("hint").textContent = `Drag a plate along its plane${design.scene.dimension === 3 ? ", with Shift along its normal" : ""}. Drag elsewhere to turn the view.`;
    legend();
  } else view.empty();
  figures(design, state.messages, state.pending);
  watch();
  places();
  if (schema) build($("forms"), state.data, schema, state.messages, (path, value, input) => act({ do: "set", path, value }).then((done) => { if (!done) input.classList.add("bad-field"); }));
  view.ghost(current().filter((one) => one.shown).flatMap((one) => one.places));
  if (fits?.fingerprint !== state.fingerprint) fits = null;
  view.residuals(fits, fits?.scale);
  suggested();
  computations(running);
  refocus(focused);
}

// Parts of the page are made anew; whoever works with the keyboard stays where he was.
function focus() {
  const one = document.activeElement;
  if (!one || one === document.body) return null;
  if (one.id) return `#${CSS.escape(one.id)}`;
  const owner = one.closest("[id]");
  const name = ["data-path", "data-key", "data-motion", "data-focus", "aria-label"].find((key) => one.hasAttribute(key));
  return owner && name ? `#${CSS.escape(owner.id)} [${name}="${CSS.escape(one.getAttribute(name))}"]` : null;
}

function refocus(selector) {
  const one = selector && document.querySelector(selector);
  if (one && one !== document.activeElement) one.focus({ preventScroll: true });
}

function options(select, names, chosen) {
  select.replaceChildren(...names.map((name) => new Option(name, name, name === chosen, name === chosen)));
}

function legend() {
  const range = view.mapRange();
  $("legend").replaceChildren();
  if (!$("show-map").checked) return;
  const words = "Map: standard uncertainty of a corrected co-ordinate, ";
  if (!range || !range.high) {
    $("legend").append("Map: everything is undetermined, so that there is nothing to colour.");
    return;
  }
  $("legend").append(
    words, make("span", { class: "nowrap" }, `${micro(range.low)} µm `, make("span", { class: "ramp" }), ` ${micro(range.high)} µm`),
    range.open ? "; grey: undetermined" : "",
  );
}

function figures(design, messages, pending = false) {
  const box = $("verdict");
  const rank = design?.rank;
  const wrong = messages.length > 0 || pending;
  box.classList.toggle("bad", wrong || rank.deficiency > 0);
  box.classList.toggle("warn", !wrong && !rank.deficiency && design.within !== null && design.within < 1);
  const lines = [];
  const reason = pending ? "Computing" : messages[0]?.line ? "The text is invalid" : "The text cannot be evaluated";
  if (wrong) lines.push(make("strong", {}, design ? `${reason}; these are the figures before it.` : `${reason}; there are no figures yet.`));
  else lines.push(make("strong", {}, rank.words), rank.deficiency === (rank.expected ?? 0) ? "" : ` (the file expects ${rank.expected ?? 0})`);
  const figured = design ? [
    `${rank.parameters} parameters, ${rank.observations} observations`,
    // The target's words have U6 in them.
    ...(design.target.length ? design.target : design.headline),
    ...rank.reasons,
  ] : [];
  box.replaceChildren(make("p", {}, ...lines), ...figured.map((text) => make("p", {}, text)));
  $("messages").replaceChildren(
    ...messages.map((one) => make("li", {},
      one.line ? make("button", { class: "link", "data-focus": `line ${one.line} ${one.path}`, title: "show the line", onclick: () => show_line(one.line) }, `line ${one.line}`) : null,
      `${one.path ? `, ${one.path}` : ""}${one.line ? ": " : ""}${one.text}`)),
    ...(design?.doubts ?? []).map((text) => make("li", {}, text)),
  );
  if (design) quantities(design);
  else $("quantities").replaceChildren();
  if (design && !wrong) ask_later();
  else {
    $("scale").replaceChildren();
    assumed(null);
  }
  directions(design, messages, pending);
}

function show_line(line) {
  unfold_text(true);
  const text = $("text");
  const before = text.value.split("\n").slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  const end = text.value.indexOf("\n", before);
  text.focus();
  text.setSelectionRange(before, end < 0 ? text.value.length : end);
  text.scrollTop = (line - 4) * (text.scrollHeight / Math.max(1, text.value.split("\n").length));
}

function unfold_text(open) {
  $("text-box").hidden = !open;
  $("toggle-text").setAttribute("aria-expanded", String(open));
}

const MOST_DIRECTIONS = 4; // that are told before a person asks for the others
function directions(design, messages, pending) {
  const unfolded = $("motions").querySelector("details")?.open;
  $("motions").replaceChildren();
  const found = design?.motions.directions ?? [];
  if (!found.length) return;
  const items = found.map((one, index) => {
    const moving = index === motion;
    return make("li", {},
      make("button", { "aria-pressed": String(moving), "data-motion": String(index), onclick: () => { motion = moving ? null : index; view.move(motion); figures(design, messages, pending); refocus(`#motions [data-motion="${index}"]`); } }, moving ? "stop" : "move"),
      make("strong", {}, ` ${one.weak ? "weak" : "undetermined"} `), one.words,
    );
  });
  const rest = items.slice(MOST_DIRECTIONS);
  $("motions").append(make("h2", {}, "What the readings do not tell"), make("ol", {}, ...items.slice(0, MOST_DIRECTIONS)));
  if (rest.length) {
    const more = make("details", {}, make("summary", {}, `${rest.length} more`), make("ol", {}, ...rest));
    more.open = Boolean(unfolded) || motion >= MOST_DIRECTIONS;
    $("motions").append(more);
  }
}

// Scale and assumptions take longer than all the rest: they are asked for once nothing moves any more.
function ask_later() {
  clearTimeout(scaling);
  for (const name of ["scale", "assumptions"]) $(name).classList.add("stale");
  scaling = setTimeout(async () => {
    try {
      const found = await ask("/api/later");
      if (found.fingerprint !== state.fingerprint) return;
      $("scale").replaceChildren(...found.lines.map((line) => make("p", {}, line)));
      assumed(found.assumptions);
      for (const name of ["scale", "assumptions"]) $(name).classList.remove("stale");
    } catch {
      $("scale").textContent = "";
      assumed(null);
    }
  }, 400);
}

const FEW_ASSUMED = 3; // rows that are shown before a person asks for all
function assumed(found) {
  const rows = found?.assumptions ?? [];
  $("assumptions").hidden = !rows.length;
  if (!rows.length) return;
  $("assumptions").classList.toggle("warn", Boolean(found.warning));
  $("assumptions").querySelector("summary").textContent = found.warning || "What is assumed";
  const times = (ratio) => (Number.isFinite(ratio) ? `${Number(ratio.toPrecision(3))}` : "");
  const row = (words, title, one) => make("tr", {}, make("td", { title }, ...words), make("td", {}, micro(one.average)), make("td", {}, micro(one.maximum)), make("td", {}, times(one.ratio)));
  const shown = all_assumed ? rows : rows.slice(0, FEW_ASSUMED);
  $("assumptions").querySelector("table").replaceChildren(
    make("thead", {}, make("tr", {}, ...["U6 in µm without what is assumed", "average", "max.", "times"].map((head) => make("th", {}, head)))),
    make("tbody", {}, row(["all of these"], undefined, { ...found, ratio: 1 }),
      ...shown.map((one) => row([make("strong", {}, one.assumed), `, instead ${one.instead}`], one.source, one)),
      rows.length > FEW_ASSUMED ? make("tr", {}, make("td", { colspan: "4" },
        make("button", { id: "all-assumed", class: "link", "aria-expanded": String(all_assumed), onclick: () => { all_assumed = !all_assumed; assumed(found); $("all-assumed").focus(); } }, all_assumed ? "fewer" : `all ${rows.length}`))) : ""),
  );
}

function quantities(design) {
  const kept = new Map((state.kept?.quantities ?? []).map((one) => [one.symbol, one]));
  const told = { m: "µm", rad: "µrad", 1: "ppm" };
  const unit = (row) => row.unit.split(", ").map((one) => told[one] ?? one).join(", ");
  const cell = (row, key) => {
    const was = kept.get(row.symbol)?.[key];
    return make("td", {}, micro(row[key]), was !== undefined && state.kept ? make("span", { class: "was" }, `was ${micro(was)}`) : null);
  };
  $("quantities").replaceChildren(
    make("thead", {}, make("tr", {}, make("th", {}, "standard uncertainty of"), make("th", {}, "average"), make("th", {}, "max."), make("th", {}, ""))),
    make("tbody", {}, ...design.quantities.map((row) => make("tr", {},
      make("td", { title: row.largest ? `largest at ${row.largest}` : undefined }, make("strong", {}, row.symbol), ` ${row.description}`, row.undetermined && row.undetermined < row.count ? ` (${row.undetermined} of ${row.count} undetermined)` : ""),
      ...(row.average === null && !state.kept ? [make("td", { colspan: "2" }, "undetermined")] : [cell(row, "average"), cell(row, "maximum")]),
      make("td", {}, unit(row)),
    ))),
  );
}

function places() {
  const list = state.design?.scene.positions ?? [];
  $("positions").replaceChildren(...list.map((place, index) => {
    const swatch = make("span", { class: "swatch" });
    swatch.style.background = colourOf(index);
    return make("li", { class: place.name === selected ? "chosen" : "" },
      make("input", { type: "checkbox", checked: true, title: "switch this position off", "aria-label": `read ${place.name}`, onchange: () => act({ do: "off", position: place.name }) }),
      swatch,
      make("button", { class: "name", "aria-label": `choose ${place.name}`, onclick: () => choose(place.name) }, place.name),
      make("small", { title: "readings" }, `${place.readings}`),
    );
  }), ...state.off.map((name) => make("li", { class: "off" },
    make("input", { type: "checkbox", title: "switch this position on", "aria-label": `read ${name}`, onchange: () => act({ do: "on", position: name }) }),
    make("span", { class: "swatch" }), make("span", {}, `${name} (off)`),
  )));
  const place = list.find((one) => one.name === selected);
  $("position").hidden = !place;
  if (place) details(place);
}

function details(place) {
  const { scene } = state.design;
  const name = place.name;
  const many = place.groups > 1;
  const axes = scene.dimension === 3 ? ["x", "y", "z"] : [];
  const balls = scene.artefacts[place.artefact];
  const across = Math.max(1, Math.round(Math.sqrt(balls.length)));
  const grid = make("div", { class: "balls", role: "group", "aria-label": "balls that are read" }, ...balls.map((ball, k) => make("button", {
    title: ball, "aria-label": ball, "aria-pressed": String(place.read[k]), disabled: many,
    onclick: () => act({ do: "balls", position: name, balls: balls.filter((_, other) => (other === k ? !place.read[other] : place.read[other])) }),
  })));
  grid.style.gridTemplateColumns = `repeat(${across}, 1.05rem)`;
  $("position").replaceChildren(
    make("strong", {}, name), make("div", {}, `${place.artefact}; ${place.readings} readings`),
    make("div", { class: "bar" },
      make("button", { id: "turn", onclick: () => act({ do: "turn", position: name }) }, "Turn"),
      ...axes.map((axis) => make("button", { disabled: place.plane === axis, title: `stand across ${axis}`, onclick: () => act({ do: "stand", position: name, across: axis }) }, `⟂ ${axis}`)),
      make("button", { onclick: () => act({ do: "copy", position: name }) }, "Copy"),
      make("button", { onclick: () => act({ do: "remove", position: name }) }, "Remove"),
    ),
    make("div", {}, "read with: ", ...Object.keys(scene.probes).map((probe) => make("label", {},
      make("input", { type: "checkbox", checked: place.probes.includes(probe), disabled: many, "aria-label": `probe ${probe}`,
        onchange: (event) => act({ do: "probes", position: name, probes: Object.keys(scene.probes).filter((one) => (one === probe ? event.target.checked : place.probes.includes(one))) }) }),
      `${probe} `))),
    grid, ...(many ? [make("small", {}, "several groups of readings: change them in the text")] : []),
  );
}

function current() {
  return suggestions.filter((one) => one.fingerprint === state.fingerprint);
}

function suggested() {
  const shown = current();
  $("suggestions").replaceChildren(...shown.map((one, k) => make("li", {},
    make("div", {}, one.words),
    make("div", {}, one.average === null || one.average === undefined ? (one.deficiency ? `rank deficiency ${one.deficiency} left` : "") : `U6 ${micro(one.average)} µm on average, ${micro(one.maximum)} µm at most`,
      one.weak ? `; ${one.weak} ${one.weak > 1 ? "directions stay" : "direction stays"} weak` : "", one.faint ? "; barely determined" : ""),
    make("div", { class: "bar" },
      make("button", { "aria-pressed": String(!!one.shown), "data-focus": `show ${k}`, onclick: () => { one.shown = !one.shown; show(); } }, one.shown ? "hide" : "show"),
      make("button", { "data-apply": "", "data-focus": `apply ${k}`, onclick: () => apply(one) }, "apply"),
    ))));
  if (suggestions.length && !shown.length) $("suggestions").append(make("p", {}, "The design has changed since these were asked for; ask again."));
}

function apply(one) {
  suggestions = suggestions.filter((other) => other !== one);
  if (one.settings) act({ do: "add", settings: one.settings }, "position added");
  else act({ do: "repair", edits: one.edits }, "applied");
}

// What refuses the start, or nothing.
async function start(job, settings = {}) {
  let refused = "";
  try {
    await ask("/api/start", { job, settings });
    tell("computing beside the studio …");
  } catch (error) {
    refused = error.message;
    tell(refused, true);
  }
  poll();
  return refused;
}

const MOST_ROWS = 60; // of a sweep's cells in its table here
const taken = new Set();
async function poll() {
  clearTimeout(polling);
  let list;
  try {
    list = await ask("/api/jobs");
  } catch (error) {
    tell(error.message, true);
    return;
  }
  for (const job of list) {
    if (job.state !== "done" || taken.has(job.id)) continue;
    taken.add(job.id);
    if (job.job === "suggest" || job.job === "next") {
      suggestions = job.result.map((one, k) => ({ ...one, places: one.places ?? [one.place], fingerprint: job.fingerprint, shown: k === 0 }));
      tell("");
      if (!suggestions.length) tell(job.job === "suggest" ? "nothing is undetermined or weak, or nothing was found that helps" : "no further position fits");
      show();
    }
    if (job.job === "fit" && job.result.residuals) {
      const sizes = job.result.residuals.value.map((one) => Math.hypot(...one));
      fits = { ...job.result.residuals, fingerprint: job.fingerprint, scale: (0.06 * view.size) / Math.max(...sizes, 1e-12) };
      show();
      tell(`residuals are drawn ${Number(fits.scale.toPrecision(2)).toLocaleString("en")} times their size`);
    }
  }
  running = list;
  computations(running);
  if (list.some((job) => job.state === "running")) polling = setTimeout(poll, 300);
}

function computations(list) {
  // What was suggested is shown with the suggestions.
  const told = list.filter((job) => job.state !== "done" || !["suggest", "next"].includes(job.job));
  // An item is made anew only where it has changed: nobody can press a button that is replaced all the time.
  const there = new Map([...$("jobs").children].map((one) => [one.dataset.said, one]));
  const items = told.map((job) => {
    const said = JSON.stringify([state.session, job.id, job.state, job.page, job.fingerprint === state.fingerprint]);
    const item = there.get(said) ?? computation(job, said);
    item.querySelector(".step").textContent = job.state === "running" && job.step ? `: ${job.step}` : "";
    return item;
  });
  if (items.length !== $("jobs").children.length || items.some((one, k) => one !== $("jobs").children[k])) $("jobs").replaceChildren(...items);
}

function computation(job, said) {
  return make("li", { "data-state": job.state, "data-said": said },
    make("strong", {}, job.job), ` ${job.state}`, make("span", { class: "step" }), " ",
    make("button", { "data-focus": `job ${job.id}`, onclick: async () => { await ask("/api/stop", { id: job.id }); poll(); } }, job.state === "running" ? "stop" : "close"),
    " ", job.page ? make("a", { href: `/pages/${job.id}`, target: "_blank", rel: "noopener", "data-page": "" }, "open its page") : null,
    job.fingerprint === state.fingerprint ? null : make("small", {}, " of an earlier design"),
    job.state === "failed" ? make("pre", {}, String(job.result)) : null,
    job.state === "done" && job.result?.lines ? make("pre", { tabindex: "0" }, [...(job.result.notes ?? []), ...job.result.lines].join("\n")) : null,
    job.state === "done" && job.job === "sweep" ? table(job.result, job.page) : null,
  );
}

// The last keys of paths, which tell enough where there is little room.
function short(paths) {
  return paths.map((path) => path.split(".").at(-1)).join(", ");
}

function table(found, hasPage) {
  const some = found.cells.slice(0, MOST_ROWS);
  const figured = ["rank deficiency", "U6 average µm", "U6 max. µm", "lengths within target"];
  const heads = [...found.axes.map((paths) => make("th", { title: paths.join(", ") }, short(paths))), ...figured.map((one) => make("th", {}, one))];
  return make("div", { class: "scrolled", tabindex: "0" },
    make("table", {}, make("thead", {}, make("tr", {}, ...heads)),
      make("tbody", {}, ...some.map((cell) => make("tr", {}, ...cell.values.map((one) => make("td", {}, one)),
        ...(cell.reason ? [make("td", { colspan: "4" }, cell.reason)] : [make("td", {}, String(cell.deficiency)), make("td", {}, micro(cell.average)), make("td", {}, micro(cell.maximum)), make("td", {}, share(cell.within) || "no target")]))))),
    found.cells.length > MOST_ROWS ? make("p", {}, `${found.cells.length - MOST_ROWS} more cases are on the page`) : null,
    hasPage ? null : make("p", {}, "its page needs the extra report: python -m pip install 'ballplate[report]'"),
  );
}

// A dialogue with some fields, true if it was confirmed.
function opened(question, fields) {
  $("question").textContent = question;
  $("fields").replaceChildren(...fields);
  $("dialog").returnValue = "";
  $("dialog").showModal();
  return new Promise((resolve) => {
    $("dialog").addEventListener("close", () => resolve($("dialog").returnValue === "ok"), { once: true });
  });
}

async function dialog(question, fields) {
  const inputs = fields.map(([name, value]) => [name, make("input", { name, value })]);
  const confirmed = await opened(question, inputs.map(([name, input]) => make("label", {}, name, input)));
  return confirmed ? inputs.map(([, input]) => input.value) : null;
}

// Paths of all values of a design, entries of lists by their names where they have any.
function keys(data, path) {
  if (Array.isArray(data)) return data.flatMap((one, k) => keys(one, `${path}[${one?.name ?? k}]`));
  if (data === null || typeof data !== "object") return [path];
  const below = Object.entries(data).flatMap(([key, one]) => keys(one, path ? `${path}.${key}` : key));
  return path ? [path, ...below] : below;
}

async function fit(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
  start("fit", { name: file.name, content: btoa(text) });
}

$("undo").onclick = () => act({ do: "undo" });
$("redo").onclick = () => act({ do: "redo" });
$("keep").onclick = () => act({ do: "keep", off: !!state.kept });
$("save").onclick = () => act({ do: "save" }, "saved");
$("save-as").onclick = async () => {
  const answer = await dialog("Save under another name, in the same folder", [["name", state.file]]);
  if (answer) act({ do: "save", name: answer[0] }, "saved");
};
$("files").onchange = async (event) => {
  const name = event.target.value;
  const discard = !state.saved;
  if (discard && !(await dialog(`${state.file} has changes that are not saved. Leave them?`, []))) { show(); return; }
  suggestions = [];
  await act({ do: "open", name, discard });
  view.home();
};
$("variants").onchange = (event) => act({ do: "variant", name: event.target.value });
$("text").addEventListener("input", () => { typed = $("text").value !== state.text; $("apply").disabled = !typed; });
$("apply").onclick = async () => {
  const text = $("text").value;
  typed = false;
  if (!(await act({ do: "text", text }))) { $("text").value = text; typed = true; $("apply").disabled = false; }
};
$("reopen").onclick = () => { typed = false; act({ do: "reopen" }, "read again; undo leads back to the text that was here"); };
$("toggle-text").onclick = () => unfold_text($("text-box").hidden);
$("step").onchange = (event) => { view.step = Number(event.target.value); };
$("show-map").onchange = show;
$("home").onclick = () => { view.home(); };
$("sweep").onclick = async () => {
  const paths = keys(state.data, "");
  const list = make("datalist", { id: "paths" }, ...paths.map((path) => new Option(path, path)));
  const row = (path, values) => make("fieldset", {},
    make("label", {}, "keys, separated by commas", make("input", { list: "paths", value: path, "data-axis": "paths", autocomplete: "off" })),
    make("label", {}, "values, separated by semicolons", make("input", { value: values, "data-axis": "values", autocomplete: "off" })));
  const rows = make("div", {}, row("machine.repeatability", "0.1 um; 0.2 um; 0.4 um"));
  const more = make("button", { type: "button", id: "more-axes", onclick: () => { rows.append(row("", "")); rows.lastElementChild.querySelector("input").focus(); } }, "Another axis");
  const part = (one, key, mark) => one.querySelector(`[data-axis=${key}]`).value.split(mark).map((text) => text.trim()).filter(Boolean);
  const error = make("p", { class: "field-error", role: "alert" });
  while (await opened("Compute every combination of some values", [rows, list, more, ...(rows.contains(error) ? [] : [error])])) {
    const axes = [...rows.children].map((one) => ({ paths: part(one, "paths", ","), values: part(one, "values", ";") })).filter((one) => one.paths.length);
    const refused = await start("sweep", { axes });
    if (!refused) return;
    // Beside the axis that is meant, whose key the words begin with, or below all.
    const meant = [...rows.children].find((one) => part(one, "paths", ",").some((path) => refused.startsWith(`${path}: `)));
    error.textContent = refused;
    if (meant) meant.append(error);
    else error.remove();
  }
};
document.querySelectorAll("[data-job]").forEach((button) => { button.onclick = () => start(button.dataset.job); });
$("readings").onchange = (event) => { if (event.target.files[0]) fit(event.target.files[0]); event.target.value = ""; };
const drop = $("drop");
drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over-it"); });
drop.addEventListener("dragleave", () => drop.classList.remove("over-it"));
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over-it");
  if (event.dataTransfer.files[0]) fit(event.dataTransfer.files[0]);
});
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target === $("text")) return;
  const key = event.key.toLowerCase();
  const does = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[key];
  if (!does) return;
  event.preventDefault();
  act({ do: does }, does === "save" ? "saved" : "");
});
$("view").addEventListener("keydown", (event) => {
  const place = state.design?.scene.positions.find((one) => one.name === selected);
  if (!place) return;
  const column = (k) => place.rotation.map((row) => row[k]);
  const keys = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, 1], PageDown: [2, -1] };
  if (event.key === "r" || event.key === "R") act({ do: "turn", position: selected });
  else if (keys[event.key] && keys[event.key][0] < place.rotation.length) {
    const [axis, sign] = keys[event.key];
    act({ do: "move", position: selected, by: column(axis).map((one) => sign * one * view.step) });
  } else return;
  event.preventDefault();
});
window.addEventListener("beforeunload", (event) => { if (typed) event.preventDefault(); });
window.addEventListener("focus", () => { if (state) refresh(); });

window.studio = { view, latency: [], state: () => state, act, flow };
try {
  [state, schema] = await Promise.all([ask("/api/state"), ask("/api/schema")]);
  motion = state.design?.rank.deficiency ? 0 : null;
  show();
  if (state.note) tell(state.note);
  poll();
} catch (error) {
  tell(error.message, true);
}
