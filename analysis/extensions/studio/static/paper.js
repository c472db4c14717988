// Elements of drawings, and shapes on paper as the engine projects them.
import { boxOf, plus } from "./shapes.js";

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
  const scale = 100 / Math.max(...plus(max, min, -1));
  const drawn = shapes.map(({ role, points, text }) => {
    const at = points.map((point) => plus(point, min, -1).map((one) => scale * one));
    const [x, y] = at.at(-1);
    return role === "letter" ? element("text", { x, y, dy: "0.35em" }, text)
      : element("path", { class: role, d: `M${at.join("L")}${at.length > 2 ? "Z" : "h0"}` });
  });
  const meaning = words ? { role: "img", "aria-label": words } : { "aria-hidden": "true" };
  const [width, height] = plus(max, min, -1).map((side) => scale * side + 8);
  return element("svg", { viewBox: `-4 -4 ${width} ${height}`, class: "picture", ...meaning },
    ...drawn);
}
