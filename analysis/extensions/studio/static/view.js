// The volume and its plates in three dimensions; what is undetermined moves. CSS has the looks.
import { annotations } from "./annotations.js";
import { Hands } from "./hands.js";
import { imageOf } from "./legend.js";
import { element, path } from "./paper.js";
import {
  apart, arrow, between, boxOf, clamp, cornersOf, dot, edgesOf, FACES, plateOf, plus, vector,
} from "./shapes.js";

const [TURN, RISE] = [-35, 24]; // degrees: the eye of all drawings of a design
const SHARE = 0.07; // of the volume's size: the largest displacement that is shown
const [PERIOD, PAUSE] = [2400, 60]; // milliseconds of one swing, and from a picture to the next
const [MARGIN, LOWER] = [66, 20]; // pixels around the volume, and more of them above
const [BALL, LARGE] = [0.009, 0.015]; // parts of the volume's size: balls, and those of a choice
const MANY = 8; // plates: more are drawn thinner

export class View {
  constructor(svg, handlers) {
    // Handlers are onSelect, onDrag, onDrop and onPlace.
    Object.assign(this, { svg, handlers, step: 0.01 });
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.hands = new Hands(this);
    this.empty();
    new ResizeObserver(() => this.resize()).observe(svg);
    matchMedia("(prefers-color-scheme: dark)").onchange = () => this.colourMap();
  }

  // Nothing to show: the text has been wrong since it was opened. Outlines are those of candidates,
  // boxes hold nothing, and segments are {from, to, label}.
  empty() {
    Object.assign(this, { design: null, bounds: null, map: null, residuals: null });
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
    this.svg.classList.toggle("many", positions.length > MANY);
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
    const colour = (name) => getComputedStyle(this.svg).getPropertyValue(name);
    // Where everything is undetermined there is nothing to compare.
    const slices = map?.slices.filter(({ values }) => values.flat().some(Number.isFinite)) ?? [];
    const sheets = slices.map(({ level, values }) => {
      const corner = (i, j) => [map.x.at(i), map.y.at(j), level ?? 0];
      const image = imageOf(map, values, colour);
      return { ends: [corner(0, 0), corner(-1, 0), corner(0, -1)], image, href: image.toDataURL() };
    });
    this.set({ sheets });
  }

  named = (name) => this.plates.find((plate) => plate.place.name === name);

  dress() {
    const { drag } = this.hands;
    for (const plate of this.plates) {
      const { name, problem, enabled } = plate.place;
      const isWrong = drag?.far && drag.name === name ? drag.leaves : problem;
      plate.look = isWrong ? "wrong" : name === this.selected ? "chosen"
        : enabled === false ? "off" : "quiet";
    }
    this.set({});
  }

  ghost(places) {
    const offered = this.design ? places : [];
    this.set({ offered: offered.map((place) => plateOf(place, [], this.size, "ghost")) });
  }

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
    const { width, height } = this.svg.getBoundingClientRect();
    this.room = [width, height];
    if (!this.design || !width) return;
    const sides = plus(this.seen.max, this.seen.min, -1);
    this.metre = Math.min(...this.room.map((side, k) =>
      Math.max(side - 2 * MARGIN, 100) / sides[k]));
    this.set({});
  }

  // Enlarge the picture about a pixel.
  enlarge(times, at) {
    const zoom = clamp(this.zoom * times, 0.2, 50);
    const middle = this.pixel(between(this.volume.min, this.volume.max));
    const shift = plus(this.shift, plus(at, middle, -1), 1 - zoom / this.zoom);
    this.set({ zoom, shift });
  }

  // Pixels of a point from the picture's corner.
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

  paint(now) {
    this.next = null;
    if (!this.design || !this.metre) {
      this.svg.replaceChildren();
      return;
    }
    if (this.motions && !this.still) {
      this.amplitude = SHARE * this.size * Math.sin((2 * Math.PI * now) / PERIOD);
      clearTimeout(this.swing);
      this.swing = setTimeout(() => this.set({}), PAUSE);
    }
    const nearness = ({ place, middle }) =>
      (place.name === this.selected ? Infinity : dot(middle, this.eye[2]));
    const plates = [...this.plates].sort((one, other) => nearness(one) - nearness(other));
    const lengths = this.segments.map(({ from, to }) => [from, to]);
    this.svg.replaceChildren(
      ...this.sheets.map((sheet) => this.sheet(sheet)),
      ...this.frame(),
      this.lines(this.outlines.map((outline) => [...outline, outline[0]]), "outline"),
      ...this.boxes.map((ends) => this.block(cornersOf(boxOf(ends.map(vector))), "forbidden")),
      ...(this.design.part?.boxes ?? []).map((box) => this.block(box, "workpiece")),
      ...[...plates, ...this.offered].map((plate) => this.plate(plate)),
      this.lines(this.motions ? this.lattice() : [], "lattice"),
      ...this.arrows(),
      this.lines(lengths, "worst"),
      this.dots(lengths.flat(), 10, "worst"),
      ...annotations(this),
    );
  }

  lines = (lines, look) => path(lines.map((line) => line.map(this.pixel)), look);
  // Lines without a length have round ends.
  dots = (points, size, look) => element("path", { class: `dots ${look}`, "stroke-width": size,
    d: points.map((point) => `M${this.pixel(point)}h0`).join("") });

  sheet({ ends, href }) {
    const [corner, right, far] = ends.map(this.pixel);
    const [u, v] = [right, far].map((end) => plus(end, corner, -1));
    return element("image", { href, width: 1, height: 1, preserveAspectRatio: "none",
      transform: `matrix(${[...u, ...v, ...corner]})` });
  }

  // Edges of the volume; those at the corner behind all others are dotted.
  frame() {
    const nearness = (corner) => dot(corner, this.eye[2]);
    const behind = this.corners.reduce((one, other) =>
      (nearness(other) < nearness(one) ? other : one));
    const edges = edgesOf(this.corners).flat();
    const isRear = (edge) => !this.flat && edge.includes(behind);
    return [this.lines(edges.filter(isRear), "rear"),
      this.lines(edges.filter((edge) => !isRear(edge)), "edges")];
  }

  // Those faces of a block that are seen, and all its edges.
  block(corners, look, ...inside) {
    const at = corners.map(this.pixel);
    const isSeen = ([[x, y], [x1, y1], , [x2, y2]]) => (x1 - x) * (y2 - y) > (y1 - y) * (x2 - x);
    const faces = FACES.map((face) => face.map((k) => at[k])).filter(isSeen);
    return element("g", { class: look }, path(faces, "faces"), path(edgesOf(at).flat(), "edges"),
      ...inside);
  }

  plate(plate) {
    const { look, place: { read, name } } = plate;
    const part = ["chosen", "wrong"].includes(look) ? LARGE : BALL;
    const size = Math.max(2.4, part * this.size * this.metre * this.zoom);
    const balls = plate.balls.map((point, k) =>
      plus(point, this.moved.get(`${k} ${name}`) ?? [0, 0, 0], this.amplitude));
    const unread = balls.filter((_, k) => !read[k]);
    const block = this.block(plate.corners, `plate ${look}`, this.lines(plate.styli, "styli"),
      this.dots(plate.styli.map(([, head]) => head), 7, "styli"),
      this.dots(balls, size, "balls"), this.dots(unread, size - 2, "holes"),
      element("title", {}, name));
    if (look === "ghost") return block;
    block.dataset.name = name;
    // Where it has been dragged to.
    const [from, to] = [[0, 0, 0], this.hands.offset(name)].map(this.pixel);
    block.setAttribute("transform", `translate(${plus(to, from, -1)})`);
    return block;
  }

  // Residuals at the balls.
  arrows() {
    const { place = [], value, standardised, scale } = this.residuals ?? {};
    return place.map((from, k) => path(
      arrow(...[from, plus(from, value[k], scale)].map(this.pixel)),
      standardised[k] > 3.5 ? "residual large" : "residual"));
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
