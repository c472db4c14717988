// The verdict, its figures, what is assumed and what is undetermined.
import { legend } from "./legend.js";
import { $, act, ask, make, micro, page, refocus } from "./page.js";

const counted = (number) => number.toLocaleString("en");
const figure = (text, words, ...more) => make("div", { class: "figure" },
  make("span", { class: "big" }, text), make("span", {}, words, ...more));

// Figures of U6, or that it is undetermined, and the share of lengths within the target.
function answered({ rank, quantities, target, by, share, within }) {
  const lengths = quantities.find((row) => row.symbol === "U6");
  if (!lengths) return [figure("–", "no evaluation points: no lengths are judged")];
  const { average, maximum, count, undetermined } = lengths;
  const was = (key) => {
    const row = page.state.kept?.quantities.find((one) => one.symbol === "U6");
    return row ? ` (was ${micro(row[key])})` : "";
  };
  const is_all = undetermined === count;
  const open = undetermined ? [figure("Undetermined", is_all ? "All distances are undetermined."
    : `${counted(undetermined)} of ${counted(count)} distances are undetermined.`)] : [];
  open.forEach((one) => one.classList.add("bad"));
  const others = undetermined ? " of the others" : "";
  const amounts = is_all ? [] : [
    figure(`${micro(average)} µm`, `U6${others} on average${was("average")}`),
    figure(`${micro(maximum)} µm`, `U6${others} at most${was("maximum")}`)];
  const compared = !target ? figure("No target", "target_uncertainty is not stated")
    : figure(share, `of ${counted(count)} distances are within the target ${target} (${by})`,
      make("progress", { value: within, "aria-label": "share within the target" }));
  if (target && within < 1) compared.classList.add(rank.deficiency ? "bad" : "warn");
  if (target && within === 1) compared.classList.add("good");
  return [...open, ...amounts, ...(is_all ? [] : [compared])];
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
  const left_out = design?.scene.positions.filter((place) => place.problem) ?? [];
  const is_missed = rank && design.within !== null && design.within < 1;
  const reason = pending ? "Computing"
    : messages[0]?.line ? "The text is invalid" : "The text cannot be evaluated";
  const notes = [
    wrong ? `${reason}; ${rank ? "these are the figures before it." : "there are no figures yet."}`
      : rank ? rank_words(rank) : "",
    left_out.length && !wrong ? `of the positions without ${left_out.map((one) => one.name)
      .join(", ")}, which cannot be read there` : ""].filter(Boolean);
  const box = $("verdict");
  box.classList.toggle("bad", wrong || rank?.deficiency > 0);
  box.classList.toggle("old", wrong);
  box.classList.toggle("open", !design?.target);
  box.classList.toggle("warn", !wrong && !rank?.deficiency && is_missed);
  const fit = make("button", { id: "fit", onclick: () => act({ do: "fit" }) },
    "Fit all positions to the volume");
  box.replaceChildren(...(rank ? answered(design) : []),
    make("div", { class: "notes" }, ...notes.map((text) => make("p", {}, text)),
      left_out.length ? fit : null));
  const next = rank?.deficiency ? "suggest" : is_missed ? "next" : "";
  $("next").querySelectorAll("button").forEach((button) =>
    button.classList.toggle("primary", button.dataset.job === next));
  page.view.lengths?.(rank && design.worst ? [{ ...design.worst,
    label: `${micro(design.worst.uncertainty)} µm` }] : []);
  if (moving) return;
  $("messages").replaceChildren(...messages.map(message),
    ...(design?.doubts ?? []).map((text) => make("li", {}, text)));
  const figured = [...box.querySelectorAll(".figure")].map((one) =>
    [...one.children].map((part) => part.textContent).join(" "));
  const said = [...(wrong ? [] : figured), ...notes].join("; ");
  if (!pending && $("said").textContent !== said) $("said").textContent = said;
  $("counts").replaceChildren(...(rank ? [
    `${rank.parameters} parameters from ${rank.observations} observations`, ...rank.reasons,
  ].map((text) => make("p", {}, text)) : []));
  quantities(rank && !wrong ? page.drawn?.quantities ?? [] : []);
  directions(rank?.directions ?? []);
  if (rank && !wrong) ask_later();
  else {
    clearTimeout(waiting);
    $("scale").replaceChildren();
    assumed(null);
  }
}

function message({ line, path, what, text }) {
  const where = line ? make("button", { class: "link", "data-focus": `line ${line} ${path}`,
    title: "show the line", onclick: () => show_line(line) }, `line ${line}`) : null;
  return make("li", {}, where, `${what ? `, ${what}` : ""}${line ? ": " : ""}${text}`);
}

function show_line(line) {
  unfold_text(true);
  const text = $("text");
  const lines = text.value.split("\n");
  const before = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  const end = text.value.indexOf("\n", before);
  text.focus();
  text.setSelectionRange(before, end < 0 ? text.value.length : end);
  text.scrollTop = (line - 4) * (text.scrollHeight / Math.max(1, lines.length));
}

export function unfold_text(open) {
  $("text-box").hidden = !open;
  $("toggle-text").setAttribute("aria-expanded", String(open));
}

const MOST_DIRECTIONS = 3; // that are shown before a person asks for the others
function directions(found) {
  const unfolded = $("motions").querySelector("details")?.open;
  $("motions").replaceChildren();
  if (!found.length) return;
  const swing = (index) => {
    page.motion = index === page.motion ? null : index;
    dress(page.state.design);
    page.view.move(page.motion);
    directions(found);
    refocus(`#motions [data-motion="${index}"]`);
    ask_drawn().catch(() => {});
  };
  const items = found.map((direction, index) => {
    const moving = index === page.motion;
    return make("li", {},
      make("button", { "aria-pressed": String(moving), "data-motion": String(index),
        onclick: () => swing(index) }, moving ? "stop" : "move"),
      make("strong", {}, ` ${direction.weak ? "weak" : "undetermined"} `), direction.words,
    );
  });
  const rest = items.slice(MOST_DIRECTIONS);
  $("motions").append(make("h2", {}, "What the readings leave undetermined"),
    make("ol", {}, ...items.slice(0, MOST_DIRECTIONS)));
  if (!rest.length) return;
  const more = make("details", {}, make("summary", {}, `${rest.length} more`),
    make("ol", {}, ...rest));
  more.open = Boolean(unfolded);
  $("motions").append(more);
}

// The map and the motion that were drawn last stay until those of the design have come.
export function dress(design) {
  const { drawn } = page;
  if (!drawn || drawn.dimension !== design.scene.dimension) return;
  design.map = $("map").value ? drawn.map : null;
  const swings = drawn.motions && drawn.motion === page.motion;
  design.motions = swings ? { ...drawn.motions, directions: [] } : null;
  if (swings) design.motions.directions[drawn.motion] = drawn.motions.direction;
}

async function ask_drawn() {
  const { design } = page.state;
  const { motion } = page;
  const wanted = { map: $("map").value, motion };
  const found = await ask("/api/drawn", wanted);
  if (found.fingerprint !== page.state.fingerprint || motion !== page.motion) return;
  page.drawn = { ...found, motion, dimension: design.scene.dimension };
  dress(page.state.design);
  page.view.map();
  page.view.move(motion);
  legend();
  quantities(found.quantities);
  ["legend", "quantities"].forEach((name) => $(name).classList.remove("stale"));
}

let waiting = null;
// The map and what swings come once nothing moves; scale and assumptions, which take longer than
// all the rest, after them.
export function ask_later(after = 100) {
  clearTimeout(waiting);
  const slow = ["scale", "assumptions", "rests", "quantities", "legend"];
  const stale = (is) => slow.forEach((name) => $(name).classList.toggle("stale", is));
  stale(true);
  waiting = setTimeout(async () => {
    const { fingerprint } = page.state;
    try {
      await ask_drawn();
      const is_known = page.later?.fingerprint === fingerprint;
      const found = is_known ? page.later : await ask("/api/later");
      if (fingerprint !== page.state.fingerprint) return;
      page.later = found;
      $("scale").replaceChildren(...found.lines.map((line) => make("p", {}, line)));
      assumed(found.assumptions);
      stale(false);
    } catch {
      // A later request has replaced this one, or the design has no such figures.
      if (fingerprint === page.state.fingerprint) $("scale").textContent = "";
    }
  }, after);
}

const FEW_ASSUMED = 3; // rows that are shown before a person asks for all
let all_assumed = false;
function assumed(found) {
  const rows = found?.assumptions ?? [];
  $("assumptions").hidden = !rows.length;
  $("rests").textContent = found?.warning ?? "";
  if (!rows.length) return;
  const times = (ratio) => (Number.isFinite(ratio) ? `${Number(ratio.toPrecision(3))}` : "");
  const row = (words, title, { average, maximum, ratio }) => make("tr", {},
    make("td", { title }, ...words), make("td", {}, micro(average)),
    make("td", {}, micro(maximum)), make("td", {}, times(ratio)));
  const shown = all_assumed ? rows : rows.slice(0, FEW_ASSUMED);
  const toggle = () => {
    all_assumed = !all_assumed;
    assumed(found);
    $("all-assumed").focus();
  };
  const heads = ["U6 in µm without what is assumed", "average", "max.", "times"];
  $("assumptions").querySelector("table").replaceChildren(
    make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", {}, head)))),
    make("tbody", {}, row(["all of these"], undefined, { ...found, ratio: 1 }),
      ...shown.map((one) => row([make("strong", {}, one.assumed), `, instead ${one.instead}`],
        one.source, one)),
      rows.length > FEW_ASSUMED ? make("tr", {}, make("td", { colspan: "4" },
        make("button", { id: "all-assumed", class: "link", onclick: toggle,
          "aria-expanded": String(all_assumed) }, all_assumed ? "fewer" : `all ${rows.length}`)))
        : ""),
  );
}

const SHOWN_UNITS = { m: "µm", rad: "µrad", 1: "ppm" };
function quantities(found) {
  const { kept } = page.state;
  const before = new Map((kept?.quantities ?? []).map((row) => [row.symbol, row]));
  const units = (row) => row.unit.split(", ").map((unit) => SHOWN_UNITS[unit] ?? unit).join(", ");
  const cell = (row, key) => {
    const was = before.get(row.symbol)?.[key];
    return make("td", {}, micro(row[key]),
      was !== undefined && kept ? make("span", { class: "was" }, `was ${micro(was)}`) : null);
  };
  const rows = found.map((row) => {
    const some = row.undetermined && row.undetermined < row.count;
    return make("tr", {},
      make("td", { title: row.largest ? `largest at ${row.largest}` : undefined },
        make("strong", {}, row.symbol), ` ${row.description}`,
        some ? ` (${row.undetermined} of ${row.count} undetermined)` : ""),
      ...(row.average === null && !kept ? [make("td", { colspan: "2" }, "undetermined")]
        : [cell(row, "average"), cell(row, "maximum")]),
      make("td", {}, units(row)));
  });
  const heads = ["standard uncertainty of", "average", "max.", ""];
  $("quantities").replaceChildren(
    make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", {}, head)))),
    make("tbody", {}, ...rows));
}
