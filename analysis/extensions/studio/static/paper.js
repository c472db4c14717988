// Elements of drawings, and shapes on paper as the engine projects them.
import { boxOf, plus } from "./shapes.js";

const WIDTH = 100; // of a picture, in its own units

export function element(name, attributes, ...inside) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.append(...inside);
  return made;
}

export const path = (lines, look) =>
  element("path", { class: look, d: lines.map((line) => `M${line.join("L")}`).join("") });

// A picture of polygons, styli and letters; without words it is only decoration.
export function picture(shapes, words = "") {
  const { min, max } = boxOf(shapes.flatMap(({ points }) => points));
  const scale = WIDTH / Math.max(...plus(max, min, -1));
  const [width, height] = plus(max, min, -1).map((side) => scale * side + 8);
  const drawn = shapes.flatMap(({ role, points, text }) => {
    const at = points.map((point) => plus(point, min, -1).map((one) => scale * one));
    const [x, y] = at.at(-1);
    if (role === "letter") return element("text", { x, y, dy: "0.35em" }, text);
    const lines = element(at.length > 2 ? "polygon" : "polyline", { class: role, points: at });
    const tip = () => element("circle", { class: role, cx: x, cy: y, r: 2.5 });
    return role === "stylus" ? [lines, tip()] : lines;
  });
  const meaning = words ? { role: "img", "aria-label": words } : { "aria-hidden": "true" };
  const viewBox = `-4 -4 ${width} ${height}`;
  return element("svg", { viewBox, class: "picture", ...meaning }, ...drawn);
}
