// The volume, plates and probes in three dimensions; what is undetermined moves.
import * as THREE from "three";
import { OrbitControls } from "./three/OrbitControls.js";
import { Annotations } from "./annotations.js";
import { Hands } from "./hands.js";

const [TURN, RISE] = [-35, 24]; // degrees: the eye of all drawings of a design
const SHARE = 0.07; // of the volume's size: the largest displacement that is shown
const PERIOD = 2400; // milliseconds of one swing
const [MARGIN, LOWER] = [66, 20]; // pixels around the volume, and more of them above
// Colours by meaning, which are the page's; balls and dashes are as large as a part of the volume.
const LOOKS = {
  quiet: { colour: "--quiet", fill: 0.1, ball: 0.0045 },
  off: { colour: "--line", fill: 0, ball: 0.003 },
  near: { colour: "--ink", fill: 0.1, ball: 0.0045 },
  chosen: { colour: "--accent", fill: 0.3, ball: 0.0075 },
  wrong: { colour: "--bad", fill: 0.2, ball: 0.0075 },
  ghost: { colour: "--ink", fill: 0.03, ball: 0.0045, dashes: [0.014, 0.009] },
  front: { colour: "--quiet" },
  rear: { colour: "--quiet", dashes: [0.003, 0.01] },
  span: { colour: "--ramp-2" },
  pooled: { colour: "--quiet", dashes: [0.005, 0.007] },
  forbidden: { colour: "--bad", fill: 0.14 },
};
const PARTS = ["frame", "sheets", "root", "ghosts", "arrows", "spans", "pooled"];
const kept = (geometry) => Object.assign(geometry, { userData: { kept: true } });
const GLOBE = kept(new THREE.SphereGeometry(1, 16, 12));
const BAR = kept(new THREE.CylinderGeometry(1, 1, 1, 10));
const TIP = kept(new THREE.ConeGeometry(1, 3, 12));
const OPEN = { transparent: true, depthWrite: false };
const Vector = THREE.Vector3;

export class View {
  constructor(canvas, handlers) {
    this.canvas = canvas;
    this.handlers = handlers; // onSelect, onDrag, onDrop, and onPlace if there is one
    this.renderer = new THREE.WebGLRenderer(
      { canvas, antialias: true, preserveDrawingBuffer: true });
    this.ratio = Math.min(window.devicePixelRatio, 2);
    this.renderer.setPixelRatio(this.ratio);
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color();
    this.camera = new THREE.OrthographicCamera();
    this.camera.up.set(0, 0, 1);
    const light = new THREE.HemisphereLight(0xffffff, 0x8899aa, 3);
    light.position.set(0.3, -0.5, 1);
    this.scene.add(light);
    for (const name of PARTS) this.scene.add(this[name] = new THREE.Group());
    this.looks = {};
    for (const [name, { fill = 1, dashes }] of Object.entries(LOOKS)) this.looks[name] = {
      ball: new THREE.MeshLambertMaterial(),
      unread: new THREE.MeshLambertMaterial({ ...OPEN, opacity: 0.22 }),
      fill: new THREE.MeshBasicMaterial({ ...OPEN, opacity: fill }),
      edge: new THREE[dashes ? "LineDashedMaterial" : "LineBasicMaterial"]({ transparent: true }),
    };
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), this.looks.wrong.edge);
    // Its bounds change with every picture.
    this.lines.frustumCulled = false;
    this.scene.add(this.lines);
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.motion = this.near = null; // the direction that swings, the name below the mouse
    this.step = 0.01;
    this.empty();
    this.annotations = new Annotations(this);
    this.hands = new Hands(this);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.resize()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    this.recolour();
  }

  colour(name) {
    return getComputedStyle(this.canvas).getPropertyValue(name).trim();
  }

  recolour() {
    for (const [name, look] of Object.entries(this.looks)) {
      Object.values(look).forEach((one) => one.color.set(this.colour(LOOKS[name].colour)));
    }
    this.scene.background.set(this.colour("--paper"));
    this.ramp = [0, 1, 2].map((k) => {
      const hex = parseInt(this.colour(`--ramp-${k}`).slice(1), 16);
      return [hex >> 16, (hex >> 8) & 255, hex & 255];
    });
    if (this.design) this.map();
    this.draw();
  }

  vector(place) {
    return new Vector(place[0], place[1], place[2] ?? 0);
  }

  show(design, selected) {
    const { dimension, lower, upper, probes, positions } = design.scene;
    const bounds = JSON.stringify([dimension, lower, upper]);
    const isAnswer = design !== this.design;
    const isOther = bounds !== this.bounds;
    if (isOther) this.empty();
    Object.assign(this, { design, selected, bounds });
    if (isOther) this.renew();
    this.map();
    // Plates that stay where they were are not built again.
    const before = new Map(this.plates.map((plate) => [plate.key, plate]));
    this.plates = positions.map((place, index) => {
      const { name, balls, rotation, read } = place;
      const offsets = place.probes.map((probe) => probes[probe]);
      const key = JSON.stringify([name, balls, rotation, read, offsets]);
      const plate = before.get(key) ?? this.plate(place, offsets, this.root);
      before.delete(key);
      if (isAnswer) plate.group.position.set(0, 0, 0);
      plate.block.userData.index = index;
      return Object.assign(plate, { key, place });
    });
    before.forEach((plate) => this.remove(plate.group));
    this.hands.resume();
    // Many plates above one another stay transparent, and are drawn without their styli.
    this.thin = Math.min(1, 8 / this.plates.length);
    this.looks.quiet.fill.opacity = LOOKS.quiet.fill * this.thin;
    this.looks.quiet.edge.opacity = 0.4 + 0.3 * this.thin;
    if (isOther) this.home();
    this.dress();
    this.move(this.motion);
  }

  // Nothing to show: the text has been wrong since it was opened.
  empty() {
    PARTS.forEach((name) => this.clear(this[name]));
    Object.assign(this, { design: null, bounds: null, mapped: null });
    Object.assign(this, { plates: [], offered: [], segments: [], amplitude: 0, thin: 1 });
    this.lines.visible = false;
    this.draw();
  }

  // All that depends on the volume's size.
  renew() {
    const { dimension, lower, upper } = this.design.scene;
    this.flat = dimension === 2;
    this.volume = new THREE.Box3(this.vector(lower), this.vector(upper));
    this.size = this.volume.min.distanceTo(this.volume.max);
    for (const [name, { dashes = [0, 0] }] of Object.entries(LOOKS)) {
      const [dashSize, gapSize] = dashes.map((one) => one * this.size);
      Object.assign(this.looks[name].edge, { dashSize, gapSize });
    }
    const ends = this.lattice(null, 2);
    for (let k = 0; k < ends.length; k += 2) {
      const edge = new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends.slice(k, k + 2)));
      edge.userData.ends = ends.slice(k, k + 2);
      this.frame.add(edge.computeLineDistances());
    }
    this.controls.mouseButtons.LEFT = this.flat ? THREE.MOUSE.PAN : THREE.MOUSE.ROTATE;
    this.controls.touches.ONE = this.flat ? THREE.TOUCH.PAN : THREE.TOUCH.ROTATE;
    this.hands.free(true);
  }

  clear(group) {
    [...group.children].forEach((child) => this.remove(child));
  }

  remove(child) {
    child.removeFromParent();
    child.traverse((one) => {
      if (one.geometry && !one.geometry.userData.kept) one.geometry.dispose();
      if (one.isInstancedMesh) one.dispose();
      if (!one.material?.map) return;
      one.material.map.dispose();
      one.material.dispose();
    });
  }

  // Lines of a lattice through the volume along every axis, on its faces and through its middle.
  lattice(displacement, nodes) {
    const { lower, upper, dimension: d } = this.design.scene;
    const at = (place) => {
      const row = displacement?.[place.reduce((sum, k) => sum * nodes + k, 0)] ?? [0, 0, 0];
      return this.vector(place.map((k, axis) => lower[axis] + row[axis] * this.amplitude
        + ((upper[axis] - lower[axis]) * k) / (nodes - 1)));
    };
    const points = [];
    const some = nodes > 3 ? [0, (nodes - 1) / 2, nodes - 1] : [0, nodes - 1];
    const others = d === 3 ? some.flatMap((i) => some.map((j) => [i, j])) : some.map((i) => [i]);
    for (let axis = 0; axis < d; axis += 1) {
      for (const fixed of others) {
        const [before, after] = [fixed.slice(0, axis), fixed.slice(axis)];
        for (let k = 0; k + 1 < nodes; k += 1) {
          points.push(at([...before, k, ...after]), at([...before, k + 1, ...after]));
        }
      }
    }
    return points;
  }

  // Uncertainty on levels of the volume, as transparent sheets of colours.
  map() {
    const mapped = JSON.stringify([this.design.map, this.ramp]);
    if (mapped === this.mapped) return;
    this.mapped = mapped;
    this.clear(this.sheets);
    const { x, y, slices = [], scale } = this.design.map ?? {};
    const known = slices.flatMap(({ values }) => values.flat()).filter((one) => one !== null);
    // Where everything is undetermined there is nothing to compare.
    if (!known.some(Boolean)) return;
    const { low, high } = scale ?? { low: Math.min(...known), high: Math.max(...known) };
    const [width, depth] = [x.at(-1) - x[0], y.at(-1) - y[0]];
    for (const { level, values } of slices) {
      const pixels = values.flat().flatMap((value) => (value === null ? [120, 120, 120, 90]
        : [...mixed(this.ramp, (value - low) / (high - low || 1)), 140]));
      const map = Object.assign(new THREE.DataTexture(Uint8Array.from(pixels), x.length, y.length),
        { magFilter: THREE.LinearFilter, colorSpace: THREE.SRGBColorSpace, needsUpdate: true });
      const sheet = new THREE.Mesh(new THREE.PlaneGeometry(width, depth),
        new THREE.MeshBasicMaterial({ ...OPEN, map, side: THREE.DoubleSide }));
      sheet.position.set(x[0] + width / 2, y[0] + depth / 2, level ?? 0);
      sheet.renderOrder = -1;
      this.sheets.add(sheet);
    }
  }

  // A plate with its balls, those that are not read last in `order`, and its styli.
  plate(place, offsets, parent) {
    const group = new THREE.Group();
    const balls = place.balls.map(this.vector);
    const order = [...balls.keys()].sort((a, b) => place.read[b] - place.read[a] || a - b);
    const count = place.read.filter(Boolean).length;
    const meshes = [count, balls.length - count].map((many) =>
      Object.assign(new THREE.InstancedMesh(GLOBE, undefined, many), { frustumCulled: false }));
    const used = order.slice(0, count || order.length).map((k) => balls[k]);
    const middle = used.reduce((sum, ball) => sum.add(ball), new Vector());
    middle.divideScalar(used.length);
    const off = (ball) => ball.distanceTo(middle);
    const nearest = used.reduce((best, ball) => (off(ball) < off(best) - 1e-9 ? ball : best));
    const scales = [];
    const styli = new THREE.Group();
    for (const offset of offsets.map(this.vector)) {
      // Walls are for what the scales read: balls less the probe's offset.
      scales.push(...used.map((ball) => ball.clone().sub(offset)));
      if (offset.length() > 1e-9) {
        styli.add(this.rod(nearest, nearest.clone().sub(offset), [0.0018, 0.004, 0.005], "near"));
      }
    }
    const extent = new THREE.Box3().setFromPoints(scales.length ? scales : used);
    const body = this.body(place, balls);
    group.add(...meshes, body.block, body.edges, styli);
    parent.add(group);
    return { place, group, balls, order, count, meshes, extent, middle, styli, ...body };
  }

  // A box around the balls in the plate's own axes, some millimetres thick.
  body(place, balls) {
    const axes = [0, 1, 2].map((k) => (this.flat && k === 2 ? new Vector(0, 0, 1)
      : this.vector(place.rotation.map((row) => row[k]))));
    const pose = new THREE.Matrix4().makeBasis(...axes).setPosition(this.vector(place.origin));
    const inward = pose.clone().invert();
    const around = new THREE.Box3().setFromPoints(
      balls.map((ball) => ball.clone().applyMatrix4(inward)));
    around.expandByVector(new Vector(0.014, 0.014, 0.004).multiplyScalar(this.size));
    const corners = cornersOf(around).map((corner) => corner.applyMatrix4(pose));
    const box = new THREE.BoxGeometry(...around.getSize(new Vector()));
    box.translate(...around.getCenter(new Vector())).applyMatrix4(pose);
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(box)).computeLineDistances();
    return { block: new THREE.Mesh(box), edges, corners, normal: axes[2].normalize() };
  }

  // A bar with a globe or a tip at each end; radii are parts of the volume's size.
  rod(from, to, radii, look, tip = GLOBE) {
    const rod = new THREE.Group();
    const along = to.clone().sub(from);
    radii.map((one) => one * this.size).forEach((radius, k) => {
      const part = new THREE.Mesh([BAR, GLOBE, tip][k], this.looks[look].ball);
      part.scale.set(radius, k ? radius : along.length(), radius);
      part.position.copy(from).addScaledVector(along, [0.5, 0, 1][k]);
      part.quaternion.setFromUnitVectors(new Vector(0, 1, 0), along.clone().normalize());
      rod.add(part);
    });
    return rod;
  }

  named(name) {
    return this.plates.find((plate) => plate.place.name === name);
  }

  dress() {
    const { drag } = this.hands;
    for (const plate of this.plates) {
      const { name, problem, enabled } = plate.place;
      const isWrong = drag?.far && drag.name === name ? drag.leaves : problem;
      wear(plate, this.looks, isWrong ? "wrong" : name === this.selected ? "chosen"
        : enabled === false ? "off" : name === this.near ? "near" : "quiet");
    }
    this.swing();
    this.draw();
  }

  ghost(places) {
    this.clear(this.ghosts);
    this.offered = (this.design && places ? places : []).map((place) => {
      const plate = this.plate(place, [], this.ghosts);
      wear(plate, this.looks, "ghost");
      this.settle(plate);
      return plate;
    });
    this.draw();
  }

  // Outlines of candidates, and boxes that nothing may enter.
  pool(outlines, boxes) {
    this.clear(this.pooled);
    const edge = (corner, k, corners) => [corner, corners[(k + 1) % corners.length]];
    const ends = outlines.flatMap((outline) => outline.map(this.vector).flatMap(edge));
    const thin = new THREE.BufferGeometry().setFromPoints(ends);
    const lines = new THREE.LineSegments(thin, this.looks.pooled.edge);
    this.looks.pooled.edge.opacity = 0.55;
    if (ends.length) this.pooled.add(lines.computeLineDistances());
    for (const box of boxes) {
      const extent = new THREE.Box3(...box.map(this.vector));
      const solid = new THREE.BoxGeometry(...extent.getSize(new Vector()));
      solid.translate(...extent.getCenter(new Vector()));
      this.pooled.add(new THREE.Mesh(solid, this.looks.forbidden.fill),
        new THREE.LineSegments(new THREE.EdgesGeometry(solid), this.looks.forbidden.edge));
    }
    this.draw();
  }

  residuals(found, scale) {
    this.clear(this.arrows);
    found?.place.forEach((place, k) => {
      const from = this.vector(place);
      const by = this.vector(found.value[k]).multiplyScalar(scale);
      if (by.length() < 1e-6) return;
      const look = found.standardised[k] > 3.5 ? "wrong" : "quiet";
      this.arrows.add(this.rod(from, from.clone().add(by), [0.0012, 0.0012, 0.006], look, TIP));
    });
    this.draw();
  }

  // Lengths {from, to, label} as bold lines; none with an empty list.
  lengths(segments) {
    this.clear(this.spans);
    this.segments = segments.map(({ from, to, label }) => {
      const [start, end] = [from, to].map(this.vector);
      this.spans.add(this.rod(start, end, [0.0035, 0.008, 0.008], "span"));
      return { label, middle: start.add(end).multiplyScalar(0.5) };
    });
    this.draw();
  }

  // Let a direction swing, or stop.
  move(index) {
    const isThere = Boolean(this.design?.motions?.directions[index ?? -1]);
    this.motion = isThere ? index : null;
    this.lines.visible = isThere;
    if (!isThere) this.amplitude = 0;
    this.swing();
    this.draw();
    const animate = (now) => {
      if (!this.lines.visible) return;
      const share = this.still ? 1 : Math.sin((2 * Math.PI * now) / PERIOD);
      this.amplitude = SHARE * this.size * share;
      this.swing();
      this.draw();
      if (!this.still) this.next = requestAnimationFrame(animate);
    };
    cancelAnimationFrame(this.next);
    if (isThere) this.next = requestAnimationFrame(animate);
  }

  swing() {
    const data = this.design?.motions;
    const direction = data?.directions[this.motion ?? -1];
    const by = new Map();
    if (direction) {
      this.lines.geometry.setFromPoints(this.lattice(direction.nodes, data.nodes));
      data.position.forEach((position, k) =>
        by.set(`${data.ball[k]} ${data.names[position]}`, direction.readings[k]));
    }
    this.plates.forEach((plate) => this.settle(plate, by));
  }

  // Put the balls of a plate where they are, and as large as they are to be seen.
  settle({ look, balls, order, count, meshes, styli, place }, by) {
    const isThin = look === "quiet" && this.thin < 1;
    const radius = LOOKS[look].ball * this.size * (isThin ? 0.6 : 1);
    styli.visible = look !== "off" && !isThin;
    const matrix = new THREE.Matrix4().makeScale(radius, radius, radius);
    order.forEach((number, k) => {
      const moved = by?.get(`${number} ${place.name}`);
      const at = balls[number].clone();
      if (moved) at.addScaledVector(this.vector(moved), this.amplitude);
      meshes[k < count ? 0 : 1].setMatrixAt(k < count ? k : k - count, matrix.setPosition(at));
    });
    meshes.forEach((mesh) => { mesh.instanceMatrix.needsUpdate = true; });
  }

  home() {
    if (!this.design) return;
    const [turn, rise] = [TURN, RISE].map(THREE.MathUtils.degToRad);
    const from = this.flat ? new Vector(0, -1e-3, 1) : new Vector(
      -Math.sin(turn) * Math.cos(rise), -Math.cos(turn) * Math.cos(rise), Math.sin(rise));
    const { camera, size } = this;
    this.volume.getCenter(this.controls.target);
    camera.position.copy(this.controls.target).addScaledVector(from.normalize(), 10 * size);
    Object.assign(camera, { zoom: 1, near: 0, far: 20 * size });
    camera.lookAt(this.controls.target);
    camera.updateMatrixWorld();
    this.seen = this.volume.clone().applyMatrix4(camera.matrixWorldInverse).getSize(new Vector());
    this.resize();
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.annotations.resize(width, height);
    const { x, y } = this.seen ?? { x: 1, y: 1 };
    const room = [width, height].map((one) => Math.max(one - 2 * MARGIN, 100));
    const half = Math.max(x / room[0], y / room[1]) / 2;
    const [right, top] = [half * width, half * height];
    const off = 2 * half * LOWER;
    Object.assign(this.camera, { right, left: -right, top: top + off, bottom: off - top });
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    // Once for each frame, after the figures, however often it is asked for.
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      if (this.design) this.rear();
      this.renderer.render(this.scene, this.camera);
      this.annotations.write();
    });
  }

  // Edges of the volume behind all others are dotted.
  rear() {
    const away = this.camera.getWorldDirection(new Vector());
    const hidden = cornersOf(this.volume).sort((a, b) => b.dot(away) - a.dot(away))[0];
    for (const edge of this.frame.children) {
      const meets = edge.userData.ends.some((end) => end.distanceTo(hidden) < 1e-6 * this.size);
      edge.material = this.looks[meets && !this.flat ? "rear" : "front"].edge;
    }
  }

  // Pixels of a point from the canvas's corner.
  pixel(point) {
    const { x, y } = point.clone().project(this.camera);
    return [((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight];
  }

  // Where a plate, or a point in metres, is on the screen, for whoever drives the page.
  screen(what) {
    const point = typeof what === "string" ? this.named(what)?.middle : this.vector(what);
    const { left, top } = this.annotations.paper.getBoundingClientRect();
    return point ? this.pixel(point).map((one, k) => one + [left, top][k]) : null;
  }

  ray({ clientX, clientY }) {
    const { left, top, width, height } = this.annotations.paper.getBoundingClientRect();
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2((2 * (clientX - left)) / width - 1,
      1 - (2 * (clientY - top)) / height), this.camera);
    return caster;
  }

  // The plate below a pointer, the chosen one before others, and where it is met.
  under(event) {
    const hits = this.ray(event).intersectObjects(this.plates.map(({ block }) => block));
    const met = hits.map(({ object, point }) =>
      ({ plate: this.plates[object.userData.index], point }));
    return met.find(({ plate }) => plate.place.name === this.selected) ?? met[0];
  }

  hover(name) {
    if (name === this.near) return;
    this.near = name;
    this.canvas.style.cursor = name === null ? "" : "grab";
    this.dress();
  }
}

export function cornersOf({ min, max }) {
  return [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) =>
    [min.z, max.z].map((z) => new Vector(x, y, z))));
}

function wear(plate, looks, look) {
  const { ball, unread, fill, edge } = looks[look];
  plate.look = look;
  [plate.meshes[0].material, plate.meshes[1].material] = [ball, unread];
  [plate.block.material, plate.edges.material] = [fill, edge];
}

function mixed(stops, share) {
  const at = Math.min(1, Math.max(0, share)) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  return stops[k].map((one, c) => Math.round(one + (stops[k + 1][c] - one) * (at - k)));
}
