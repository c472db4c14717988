// The verdict, its figures, what is assumed and what is undetermined.
import { $, act, ask, make, micro, page, refocus } from "./page.js";

export function legend() {
  const range = page.view.mapRange();
  $("legend").replaceChildren();
  if (!$("show-map").checked) return;
  if (!range || !range.high) {
    $("legend").append("Map: everything is undetermined, so that there is nothing to colour.");
    return;
  }
  $("legend").append("Map: standard uncertainty of a corrected co-ordinate, ",
    make("span", { class: "nowrap" },
      `${micro(range.low)} µm `, make("span", { class: "ramp" }), ` ${micro(range.high)} µm`),
    range.open ? "; grey: undetermined" : "");
}

export function figures(design, messages, pending = false) {
  const box = $("verdict");
  const rank = design?.rank;
  const wrong = page.state.stale || pending;
  box.classList.toggle("bad", wrong || rank.deficiency > 0);
  const left_out = design?.scene.positions.filter((place) => place.problem) ?? [];
  const is_missed = design?.within !== null && design?.within < 1;
  box.classList.toggle("warn", !wrong && !rank.deficiency && is_missed);
  const reason = pending ? "Computing"
    : messages[0]?.line ? "The text is invalid" : "The text cannot be evaluated";
  const expected = rank?.expected ?? 0;
  const head = wrong ? [make("strong", {}, rank
    ? `${reason}; these are the figures before it.` : `${reason}; there are no figures yet.`)]
    : [make("strong", {}, rank.words),
      rank.deficiency === expected ? "" : ` (the file expects ${expected})`];
  const figured = rank ? [
    ...(left_out.length && !wrong ? [`of the positions without ${left_out.map((one) => one.name)
      .join(", ")}, which cannot be read there`] : []),
    `${rank.parameters} parameters, ${rank.observations} observations`,
    // The target's words have U6 in them.
    ...(design.target.length ? design.target : design.headline),
    ...rank.reasons,
  ] : [];
  box.replaceChildren(make("p", {}, ...head), ...figured.map((text) => make("p", {}, text)),
    left_out.length ? make("p", {}, make("button", { id: "fit", onclick: () => act({ do: "fit" }) },
      "Fit all positions to the volume")) : "");
  $("messages").replaceChildren(...messages.map(message),
    ...(design?.doubts ?? []).map((text) => make("li", {}, text)));
  if (rank) quantities(design);
  else $("quantities").replaceChildren();
  if (rank && !wrong) ask_later();
  else {
    $("scale").replaceChildren();
    assumed(null);
  }
  directions(design, messages, pending);
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

const MOST_DIRECTIONS = 4; // that are told before a person asks for the others
function directions(design, messages, pending) {
  const unfolded = $("motions").querySelector("details")?.open;
  $("motions").replaceChildren();
  const found = design?.motions?.directions ?? [];
  if (!found.length) return;
  const swing = (index) => {
    page.motion = index === page.motion ? null : index;
    page.view.move(page.motion);
    figures(design, messages, pending);
    refocus(`#motions [data-motion="${index}"]`);
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
  $("motions").append(make("h2", {}, "What the readings do not tell"),
    make("ol", {}, ...items.slice(0, MOST_DIRECTIONS)));
  if (!rest.length) return;
  const more = make("details", {}, make("summary", {}, `${rest.length} more`),
    make("ol", {}, ...rest));
  more.open = Boolean(unfolded) || page.motion >= MOST_DIRECTIONS;
  $("motions").append(more);
}

let scaling = null;
// Scale and assumptions take longer than all the rest: they are asked for once nothing moves.
function ask_later() {
  clearTimeout(scaling);
  const stale = (is) =>
    ["scale", "assumptions"].forEach((name) => $(name).classList.toggle("stale", is));
  stale(true);
  scaling = setTimeout(async () => {
    try {
      const found = await ask("/api/later");
      if (found.fingerprint !== page.state.fingerprint) return;
      $("scale").replaceChildren(...found.lines.map((line) => make("p", {}, line)));
      assumed(found.assumptions);
      stale(false);
    } catch {
      $("scale").textContent = "";
      assumed(null);
    }
  }, 400);
}

const FEW_ASSUMED = 3; // rows that are shown before a person asks for all
let all_assumed = false;
function assumed(found) {
  const rows = found?.assumptions ?? [];
  $("assumptions").hidden = !rows.length;
  if (!rows.length) return;
  $("assumptions").classList.toggle("warn", Boolean(found.warning));
  $("assumptions").querySelector("summary").textContent = found.warning || "What is assumed";
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
function quantities(design) {
  const { kept } = page.state;
  const before = new Map((kept?.quantities ?? []).map((row) => [row.symbol, row]));
  const units = (row) => row.unit.split(", ").map((unit) => SHOWN_UNITS[unit] ?? unit).join(", ");
  const cell = (row, key) => {
    const was = before.get(row.symbol)?.[key];
    return make("td", {}, micro(row[key]),
      was !== undefined && kept ? make("span", { class: "was" }, `was ${micro(was)}`) : null);
  };
  const rows = design.quantities.map((row) => {
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
