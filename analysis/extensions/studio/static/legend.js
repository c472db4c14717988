// Colours of the map, in bands between fixed steps, and their legend.
import { $, fill, make, micro, page } from "./page.js";
import { roundStep } from "./shapes.js";

// Lower ends of bands as ratios to the target: four below it, and three above.
const RATIOS = [0, 0.25, 0.5, 0.75, 1, 1.5, 2];
const FINE = 10; // points of a picture from one node of the map to the next
const MEANINGS = {
  target: "Largest uncertainty of the lengths from each point, as a ratio to the target ",
  lengths: "Largest standard uncertainty of the lengths from each point",
  points: "Standard uncertainty of a corrected co-ordinate, which depends on the origin",
};
const knownOf = ({ slices }) =>
  slices.flatMap(({ values }) => values.flat()).filter(Number.isFinite);

// Without a target, multiples of a round number of metres.
function bandsOf(map) {
  const step = roundStep(Math.max(...knownOf(map)) / RATIOS.length);
  return map.scale?.unit === "target" ? RATIOS : RATIOS.map((_, k) => k * step);
}

// A picture of a level, interpolated between the nodes; grey where something is undetermined.
export function imageOf(map, values, colour) {
  const bands = bandsOf(map);
  const [grey, ...shades] = ["--line", ...bands.map((_, k) => `--band-${k}`)].map(colour);
  const rows = values.map((row) => row.map((value) => value ?? NaN));
  const [height, width] = [rows, rows[0]].map((nodes) => (nodes.length - 1) * FINE + 1);
  const image = Object.assign(document.createElement("canvas"), { width, height });
  const pen = image.getContext("2d");
  for (let x = 0; x < width; x += 1) {
    const column = rows.map((row) => along(row, x / FINE));
    for (let y = 0; y < height; y += 1) {
      const value = along(column, y / FINE);
      const band = Math.max(0, bands.findLastIndex((low) => value > low));
      pen.fillStyle = Number.isNaN(value) ? grey : shades[band];
      pen.fillRect(x, y, 1, 1);
    }
  }
  return image;
}

function along(nodes, at) {
  const [low, high] = [Math.floor(at), Math.ceil(at)].map((k) => nodes[k]);
  return low + (at % 1) * (high - low);
}

export function legend() {
  const { view: { map }, state: { design: { target } } } = page;
  const known = map ? knownOf(map) : [];
  if (!known.length) {
    fill($("legend"), map && "Map: everything is undetermined: nothing to colour.");
    return;
  }
  const isRatio = map.scale?.unit === "target";
  const number = (value) => (isRatio ? `${Number(value.toPrecision(2))}` : micro(value));
  const unit = isRatio ? "" : " µm";
  const band = (low, k, { length }) => make("li",
    { class: isRatio && low === 1 && "target", style: `--shade: var(--band-${k})` },
    number(low), isRatio && low === 1 && " = target", k === length - 1 && `${unit} or more`);
  fill($("legend"), isRatio ? MEANINGS.target + target : MEANINGS[$("map").value],
    `; here ${number(Math.min(...known))} to ${number(Math.max(...known))}${unit}`,
    "; grey: undetermined",
    make("ul", { class: "bands" }, bandsOf(map).map(band)));
}
