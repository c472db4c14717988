// Names, numbers and ticks over the picture: as large at any size, never hidden.
import { element, path } from "./paper.js";
import { apart, arrow, between, clamp, edgesOf, plus, roundStep } from "./shapes.js";

const NUMBERS = 44; // pixels from a number of an axis to the next, at least
const [TICK, ARROW] = [6, 26];
const LETTER = 6.8; // pixels of the width of a letter
const FIRST = ["chosen", "wrong", "ghost"]; // these are named whatever stands there

const direction = (start, end) => end.map((one, k) => (one - start[k]) / (apart(start, end) || 1));
const millimetres = (one) => `${Number((1e3 * one).toPrecision(6))}`.replace("-", "−");
const signed = (one) => `${one < 0 ? "" : "+"}${millimetres(one)}`;

// Both ends, and between them multiples of a round step that are not too near to an end.
function ticks(low, high, most) {
  const step = roundStep((high - low) / most);
  const inner = [...Array(most + 1).keys()].map((k) => (Math.ceil(low / step) + k) * step);
  return [low, high, ...inner.filter((one) => one - low > 0.6 * step && high - one > 0.6 * step)];
}

export function annotations(view) {
  const { room, pixel, hands, volume: { min, max } } = view;
  const made = [];
  const taken = []; // the middle of each text, and half its size

  // Write off a point in a direction, unless something is there, and say whether that was done.
  function write(words, point, out, gap, look = "", must = false) {
    const half = [(LETTER * words.length) / 2, 7];
    const off = gap + Math.abs(out[0]) * half[0] + Math.abs(out[1]) * half[1];
    const at = plus(point, out, off).map((one, k) =>
      clamp(one, half[k] + 3, room[k] - half[k] - 3));
    const isTaken = taken.some(([other, size]) =>
      at.every((one, k) => Math.abs(one - other[k]) < half[k] + size[k]));
    if (isTaken && !must) return false;
    taken.push([at, half]);
    made.push(element("text", { x: at[0], y: at[1], class: look }, words));
    return true;
  }

  // Axes along the outermost edges: z on the left, x and y below, as in all drawings.
  const centre = pixel(between(min, max));
  const isOrigin = min.every((low, k) => low <= 0 && max[k] >= 0);
  const origin = isOrigin ? pixel([0, 0, 0]) : [NaN, NaN];
  const numbers = []; // as they are written, where nothing else stands
  ["x", "y", "z"].slice(0, view.flat ? 2 : 3).forEach((name, k, { length }) => {
    const rank = ([[x0, y0], [x1, y1]]) => (k === length - 1 ? -x0 - x1 : y0 + y1);
    const edges = edgesOf(view.corners)[k].map((ends) => ends.map(pixel));
    const [start, end] = edges.reduce((one, other) =>
      (rank(other) > rank(one) + 1 ? other : one));
    const most = Math.floor(apart(start, end) / NUMBERS);
    if (most < 1) return;
    const along = direction(start, end);
    const middle = between(start, end);
    const across = [-along[1], along[0]];
    const isOut = apart(plus(middle, across), centre) > apart(middle, centre);
    const out = isOut ? across : across.map((one) => -one);
    const tip = plus(end, along, ARROW);
    const places = ticks(min[k], max[k], most).map((value) =>
      [value, between(start, end, (value - min[k]) / (max[k] - min[k]))]);
    const lines = places.map(([, place]) => [place, plus(place, out, TICK)]);
    made.push(path([...lines, ...arrow(end, tip)], "edges"));
    write(`${name}, mm`, tip, along, 5, "bold", true);
    numbers.push(...places.filter(([, place]) => !(apart(place, origin) < 4))
      .map(([value, place]) => [millimetres(value), place, out, TICK + 3, "number"]));
  });
  if (isOrigin) {
    made.push(element("circle", { cx: origin[0], cy: origin[1], r: 3 }));
    write("0", origin, direction(centre, origin), TICK + 3, "", true);
  }
  for (const { from, to, label } of view.segments) {
    write(label, pixel(between(from, to)), [0, -1], 7, "bold", true);
  }

  // A plate's name is at its highest corner that is free, with the way that it is dragged.
  const rank = ({ look }) => FIRST.indexOf(look) + 1 || 9;
  const plates = [...view.plates, ...view.offered].sort((one, other) => rank(one) - rank(other));
  for (const { place: { name }, look, corners, middle } of plates) {
    const { far, by } = hands.drag?.name === name ? hands.drag : {};
    const words = far ? `${name}  ${hands.components(by).map(signed).join(", ")} mm` : name;
    const off = hands.offset(name);
    const [inner, ...ends] = [middle, ...corners].map((point) => pixel(plus(point, off)));
    ends.sort((one, other) => one[1] - other[1]);
    const isWritten = ends.some((end) => write(words, end, direction(inner, end), 4, look));
    if (!isWritten && FIRST.includes(look)) write(words, ends[0], [0, -1], 4, look, true);
  }
  numbers.forEach((number) => write(...number));
  return made;
}
