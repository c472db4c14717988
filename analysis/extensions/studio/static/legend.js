// Colours of the map, in bands between fixed steps, and their legend.
import { $, fill, make, micro, page, share } from "./page.js";
import { roundStep } from "./shapes.js";

const FINE = 10; // points of a picture from one node of the map to the next
const BANDS = 7;
const MEANINGS = {
  missed: "Share of the lengths from each point that miss the target ",
  lengths: "Largest standard uncertainty of the lengths from each point",
  points: "Standard uncertainty of a corrected co-ordinate, which depends on the origin",
};
const knownOf = ({ slices }) =>
  slices.flatMap(({ values }) => values.flat()).filter(Number.isFinite);

// Upper bounds of bands, without the last: those of shares, or multiples of a round length.
function boundsOf(map) {
  if (map.scale?.unit === "missed") return map.scale.bounds;
  const step = roundStep(Math.max(...knownOf(map)) / BANDS);
  return [...Array(BANDS - 1).keys()].map((k) => (k + 1) * step);
}

// A picture of a level, interpolated between the nodes; grey where something is undetermined.
export function imageOf(map, values, colour) {
  const bounds = boundsOf(map);
  const [grey, ...shades] = ["--line", ...[...bounds, 0].map((_, k) => `--band-${k}`)].map(colour);
  const rows = values.map((row) => row.map((value) => value ?? NaN));
  const [height, width] = [rows, rows[0]].map((nodes) => (nodes.length - 1) * FINE + 1);
  const image = Object.assign(document.createElement("canvas"), { width, height });
  const pen = image.getContext("2d");
  for (let x = 0; x < width; x += 1) {
    const column = rows.map((row) => along(row, x / FINE));
    for (let y = 0; y < height; y += 1) {
      const value = along(column, y / FINE);
      const band = 1 + bounds.findLastIndex((bound) => value > bound);
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
  const isShare = map.scale?.unit === "missed";
  const number = (value) => (isShare ? share(value) : `${micro(value)} µm`);
  const bounds = boundsOf(map).map(number);
  const words = [...bounds.map((bound, k) => (k || !isShare ? `to ${bound}` : bound)),
    `over ${bounds.at(-1)}`];
  fill($("legend"), isShare ? MEANINGS.missed + target : MEANINGS[$("map").value],
    `; here ${number(Math.min(...known))} to ${number(Math.max(...known))}`,
    "; grey: undetermined",
    make("ul", { class: "bands" }, words.map((text, k) =>
      make("li", { style: `--shade: var(--band-${k})` }, text))));
}
