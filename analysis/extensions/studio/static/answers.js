// The verdict, its figures, what is assumed and what is undetermined.
import { flow, lead } from "./forms.js";
import { legend } from "./legend.js";
import { $, act, button, fill, follow, make, mark, micro, page, share, table } from "./page.js";

const rounded = (number) => `${Number(number.toPrecision(3))}`;
const figure = (look, text, ...words) => make("div", { class: `figure ${look}` },
  make("span", { class: "big" }, text), make("span", {}, words));
const lines = (texts) => texts.map((text) => make("p", {}, text));
const was = (text) => (page.state.kept ? ` (was ${text})` : "");
export const lengths_of = (design) => design?.quantities.find(({ symbol }) => symbol === "U6");

// Whether targets are met, in words that a person may act on.
function target({ met, shares, rank, within }, before, of_rest, is_old) {
  if (!met) return figure("", "No target", "target_uncertainty is not stated");
  // Known once the map has come: what is met where it is evaluated may be missed elsewhere.
  const { of, largest } = page.elsewhere ?? {};
  const beyond = met === "met" && of === page.design ? largest : NaN;
  const head = is_old ? `Before: ${met}` : beyond > 1 ? "Target missed elsewhere" : `Target ${met}`;
  const look = rank.deficiency && met !== "met" ? "bad" : met !== "met" ? met
    : beyond > 1 ? "missed" : beyond <= 1 ? "met" : "";
  return figure(look, head,
    of_rest ? "by the rest: " : "", shares.join("; "),
    met === "undecided" ? ", but not everything is determined" : "",
    beyond > 1 ? `; elsewhere in the volume up to ${rounded(beyond)} times the target` : "",
    was(share(before?.within_target) || "no target"), within === null ? null
      : make("progress", { value: within, "aria-label": "share within the target" }));
}

// Figures of U6, or that it is undetermined, and of the target.
function answered(design, of_rest, is_old) {
  const lengths = lengths_of(design);
  if (!lengths) return figure("", "–", "no evaluation points: no lengths are judged");
  const { average, maximum, count, undetermined } = lengths;
  const before = lengths_of(page.state.kept);
  const [part, whole] = [undetermined, count].map((one) => one.toLocaleString("en"));
  return [
    undetermined ? figure("bad", "Undetermined", undetermined === count
      ? "All distances are undetermined." : `${part} of ${whole} distances are undetermined.`) : [],
    undetermined ? [] : [
      figure("", `${micro(average)} µm`, "U6 on average", was(micro(before?.average))),
      figure("", `${micro(maximum)} µm`, "U6 at most", was(micro(before?.maximum)))],
    target(design, before, of_rest, is_old),
  ];
}

const rank_words = ({ deficiency, expected, directions }) => {
  const weak = directions.filter((one) => one.weak).length;
  return [deficiency ? `Rank deficiency ${deficiency}` : "Full rank",
    deficiency === (expected ?? 0) ? "" : ` (the file expects ${expected ?? 0})`,
    weak ? `; ${weak} weakly determined` : ""].join("");
};

// What the figures are of, with their rank.
function notes_on({ rank, met }, left_out, is_old) {
  if (!is_old) {
    const names = left_out.map(({ name }) => name).join(", ");
    return [rank_words(rank),
      ...(names ? [`of the positions without ${names}, which cannot be read there`] : []),
      ...(met === "missed" && !rank.deficiency
        ? [`ballplate reach ${page.state.file} solves for what the target needs`] : [])];
  }
  const reason = page.state.pending ? "Computing" : "The text cannot be evaluated";
  return [`${reason}; ${rank ? "these are the figures before it." : "there are no figures yet."}`];
}

// Show the answer for the design; while that moves, its figures and what is wrong with it.
export function figures() {
  const { design, state, view } = page;
  const { rank, met, worst } = design ?? {};
  const moving = design !== state.design;
  const is_old = !moving && (state.stale || state.pending);
  const left_out = (design?.scene.positions ?? []).filter(({ problem }) => problem);
  const is_missed = Boolean(rank) && !["met", ""].includes(met);
  const messages = moving ? left_out.map(({ name, problem }) =>
    ({ what: `position "${name}"`, text: problem })) : state.messages;
  const notes = notes_on(design ?? {}, left_out, is_old);
  $("verdict").className = is_old ? "bad old" : rank?.deficiency ? "bad" : is_missed ? "warn"
    : met ? "" : "open";
  $("design").classList.toggle("unanswered", is_old);
  fill($("figures"), rank ? answered(design, left_out.length > 0, is_old) : []);
  fill($("notes"), lines(notes), left_out.length && !is_old
    ? button("Fit them to the volume", () => act({ do: "fit" }), { id: "fit" }) : null);
  fill($("messages"), messages.map(message),
    (design?.doubts ?? []).map((text) => make("li", { class: "doubt" }, text)));
  view.set({ segments: worst ? [{ ...worst, label: `${micro(worst.uncertainty)} µm` }] : [] });
  if (moving) return;
  // Only where there is something to determine.
  $("next").firstElementChild.hidden = !rank?.directions.length;
  const said = [is_old ? "" : $("figures").innerText, ...notes].join("; ");
  if (!state.pending && $("said").textContent !== said) $("said").textContent = said;
  fill($("counts"), lines(rank
    ? [`${rank.parameters} parameters from ${rank.observations} observations`]
    : []), dimensions(design?.part?.dimensions ?? []));
  directions(rank?.directions ?? []);
}

// Dimensions of the part in their worst places: uncertainty as a share of the limit.
const dimensions = (found) => (found.length ? make("ol", { class: "scrolled" },
  found.map(({ name, share: part, held }) => make("li", { class: held ? "" : "warn" },
    `${name}: ${rounded(100 * part)} % of the limit `,
    make("progress", { value: Math.min(part, 1), "aria-label": "share of the limit" })))) : null);

function message({ line, what, text }) {
  const where = line ? button(`line ${line}`, () => show_line(line),
    { class: "link", title: "show the line" }) : null;
  return make("li", {}, where, what ? `${line ? ", " : ""}${what}` : "", line || what ? ": " : "",
    text);
}

function show_line(line) {
  $("text-area").open = true;
  const text = $("text");
  const all = text.value.split("\n");
  const end = all.slice(0, line).join("\n").length;
  text.focus();
  text.setSelectionRange(end - (all[line - 1] ?? "").length, end);
  text.scrollTop = (line - 4) * (text.scrollHeight / all.length);
}

function directions(found) {
  const swing = (index) => {
    page.stopped = index === page.motion;
    page.motion = page.stopped ? null : index;
    page.show();
  };
  fill($("motions"), found.length ? make("h2", {}, "What the readings leave undetermined") : null,
    make("ol", { class: "scrolled" }, found.map(({ weak, words }, index) => make("li", {},
      button(index === page.motion ? "stop" : "move", () => swing(index),
        { "aria-pressed": String(index === page.motion), "data-motion": String(index) }),
      make("strong", {}, ` ${weak ? "weak" : "undetermined"} `), words))));
}

// The map and what swings come once nothing moves; scale and assumptions, which take longer, last.
export function ask_later() {
  mark("later", {});
  follow("drawn", { map: $("map").value, motion: page.motion }, (drawn) => {
    if (drawn.error) return;
    page.view.draw(drawn);
    legend();
    quantities(drawn.quantities);
    late(drawn);
    follow("later", {}, ({ lines: texts = [], assumptions = null }) => {
      fill($("scale"), lines(texts));
      assumed(assumptions);
    }, 0);
  }, 100);
}

// What comes with the map: the time of measuring, and whether lengths elsewhere miss the target.
function late({ hours, usual, map }) {
  const { kept } = page.state;
  const { largest, unit } = map?.scale ?? {};
  page.elsewhere = unit === "missed" ? { of: page.design, largest } : null;
  figures();
  const time = (value) => (value ? `${Number(value.toFixed(2))} h` : "–");
  fill($("late"), figure("", time(hours), "of measuring", usual ? ", with usual times" : "",
    was(time(kept?.hours))));
  $("hours").placeholder = `as now: ${Number(hours.toFixed(2))}`;
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

function assumed(found) {
  const all = found?.assumptions ?? [];
  page.effects = all.flatMap(({ changes }) => changes.influences?.at(-1) ?? []);
  $("assumptions").hidden = !all.length;
  fill($("rests"), found?.warning ? [found.warning, " ", stating(all[0])] : []);
  const row = (words, { average, maximum, ratio }) =>
    [words, micro(average), micro(maximum), Number.isFinite(ratio) ? rounded(ratio) : ""];
  const rows = all.map((one) => row(make("td", { title: one.source },
    make("strong", {}, one.assumed), `, instead ${one.instead} `, stating(one)), one));
  fill($("assumptions").lastElementChild, table(
    ["U6 in µm without what is assumed", "average", "max.", "times"],
    [row("as the file states", { ...found, ratio: 1 }), ...rows]));
}

export const UNITS = { m: "µm", rad: "µrad", 1: "ppm" };
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
      : [cell(one, "average"), cell(one, "maximum")]), UNITS[one.unit] ?? one.unit];
  fill($("quantities"),
    table(["standard uncertainty of", "average", "max.", ""], found.map(row)));
}
