// The verdict, its figures, what is assumed and what is undetermined.
import { flow, lead } from "./forms.js";
import { legend } from "./legend.js";
import { $, act, ask_now, button, fill, make, micro, page, share, table } from "./page.js";

const counted = (number) => number.toLocaleString("en");
const figure = (look, text, ...words) => make("div", { class: `figure ${look}` },
  make("span", { class: "big" }, text), make("span", {}, words));
const lines = (texts) => texts.map((text) => make("p", {}, text));
const was = (text) => (page.state.kept ? ` (was ${text})` : "");
const lengths_of = (design) => design?.quantities.find(({ symbol }) => symbol === "U6");

// Whether targets are met, in words that a person may act on.
const LOOKS = { met: "good", missed: "warn", undecided: "warn" };
function target({ met, shares, rank, within }, before, of_rest, is_old) {
  if (!met) return figure("", "No target", "target_uncertainty is not stated");
  const head = is_old ? `Before: ${met}` : `Target ${met}${of_rest ? " by the rest" : ""}`;
  return figure(rank.deficiency && met !== "met" ? "bad" : LOOKS[met], head, shares.join("; "),
    met === "undecided" ? ", but not everything is determined" : "",
    was(share(before?.within_target) || "no target"), within === null ? null
      : make("progress", { value: within, "aria-label": "share within the target" }));
}

// Figures of U6, or that it is undetermined, and of the target.
function answered(design, of_rest, is_old) {
  const lengths = lengths_of(design);
  if (!lengths) return figure("", "–", "no evaluation points: no lengths are judged");
  const { average, maximum, count, undetermined } = lengths;
  const before = lengths_of(page.state.kept);
  const others = undetermined ? " of the others" : "";
  return [
    undetermined ? figure("bad", "Undetermined", undetermined === count
      ? "All distances are undetermined."
      : `${counted(undetermined)} of ${counted(count)} distances are undetermined.`) : [],
    undetermined === count ? [] : [
      figure("", `${micro(average)} µm`, `U6${others} on average`, was(micro(before?.average))),
      figure("", `${micro(maximum)} µm`, `U6${others} at most`, was(micro(before?.maximum)))],
    target(design, before, of_rest, is_old),
  ];
}

// What comes with the map: the time of measuring, and lengths elsewhere that miss the target.
function late({ met }) {
  const { hours, usual, map } = page.drawn ?? {};
  const { largest, unit } = map?.scale ?? {};
  const time = (value) => (value ? `${Number(value.toFixed(2))} h` : "–");
  return make("div", { id: "late" }, hours ? figure("", time(hours), "of measuring",
    usual ? ", with usual times" : "", was(time(page.state.kept?.hours))) : null,
  met === "met" && unit === "target" && largest > 1 ? make("p", { class: "notes" },
    `Elsewhere in the volume, lengths reach ${Number(largest.toPrecision(3))} times the target.`)
    : null);
}

const rank_words = ({ deficiency, expected, directions }) => {
  const weak = directions.filter((one) => one.weak).length;
  return [deficiency ? `Rank deficiency ${deficiency}` : "Full rank",
    deficiency === (expected ?? 0) ? "" : ` (the file expects ${expected ?? 0})`,
    weak ? `; ${weak} weakly determined` : ""].join("");
};

export function figures(design, messages, pending = false) {
  const rank = design?.rank;
  const moving = design !== page.state.design;
  const wrong = !moving && (page.state.stale || pending);
  const left_out = (design?.scene.positions ?? []).filter(({ problem }) => problem);
  const is_missed = Boolean(rank) && !["met", ""].includes(design.met);
  const reason = pending ? "Computing"
    : messages[0]?.line ? "The text is invalid" : "The text cannot be evaluated";
  const notes = [
    wrong ? `${reason}; ${rank ? "these are the figures before it." : "there are no figures yet."}`
      : rank ? rank_words(rank) : "",
    left_out.length && !wrong ? `of the positions without ${left_out.map((one) => one.name)
      .join(", ")}, which cannot be read there` : ""].filter(Boolean);
  const box = $("verdict");
  box.className = wrong ? "bad old" : rank?.deficiency ? "bad" : is_missed ? "warn"
    : design?.met ? "" : "open";
  fill(box, rank ? [answered(design, left_out.length > 0, wrong), late(design)] : [],
    make("div", { class: "notes" }, lines(notes), left_out.length
      ? button("Fit all positions to the volume", () => act({ do: "fit" }), { id: "fit" }) : null));
  const [suggest, next] = $("next").children;
  suggest.classList.toggle("primary", rank?.deficiency > 0);
  next.classList.toggle("primary", is_missed && !rank.deficiency);
  page.view.lengths?.(rank && design.worst ? [{ ...design.worst,
    label: `${micro(design.worst.uncertainty)} µm` }] : []);
  if (moving) return;
  // Only where there is something to determine.
  suggest.hidden = !rank?.directions.length;
  suggest.textContent = `What would determine it${rank?.deficiency ? "" : " better"}?`;
  fill($("messages"), messages.map(message),
    (design?.doubts ?? []).map((text) => make("li", {}, text)));
  const figured = [...box.querySelectorAll(":scope > .figure")].map((one) =>
    [...one.children].map((part) => part.textContent).join(" "));
  const said = [...(wrong ? [] : figured), ...notes].join("; ");
  if (!pending && $("said").textContent !== said) $("said").textContent = said;
  fill($("counts"), lines(rank
    ? [`${rank.parameters} parameters from ${rank.observations} observations`, ...rank.reasons]
    : []));
  quantities(rank && !wrong ? page.drawn?.quantities ?? [] : []);
  directions(rank?.directions ?? []);
  if (rank && !wrong) ask_later();
  else {
    clearTimeout(waiting);
    fill($("scale"));
    assumed(null);
  }
}

function message({ line, what, text }) {
  const where = line ? button(`line ${line}`, () => show_line(line),
    { class: "link", title: "show the line" }) : null;
  return make("li", {}, where, what ? `, ${what}` : "", line ? ": " : "", text);
}

function show_line(line) {
  unfold_text(true);
  const text = $("text");
  const all = text.value.split("\n");
  const before = all.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  text.focus();
  text.setSelectionRange(before, before + (all[line - 1] ?? "").length);
  text.scrollTop = (line - 4) * (text.scrollHeight / all.length);
}

export function unfold_text(open) {
  $("text-box").hidden = !open;
  $("toggle-text").setAttribute("aria-expanded", String(open));
}

const MOST_DIRECTIONS = 3; // that are shown before a person asks for the others
function directions(found) {
  const swing = (index) => {
    page.stopped = index === page.motion;
    page.motion = page.stopped ? null : index;
    page.show();
  };
  const items = found.map((direction, index) => make("li", {},
    button(index === page.motion ? "stop" : "move", () => swing(index),
      { "aria-pressed": String(index === page.motion), "data-motion": String(index) }),
    make("strong", {}, ` ${direction.weak ? "weak" : "undetermined"} `), direction.words));
  const rest = items.splice(MOST_DIRECTIONS);
  fill($("motions"),
    items.length ? make("h2", {}, "What the readings leave undetermined") : null,
    make("ol", {}, items), rest.length ? make("details", {},
      make("summary", {}, `${rest.length} more`), make("ol", {}, rest)) : null);
}

// The map and the motion that were drawn last stay until those of the design have come.
export function dress(design) {
  const { drawn } = page;
  if (!drawn || drawn.dimension !== design.scene.dimension) return;
  design.map = $("map").value ? drawn.map : null;
  design.motions = drawn.motions && drawn.motion === page.motion
    ? { ...drawn.motions, directions: { [drawn.motion]: drawn.motions.direction } } : null;
}

const stale = (is, ...names) =>
  names.forEach((name) => $(name)?.classList.toggle("stale", is));

let waiting = null;
// The map and what swings come once nothing moves; scale and assumptions, which take longer than
// all the rest, after them.
export function ask_later(after = 100) {
  clearTimeout(waiting);
  stale(true, "scale", "assumptions", "rests", "quantities", "legend", "late");
  waiting = setTimeout(async () => {
    const { motion, state: { fingerprint } } = page;
    try {
      const drawn = await ask_now("/api/drawn", { map: $("map").value, motion });
      if (drawn && motion === page.motion) draw({ ...drawn, motion });
      const is_known = page.later?.fingerprint === fingerprint;
      const later = is_known ? page.later : await ask_now("/api/later");
      if (later?.fingerprint !== page.state.fingerprint) return;
      page.later = later;
      fill($("scale"), lines(later.lines));
      assumed(later.assumptions);
      stale(false, "scale", "assumptions", "rests");
    } catch {
      // A later request has replaced this one, or the design has no such figures.
      if (fingerprint === page.state.fingerprint) fill($("scale"));
    }
  }, after);
}

function draw(found) {
  const { view, state: { design } } = page;
  page.drawn = { ...found, dimension: design.scene.dimension };
  dress(design);
  view.map();
  view.move(found.motion);
  legend();
  quantities(found.quantities);
  $("late")?.replaceWith(late(design));
  $("hours").placeholder = `as now: ${Number(found.hours.toFixed(2))}`;
  stale(false, "legend", "quantities", "late");
}

// A button that leads to where an assumption is stated; an effect of its own is written first.
function stating({ assumed: what, changes }) {
  const [section] = Object.keys(changes);
  const added = section === "influences" ? changes[section].at(-1) : null;
  const said = "stated with usual values: change them in the form; undo takes them out";
  const go = async () => {
    const action = { do: "set", path: [section, "+"], value: flow(added) };
    if (!added || await act(action, said)) lead(section, "standard_uncertainty");
  };
  return button(added ? "state it" : "show", go,
    { class: "link", "aria-label": `${added ? "state it" : "show where it is stated"}: ${what}` });
}

const FEW_ASSUMED = 3; // rows that are shown before a person asks for all
let all_assumed = false;
function assumed(found) {
  const all = found?.assumptions ?? [];
  $("assumptions").hidden = !all.length;
  fill($("rests"), found?.warning ? [found.warning, " ", stating(all[0])] : []);
  const times = (ratio) => (Number.isFinite(ratio) ? `${Number(ratio.toPrecision(3))}` : "");
  const row = (words, { average, maximum, ratio }) =>
    [words, micro(average), micro(maximum), times(ratio)];
  const toggle = () => {
    all_assumed = !all_assumed;
    assumed(found);
  };
  const more = make("td", { colspan: "4" }, button(all_assumed ? "fewer" : `all ${all.length}`,
    toggle, { id: "all-assumed", class: "link", "aria-expanded": String(all_assumed) }));
  const shown = all.slice(0, all_assumed ? all.length : FEW_ASSUMED).map((one) =>
    row(make("td", { title: one.source }, make("strong", {}, one.assumed),
      `, instead ${one.instead} `, stating(one)), one));
  fill($("assumptions").lastElementChild, table(
    ["U6 in µm without what is assumed", "average", "max.", "times"],
    [row("all of these", { ...found, ratio: 1 }), ...shown,
      ...(all.length > FEW_ASSUMED ? [[more]] : [])]));
}

const SHOWN_UNITS = { m: "µm", rad: "µrad", 1: "ppm" };
function quantities(found) {
  const { kept } = page.state;
  const cell = (row, key) => {
    const before = kept?.quantities.find(({ symbol }) => symbol === row.symbol)?.[key];
    return [micro(row[key]), before === undefined ? null
      : make("span", { class: "was" }, `was ${micro(before)}`)];
  };
  const row = (one) => [
    make("td", { title: one.largest ? `largest at ${one.largest}` : undefined },
      make("strong", {}, one.symbol), ` ${one.description}`,
      one.undetermined && one.undetermined < one.count
        ? ` (${one.undetermined} of ${one.count} undetermined)` : ""),
    ...(one.average === null && !kept ? [make("td", { colspan: "2" }, "undetermined")]
      : [cell(one, "average"), cell(one, "maximum")]), SHOWN_UNITS[one.unit] ?? one.unit];
  fill($("quantities"),
    table(["standard uncertainty of", "average", "max.", ""], found.map(row)));
}
