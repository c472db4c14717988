// Shapes on paper, as the engine projects them, in the page's colours.
const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 100; // of a picture, in its own units

// A picture of polygons, styli and letters; without words it is only decoration.
export function picture(shapes, words = "") {
  const axis = (k) => shapes.flatMap((shape) => shape.points.map((point) => point[k]));
  const low = [Math.min(...axis(0)), Math.min(...axis(1))];
  const size = [Math.max(...axis(0)) - low[0], Math.max(...axis(1)) - low[1]];
  const scale = WIDTH / Math.max(...size);
  const element = (name, attributes, ...inside) => {
    const made = document.createElementNS(SVG, name);
    Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
    made.append(...inside);
    return made;
  };
  const drawn = shapes.flatMap(({ role, points, text }) => {
    const at = points.map((point) => point.map((value, k) => scale * (value - low[k])));
    const [x, y] = at.at(-1);
    if (role === "letter") return element("text", { x, y, dy: "0.35em" }, text);
    const lines = element(at.length > 2 ? "polygon" : "polyline", { class: role, points: at });
    const tip = () => element("circle", { class: role, cx: x, cy: y, r: 2.5 });
    return role === "stylus" ? [lines, tip()] : lines;
  });
  const box = [-4, -4, scale * size[0] + 8, scale * size[1] + 8].join(" ");
  const meaning = words ? { role: "img", "aria-label": words } : { "aria-hidden": "true" };
  return element("svg", { viewBox: box, class: "picture", ...meaning }, ...drawn);
}
