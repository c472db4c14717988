// Names, numbers and ticks over the picture: sharp, as large at any size, never hidden.
import { Vector3 } from "three";
import { cornersOf } from "./view.js";

const MOST_NAMES = 8; // plates that are all named
const NUMBERS = 44; // pixels from a number of an axis to the next, at least
const [TICK, ARROW] = [6, 26];
const FIRST = ["chosen", "near", "wrong"]; // these are named whatever stands there
const COLOURS = { chosen: "--accent", wrong: "--bad", off: "--quiet" };

export class Annotations {
  constructor(view) {
    this.view = view;
    this.paper = document.createElement("canvas");
    this.paper.setAttribute("aria-hidden", "true");
    Object.assign(this.paper.style, { position: "absolute", pointerEvents: "none" });
    view.canvas.after(this.paper);
    this.pen = this.paper.getContext("2d");
  }

  resize(width, height) {
    const { offsetLeft, offsetTop, clientLeft, clientTop } = this.view.canvas;
    const { ratio } = this.view;
    Object.assign(this.paper, { width: width * ratio, height: height * ratio });
    Object.assign(this.paper.style, { width: `${width}px`, height: `${height}px`,
      left: `${offsetLeft + clientLeft}px`, top: `${offsetTop + clientTop}px` });
  }

  write() {
    const { view, pen, paper } = this;
    pen.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
    pen.clearRect(0, 0, paper.width, paper.height);
    if (!view.design) return;
    this.family = getComputedStyle(view.canvas).fontFamily;
    this.taken = [];
    this.axes();
    for (const { middle, label } of view.segments) {
      const [x, y] = view.pixel(middle);
      this.text(label, x, y - 14, { bold: true, must: true });
    }
    const every = [...view.plates, ...(view.offered.length > MOST_NAMES ? [] : view.offered)];
    const named = every.filter(({ look }) =>
      every.length <= MOST_NAMES || look === "ghost" || FIRST.includes(look));
    const rank = ({ look }) => (FIRST.indexOf(look) + 1 || 9);
    named.sort((a, b) => rank(a) - rank(b)).forEach((plate) => this.name(plate));
  }

  // Axes along the outermost edges: z on the left, x and y below, as in all drawings.
  axes() {
    const { view } = this;
    const { min, max } = view.volume;
    const corners = cornersOf(view.volume).filter(({ z }) => !view.flat || z === min.z);
    this.centre = view.pixel(min.clone().add(max).multiplyScalar(0.5));
    this.origin = view.volume.containsPoint(new Vector3()) ? view.pixel(new Vector3()) : null;
    ["x", "y", "z"].slice(0, view.flat ? 2 : 3).forEach((axis, k, axes) => {
      const edges = corners.filter((corner) => corner[axis] === min[axis]).map((start) =>
        [start, start.clone().setComponent(k, max[axis])].map((end) => view.pixel(end)));
      const isLeft = k > 0 && k === axes.length - 1;
      const rank = ([[x0, y0], [x1, y1]]) => (isLeft ? -x0 - x1 : y0 + y1);
      const edge = edges.reduce((one, other) => (rank(other) > rank(one) + 1 ? other : one));
      this.axis(axis, edge, min[axis], max[axis]);
    });
    if (!this.origin) return;
    const out = direction(this.centre, this.origin);
    this.pen.fillStyle = view.colour("--ink");
    this.pen.beginPath();
    this.pen.arc(...this.origin, 3, 0, 2 * Math.PI);
    this.pen.fill();
    this.beside("0", this.origin, out, TICK + 3, { must: true });
  }

  axis(name, [start, end], low, high) {
    const { pen, origin } = this;
    const length = apart(start, end);
    if (length < NUMBERS) return;
    const along = direction(start, end);
    const middle = between(start, end, 0.5);
    const right = [-along[1], along[0]];
    const isOut = apart(moved(middle, right, 1), this.centre) > apart(middle, this.centre);
    const out = right.map((one) => (isOut ? one : -one));
    const places = ticks(low, high, Math.floor(length / NUMBERS)).map((value) =>
      [value, between(start, end, (value - low) / (high - low))]);
    const tip = moved(end, along, ARROW);
    const strokes = places.map(([, place]) => [place, moved(place, out, TICK)]);
    const wings = [-1, 1].map((way) => [tip, moved(moved(tip, along, -7), right, 3.5 * way)]);
    pen.lineWidth = 1;
    pen.strokeStyle = this.view.colour("--quiet");
    pen.beginPath();
    for (const [from, to] of [...strokes, [end, tip], ...wings]) {
      pen.moveTo(...from);
      pen.lineTo(...to);
    }
    pen.stroke();
    this.beside(`${name}, mm`, tip, along, 5, { bold: true, must: true });
    for (const [value, place] of places) {
      const isOrigin = origin && apart(place, origin) < 4;
      if (!isOrigin) this.beside(millimetres(value), place, out, TICK + 3, { colour: "--quiet" });
    }
  }

  // A plate's name at its highest corner that is free, with the way that it is dragged.
  name({ place: { name }, look, corners, middle, group }) {
    const { view } = this;
    const { drag } = view.hands;
    const isDragged = drag?.far && drag.name === name;
    const way = isDragged ? drag.by.toArray().slice(0, view.flat ? 2 : 3).map(signed) : [];
    const words = isDragged ? `${name}  ${way.join(", ")} mm` : name;
    const [centre, ...ends] = [middle, ...corners].map((point) =>
      view.pixel(point.clone().add(group.position)));
    ends.sort((a, b) => a[1] - b[1]);
    const style = { colour: COLOURS[look], bold: look === "chosen" || look === "wrong" };
    const isWritten = ends.some((end) =>
      this.beside(words, end, direction(centre, end), 4, style));
    if (!isWritten && FIRST.includes(look)) {
      this.beside(words, ends[0], [0, -1], 4, { ...style, must: true });
    }
  }

  half(words, bold) {
    this.pen.font = `${bold ? "600 " : ""}12.5px ${this.family}`;
    return [this.pen.measureText(words).width / 2, 7];
  }

  beside(words, place, out, gap, style) {
    const [across, up] = this.half(words, style.bold);
    const off = gap + Math.abs(out[0]) * across + Math.abs(out[1]) * up;
    return this.text(words, ...moved(place, out, off), style);
  }

  // Write about a point, unless something is written there, and say whether that was done.
  text(words, x, y, { colour = "--ink", bold = false, must = false }) {
    const { pen, view } = this;
    const [across, up] = this.half(words, bold);
    const { clientWidth, clientHeight } = view.canvas;
    const at = [Math.min(Math.max(x, across + 3), clientWidth - across - 3),
      Math.min(Math.max(y, up + 3), clientHeight - up - 3)];
    const isTaken = this.taken.some(([u, v, half, tall]) =>
      Math.abs(at[0] - u) < across + half && Math.abs(at[1] - v) < up + tall);
    if (isTaken && !must) return false;
    this.taken.push([...at, across, up]);
    Object.assign(pen, { textAlign: "center", textBaseline: "middle", lineJoin: "round",
      lineWidth: 4, strokeStyle: view.colour("--paper"), fillStyle: view.colour(colour) });
    pen.strokeText(words, ...at);
    pen.fillText(words, ...at);
    return true;
  }
}

const moved = ([x, y], [u, v], off) => [x + off * u, y + off * v];
const between = (start, end, share) => start.map((one, k) => one + share * (end[k] - one));
const apart = (start, end) => Math.hypot(end[0] - start[0], end[1] - start[1]);
const direction = (start, end) => end.map((one, k) => (one - start[k]) / (apart(start, end) || 1));
const millimetres = (one) => `${Number((1e3 * one).toPrecision(6))}`.replace("-", "−");
const signed = (one) => `${one < 0 ? "" : "+"}${millimetres(one)}`;

// Both ends, and between them multiples of 1, 2 or 5 that are not too near to an end.
function ticks(low, high, most) {
  const least = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((one) => one * power > least * (1 - 1e-9));
  const found = [low, high];
  for (let k = Math.ceil(low / step); k * step < high; k += 1) {
    if (k * step - low > 0.6 * step && high - k * step > 0.6 * step) found.push(k * step);
  }
  return found;
}
