// The volume and its plates, drawn in three dimensions; what is undetermined moves.
import { annotate } from "./annotations.js";
import { Hands } from "./hands.js";
import { imageOf } from "./legend.js";
import {
  apart, arrow, between, boxOf, clamp, cornersOf, dot, edgesOf, FACES, plateOf, plus, vector,
} from "./shapes.js";

const [TURN, RISE] = [-35, 24]; // degrees: the eye of all drawings of a design
const SHARE = 0.07; // of the volume's size: the largest displacement that is shown
const PERIOD = 2400; // milliseconds of one swing
const [MARGIN, LOWER] = [66, 20]; // pixels around the volume, and more of them above
// Colours by meaning, which are the page's; balls are parts of the volume's size, dashes pixels.
const LOOKS = {
  quiet: { colour: "--quiet", fill: 0.1, ball: 0.0045 },
  off: { colour: "--line", fill: 0, ball: 0.003 },
  near: { colour: "--ink", fill: 0.1, ball: 0.0045 },
  chosen: { colour: "--accent", fill: 0.3, ball: 0.0075, width: 1.5 },
  wrong: { colour: "--bad", fill: 0.2, ball: 0.0075, width: 1.5 },
  ghost: { colour: "--ink", fill: 0.04, ball: 0.0045, width: 1.5, dashes: [8, 5] },
  forbidden: { colour: "--bad", fill: 0.14 },
};

export class View {
  constructor(canvas, handlers) {
    this.canvas = canvas;
    this.handlers = handlers; // onSelect, onDrag, onDrop, and onPlace if there is one
    this.pen = canvas.getContext("2d");
    this.ratio = Math.min(window.devicePixelRatio, 2);
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.near = null; // the name below the mouse
    this.step = 0.01;
    this.hands = new Hands(this);
    this.empty();
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.colourMap());
  }

  // Nothing to show: the text has been wrong since it was opened.
  empty() {
    Object.assign(this, { design: null, bounds: null, map: null, residual: null });
    this.set({ sheets: [], plates: [], offered: [], segments: [], outlines: [], boxes: [] });
    this.move(null);
  }

  // Show something else beside the design, in the next frame.
  set(shown) {
    Object.assign(this, shown);
    if (!this.next) this.next = requestAnimationFrame((now) => this.paint(now));
  }

  show(design, selected) {
    const { dimension, lower, upper, probes, positions } = design.scene;
    if (design !== this.design) this.hands.settle();
    const bounds = JSON.stringify([lower, upper]);
    const isOther = bounds !== this.bounds;
    if (isOther) this.empty();
    const volume = { min: vector(lower), max: vector(upper) };
    Object.assign(this, { design, selected, bounds, volume, flat: dimension === 2 });
    this.size = apart(volume.min, volume.max);
    this.corners = cornersOf(volume);
    this.plates = positions.map((place) =>
      plateOf(place, place.probes.map((probe) => probes[probe]), this.size));
    this.dress();
    if (isOther) this.home();
  }

  // The map and the motion that were drawn last stay until those of the design have come.
  draw({ map, motions }) {
    if (map !== this.map) {
      this.map = map;
      this.colourMap();
    }
    if (motions !== this.motions) this.move(motions);
  }

  // Uncertainty on levels of the volume, as transparent sheets of colours.
  colourMap() {
    const { map } = this;
    // Where everything is undetermined there is nothing to compare.
    const slices = map?.slices.filter(({ values }) => values.flat().some(Boolean)) ?? [];
    const sheets = slices.map(({ level, values }) => {
      const corner = (i, j) => [map.x.at(i), map.y.at(j), level ?? 0];
      const ends = [corner(0, 0), corner(-1, 0), corner(0, -1)];
      return { ends, image: imageOf(map, values, this.colour) };
    });
    this.set({ sheets });
  }

  colour = (name) => getComputedStyle(this.canvas).getPropertyValue(name);
  named = (name) => this.plates.find((plate) => plate.place.name === name);

  dress() {
    const { drag } = this.hands;
    for (const plate of this.plates) {
      const { name, problem, enabled } = plate.place;
      const isWrong = drag?.far && drag.name === name ? drag.leaves : problem;
      plate.look = isWrong ? "wrong" : name === this.selected ? "chosen"
        : enabled === false ? "off" : name === this.near ? "near" : "quiet";
    }
    this.set({});
  }

  ghost(places) {
    const offered = this.design ? places : [];
    this.set({ offered: offered.map((place) => plateOf(place, [], this.size, "ghost")) });
  }

  // Outlines of candidates, and boxes that nothing may enter; lengths {from, to, label}.
  pool = (outlines, boxes) => this.set({ outlines, boxes });
  residuals = (found, scale) => this.set({ residual: found && { ...found, scale } });
  lengths = (segments) => this.set({ segments });

  // Let a direction swing, or stop; at rest it is at its largest.
  move(motions) {
    const moved = new Map(motions?.direction.readings.map((by, k) =>
      [`${motions.ball[k]} ${motions.names[motions.position[k]]}`, vector(by)]));
    this.set({ motions, moved, amplitude: motions ? SHARE * this.size : 0 });
  }

  home() {
    if (!this.design) return;
    const [turn, rise] = this.flat ? [0, 90] : [TURN, RISE];
    Object.assign(this, { turn, rise, zoom: 1, shift: [0, 0] });
    const [right, up] = this.eye;
    this.seen = boxOf(this.corners.map((corner) => [dot(corner, right), dot(corner, up)]));
    this.resize();
  }

  // Size of the picture, and of a metre in it if the whole volume is seen.
  resize() {
    const { canvas, ratio } = this;
    this.room = [canvas.clientWidth, canvas.clientHeight];
    if (!this.design || !this.room.every(Boolean)) return;
    [canvas.width, canvas.height] = this.room.map((side) => Math.round(side * ratio));
    const sides = plus(this.seen.max, this.seen.min, -1);
    this.metre = Math.min(...this.room.map((side, k) =>
      Math.max(side - 2 * MARGIN, 100) / sides[k]));
    this.paint(performance.now());
  }

  // Enlarge the picture about a pixel.
  enlarge(times, at) {
    const zoom = clamp(this.zoom * times, 0.2, 50);
    const middle = this.pixel(between(this.volume.min, this.volume.max));
    const shift = plus(this.shift, plus(at, middle, -1), 1 - zoom / this.zoom);
    this.set({ zoom, shift });
  }

  // Pixels of a point from the canvas's corner.
  pixel = (point) => {
    const { volume, room, shift } = this;
    const [right, up] = this.eye;
    const off = plus(point, between(volume.min, volume.max), -1);
    const scale = this.metre * this.zoom;
    return [room[0] / 2 + shift[0] + scale * dot(off, right),
      room[1] / 2 + shift[1] + LOWER - scale * dot(off, up)];
  };

  // Directions to the right, up, and towards the eye, which is turned and raised by degrees.
  get eye() {
    const [t, r] = [this.turn, this.rise].map((degrees) => (degrees * Math.PI) / 180);
    return [[Math.cos(t), -Math.sin(t), 0],
      [Math.sin(t) * Math.sin(r), Math.cos(t) * Math.sin(r), Math.cos(r)],
      [-Math.sin(t) * Math.cos(r), -Math.cos(t) * Math.cos(r), Math.sin(r)]];
  }

  // Where a plane through a point is seen at a pixel; null if it is seen edge-on.
  meet(at, normal, point) {
    const [right, up, towards] = this.eye;
    const [x, y] = plus(at, this.pixel(point), -1).map((one) => one / (this.metre * this.zoom));
    const by = plus(right.map((one) => one * x), up, -y);
    const facing = dot(normal, towards);
    if (Math.abs(facing) < 1e-3) return null;
    return plus(plus(point, by), towards, -dot(normal, by) / facing);
  }

  nearness = (point) => (point ? dot(point, this.eye[2]) : -Infinity);

  // Where a plate, or a point in metres, is on the screen, for whoever drives the page.
  screen(what) {
    const point = typeof what === "string" ? this.named(what)?.middle : what;
    const { left, top } = this.canvas.getBoundingClientRect();
    return point ? plus(this.pixel(point), [left, top]) : null;
  }

  // The plate at a pixel, the chosen one before others.
  under(at) {
    const near = ({ normal, middle }) => this.nearness(this.meet(at, normal, middle));
    const met = this.plates.filter((plate) => this.pen.isPointInPath(
      this.faces(this.placed(plate, plate.corners)), ...at.map((one) => one * this.ratio)));
    met.sort((one, other) => near(other) - near(one));
    return met.find(({ place }) => place.name === this.selected) ?? met[0];
  }

  hover(name) {
    if (name === this.near) return;
    this.near = name;
    this.canvas.style.cursor = name === null ? "" : "grab";
    this.dress();
  }

  // Points of a plate where it has been dragged to.
  placed({ place }, points) {
    const by = this.hands.offset(place.name);
    return points.map((point) => plus(point, by));
  }

  paint(now) {
    const { pen, canvas, ratio, residual, segments } = this;
    this.next = null;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = this.colour("--paper");
    pen.fillRect(0, 0, canvas.width, canvas.height);
    if (!this.design || !this.metre) return;
    if (this.motions && !this.still) {
      this.set({ amplitude: SHARE * this.size * Math.sin((2 * Math.PI * now) / PERIOD) });
    }
    this.sheets.forEach((sheet) => this.sheet(sheet));
    this.frame();
    const outlines = this.outlines.map((outline) => [...outline, outline[0]]);
    this.stroke(outlines, "--quiet", { dashes: [2, 3], alpha: 0.55 });
    this.boxes.forEach((ends) => this.block(cornersOf(boxOf(ends.map(vector))), "forbidden"));
    // Many plates above one another stay transparent, and are drawn without their styli.
    const thin = Math.min(1, 8 / this.plates.length);
    [...this.plates, ...this.offered].forEach((plate) =>
      this.plate(plate, plate.look === "quiet" ? thin : 1));
    if (this.motions) this.stroke(this.lattice(), "--bad");
    residual?.place.forEach((place, k) => {
      const ends = [place, plus(place, residual.value[k], residual.scale)].map(this.pixel);
      const colour = residual.standardised[k] > 3.5 ? "--bad" : "--quiet";
      this.stroke(arrow(...ends), colour, { isFlat: true });
    });
    this.stroke(segments.map(({ from, to }) => [from, to]), "--band-5", { width: 4 });
    this.dots(segments.flatMap(({ from, to }) => [from, to]), 5, "--band-5");
    annotate(this);
  }

  // Lines through points, which are pixels already if they are flat.
  stroke(lines, colour, { width = 1, dashes = [], alpha = 1, isFlat = false } = {}) {
    const { pen } = this;
    pen.setLineDash(dashes);
    Object.assign(pen, { strokeStyle: this.colour(colour), lineWidth: width, globalAlpha: alpha });
    pen.stroke(pathOf(isFlat ? lines : lines.map((line) => line.map(this.pixel))));
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  dots(points, radius, colour, isHollow = false) {
    const path = new Path2D();
    for (const [x, y] of points.map(this.pixel)) {
      path.moveTo(x + radius, y);
      path.arc(x, y, radius, 0, 2 * Math.PI);
    }
    this.pen.fillStyle = this.pen.strokeStyle = this.colour(colour);
    this.pen[isHollow ? "stroke" : "fill"](path);
  }

  sheet({ ends, image }) {
    const { pen } = this;
    const [corner, right, far] = ends.map(this.pixel);
    const [u, v] = [right, far].map((end) => plus(end, corner, -1));
    pen.save();
    pen.globalAlpha = 0.6;
    pen.transform(...u, ...v, ...corner);
    pen.drawImage(image, 0, 0, 1, 1);
    pen.restore();
  }

  // Edges of the volume; those at the corner behind all others are dotted.
  frame() {
    const behind = this.corners.reduce((one, other) =>
      (this.nearness(other) < this.nearness(one) ? other : one));
    for (const edge of edgesOf(this.corners).flat()) {
      const isRear = !this.flat && edge.includes(behind);
      this.stroke([edge], "--quiet", { dashes: isRear ? [1, 4] : [] });
    }
  }

  // Those faces of a block that are seen.
  faces(corners) {
    const at = corners.map(this.pixel);
    const isSeen = ([[x, y], [x1, y1], , [x2, y2]]) => (x1 - x) * (y2 - y) > (y1 - y) * (x2 - x);
    return pathOf(FACES.map((face) => face.map((k) => at[k])).filter(isSeen));
  }

  block(corners, look, thin = 1) {
    const { colour, fill, width, dashes } = LOOKS[look];
    Object.assign(this.pen, { fillStyle: this.colour(colour), globalAlpha: fill * thin });
    this.pen.fill(this.faces(corners));
    const alpha = look === "quiet" ? 0.4 + 0.3 * thin : 1;
    this.stroke(edgesOf(corners).flat(), colour, { width, dashes, alpha });
  }

  plate(plate, thin) {
    const { look, place: { read, name } } = plate;
    const { ball, colour } = LOOKS[look];
    this.block(this.placed(plate, plate.corners), look, thin);
    if (look !== "off" && thin === 1) {
      const styli = plate.styli.map((ends) => this.placed(plate, ends));
      this.stroke(styli, "--ink", { width: 2 });
      this.dots(styli.map(([, head]) => head), 3.5, "--ink");
    }
    const size = ball * (thin < 1 ? 0.6 : 1) * this.size * this.metre * this.zoom;
    const balls = this.placed(plate, plate.balls).map((point, k) =>
      plus(point, this.moved.get(`${k} ${name}`) ?? [0, 0, 0], this.amplitude));
    for (const isRead of [true, false]) {
      this.dots(balls.filter((_, k) => read[k] === isRead), Math.max(1.2, size), colour, !isRead);
    }
  }

  // The volume's lattice on its faces and through its middle, bent as the direction swings.
  lattice() {
    const { motions: { nodes, direction }, design: { scene: { lower, upper } } } = this;
    const at = (place) => {
      const by = direction.nodes[place.reduce((sum, k) => sum * nodes + k, 0)];
      return place.map((k, axis) => lower[axis] + by[axis] * this.amplitude
        + ((upper[axis] - lower[axis]) * k) / (nodes - 1));
    };
    const some = [0, (nodes - 1) / 2, nodes - 1];
    const others = this.flat ? some.map((i) => [i]) : some.flatMap((i) => some.map((j) => [i, j]));
    return lower.flatMap((_, axis) => others.map((fixed) => [...Array(nodes).keys()].map((k) =>
      at(fixed.toSpliced(axis, 0, k)))));
  }
}

function pathOf(lines) {
  const path = new Path2D();
  lines.forEach((line) => line.forEach((point, k) => path[k ? "lineTo" : "moveTo"](...point)));
  return path;
}
