// The volume, plates and probes in three dimensions; what is undetermined moves.
import * as THREE from "three";
import { OrbitControls } from "./three/OrbitControls.js";

const COLOURS = [0x1565a8, 0xd1495b, 0x2a9d63, 0xc77d0a, 0x7b4fb5, 0x0f8b8d, 0xa8577e, 0x6b7a1e];
const SHARE = 0.07; // of the volume's size: the largest displacement that is shown
const PERIOD = 2400; // milliseconds of one swing

export function colourOf(index) {
  return `#${COLOURS[index % COLOURS.length].toString(16).padStart(6, "0")}`;
}

export class View {
  constructor(canvas, { onSelect, onDrag, onDrop }) {
    this.canvas = canvas;
    this.handlers = { onSelect, onDrag, onDrop };
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.01, 200);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, -3, 4);
    this.scene.add(sun);
    this.root = new THREE.Group();
    this.ghosts = new THREE.Group();
    this.arrows = new THREE.Group();
    this.scene.add(this.root, this.ghosts, this.arrows);
    this.plates = [];
    this.labels = new Map();
    this.motion = null;
    this.still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.drag = null;
    this.step = 0.01;
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    this.resize();
  }

  vector(place) {
    return new THREE.Vector3(place[0], place[1], place.length > 2 ? place[2] : 0);
  }

  show(design, selected, { withMap = true } = {}) {
    const first = !this.design;
    const other = this.design && JSON.stringify(this.design.scene.upper) !== JSON.stringify(design.scene.upper);
    this.design = design;
    this.selected = selected;
    this.clear(this.root);
    this.plates = [];
    const { lower, upper } = design.scene;
    this.low = this.vector(lower);
    this.high = this.vector(upper);
    this.size = this.high.distanceTo(this.low);
    this.box();
    // Many sheets above one another stay transparent.
    this.thin = Math.min(1, 8 / Math.max(1, design.scene.positions.length));
    if (withMap) this.map();
    design.scene.positions.forEach((place, index) => this.plate(place, index));
    if (first || other) this.home();
    this.move(this.motion);
    this.draw();
  }

  clear(group) {
    for (const child of [...group.children]) {
      group.remove(child);
      child.traverse((one) => {
        one.geometry?.dispose();
        if (one.material) [one.material].flat().forEach((m) => { if (!one.isSprite) m.map?.dispose(); m.dispose(); });
      });
    }
  }

  dark() {
    return window.matchMedia("(prefers-color-scheme: dark)").matches;
  }

  lattice(displacement, nodes) {
    // Lines of a lattice through the volume along every axis, on its faces and through its middle.
    const d = this.design.scene.dimension;
    const { lower, upper } = this.design.scene;
    const at = (...k) => {
      const place = k.map((one, axis) => lower[axis] + ((upper[axis] - lower[axis]) * one) / (nodes - 1));
      const found = this.vector(place);
      if (displacement) {
        const row = displacement[k.reduce((sum, one) => sum * nodes + one, 0)];
        found.addScaledVector(this.vector(row), this.amplitude ?? 0);
      }
      return found;
    };
    const points = [];
    const some = nodes > 3 ? [0, (nodes - 1) / 2, nodes - 1] : [0, nodes - 1];
    const others = d === 3 ? some.flatMap((i) => some.map((j) => [i, j])) : some.map((i) => [i]);
    for (let axis = 0; axis < d; axis += 1) {
      for (const fixed of others) {
        for (let k = 0; k + 1 < nodes; k += 1) {
          const one = [...fixed];
          const two = [...fixed];
          one.splice(axis, 0, k);
          two.splice(axis, 0, k + 1);
          points.push(at(...one), at(...two));
        }
      }
    }
    return points;
  }

  box() {
    const colour = this.dark() ? 0x8796a8 : 0x68778a;
    const corners = this.lattice(null, 2);
    const geometry = new THREE.BufferGeometry().setFromPoints(corners);
    this.root.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour })));
    "xyz".slice(0, this.design.scene.dimension).split("").forEach((name, axis) => {
      // Beside the middle of edges that are outermost as the volume is seen first.
      const at = this.low.clone().add(this.high).multiplyScalar(0.5);
      const away = 0.1 * this.size;
      if (axis === 0) at.set(at.x, this.low.y - away, this.low.z);
      if (axis === 1) at.set(this.low.x - away, at.y, this.low.z);
      if (axis === 2) at.set(this.high.x + 0.7 * away, this.low.y - 0.7 * away, at.z);
      const metres = this.high.getComponent(axis) - this.low.getComponent(axis);
      this.root.add(this.label(`${name}  ${Math.round(1e4 * metres) / 10} mm`, at, 0.038 * this.size));
    });
  }

  label(text, place, height) {
    const key = `${text} ${this.dark()}`;
    if (!this.labels.has(key)) this.labels.set(key, this.written(text));
    const texture = this.labels.get(key);
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture, depthTest: false }));
    sprite.renderOrder = 10;
    sprite.scale.set((height * texture.image.width) / texture.image.height, height, 1);
    sprite.position.copy(place);
    return sprite;
  }

  written(text) {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("2d");
    context.font = "48px system-ui, sans-serif";
    canvas.width = Math.ceil(context.measureText(text).width) + 16;
    canvas.height = 64;
    context.font = "48px system-ui, sans-serif";
    context.fillStyle = this.dark() ? "#d4dde8" : "#2b3642";
    context.textBaseline = "middle";
    context.fillText(text, 8, 34);
    return new THREE.CanvasTexture(canvas);
  }

  map() {
    // Uncertainty of corrected points on levels of the volume, as a transparent sheet of colours.
    const { map } = this.design;
    if (!map) return;
    const values = map.slices.flatMap((slice) => slice.values.flat()).filter((v) => v !== null);
    // Where everything is undetermined there is nothing to compare.
    if (!values.length || Math.max(...values) === 0) return;
    const low = Math.min(...values);
    const high = Math.max(...values);
    for (const slice of map.slices) {
      const size = map.x.length;
      const pixels = new Uint8Array(4 * size * map.y.length);
      slice.values.flat().forEach((value, k) => {
        const share = value === null ? null : high > low ? (value - low) / (high - low) : 0;
        pixels.set(share === null ? [120, 120, 120, 150] : [...ramp(share), 105], 4 * k);
      });
      const texture = new THREE.DataTexture(pixels, size, map.y.length);
      texture.magFilter = THREE.LinearFilter;
      texture.colorSpace = THREE.SRGBColorSpace;
      texture.needsUpdate = true;
      const width = map.x.at(-1) - map.x[0];
      const depth = map.y.at(-1) - map.y[0];
      const sheet = new THREE.Mesh(
        new THREE.PlaneGeometry(width, depth),
        new THREE.MeshBasicMaterial({ map: texture, transparent: true, side: THREE.DoubleSide, depthWrite: false }),
      );
      sheet.position.set(map.x[0] + width / 2, map.y[0] + depth / 2, slice.level ?? 0);
      sheet.renderOrder = -1;
      this.root.add(sheet);
    }
  }

  mapRange() {
    if (!this.design.map) return null;
    const every = this.design.map.slices.flatMap((slice) => slice.values.flat());
    const values = every.filter((v) => v !== null);
    return values.length ? { low: Math.min(...values), high: Math.max(...values), open: values.length < every.length } : null;
  }

  // Nothing to show: the text has been wrong since it was opened.
  empty() {
    this.design = null;
    this.move(null);
    this.clear(this.root);
    this.plates = [];
    this.draw();
  }

  plate(place, index, ghost = false) {
    const group = new THREE.Group();
    const chosen = place.name === this.selected && !ghost;
    const colour = ghost ? 0x2a9d63 : place.problem ? 0xd7301f : place.enabled === false ? 0x888888
      : COLOURS[index % COLOURS.length];
    const balls = place.balls.map((ball) => this.vector(ball));
    const radius = Math.max(0.006 * this.size, 0.002);
    const sphere = new THREE.SphereGeometry(radius, 12, 8);
    const material = new THREE.MeshLambertMaterial({ color: colour, transparent: ghost, opacity: ghost ? 0.45 : 1 });
    const faint = new THREE.MeshLambertMaterial({ color: colour, transparent: true, opacity: 0.22 });
    const read = balls.filter((_, k) => place.read[k]);
    const unread = balls.filter((_, k) => !place.read[k]);
    const meshes = [];
    for (const [which, look] of [[read, material], [unread, faint]]) {
      if (!which.length) continue;
      const mesh = new THREE.InstancedMesh(sphere, look, which.length);
      which.forEach((ball, k) => mesh.setMatrixAt(k, new THREE.Matrix4().setPosition(ball)));
      group.add(mesh);
      meshes.push(mesh);
    }
    const sheet = this.sheet(place, balls, colour, chosen, ghost);
    group.add(...sheet);
    if (!ghost) {
      const middle = balls[Math.floor(balls.length / 2)];
      for (const probe of place.probes) {
        const offset = this.vector(this.design.scene.probes[probe]);
        if (offset.length() < 1e-9) continue;
        const points = [middle, middle.clone().sub(offset)];
        const line = new THREE.Line(
          new THREE.BufferGeometry().setFromPoints(points),
          new THREE.LineBasicMaterial({ color: colour }),
        );
        group.add(line);
      }
      this.plates.push({ place, group, balls, read, mesh: place.read.some(Boolean) ? meshes[0] : null, sheet: sheet[0] });
      sheet[0].userData.index = this.plates.length - 1;
    }
    (ghost ? this.ghosts : this.root).add(group);
    return group;
  }

  sheet(place, balls, colour, chosen, ghost) {
    // The rectangle that the balls lie in, in the plate's own axes.
    const d = this.design.scene.dimension;
    const axis = (k) => this.vector(place.rotation.map((row) => row[k]));
    const u = axis(0);
    const v = axis(1);
    const origin = this.vector(place.origin);
    const along = balls.map((ball) => ball.clone().sub(origin).dot(u));
    const across = balls.map((ball) => ball.clone().sub(origin).dot(v));
    const out = d === 3 ? balls.reduce((sum, ball) => sum + ball.clone().sub(origin).dot(axis(2)), 0) / balls.length : 0;
    const edge = 0.012 * this.size;
    const [left, right] = [Math.min(...along) - edge, Math.max(...along) + edge];
    const [bottom, top] = [Math.min(...across) - edge, Math.max(...across) + edge];
    const corner = (a, b) => {
      const point = origin.clone().addScaledVector(u, a).addScaledVector(v, b);
      return d === 3 ? point.addScaledVector(axis(2), out) : point;
    };
    const corners = [corner(left, bottom), corner(right, bottom), corner(right, top), corner(left, top)];
    const geometry = new THREE.BufferGeometry().setFromPoints(corners);
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
      color: colour, transparent: true, opacity: ghost ? 0.08 : chosen ? 0.3 : 0.13 * this.thin, side: THREE.DoubleSide, depthWrite: false,
    }));
    const line = new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(corners), new THREE.LineBasicMaterial({ color: colour, transparent: ghost, opacity: ghost ? 0.7 : 1 }));
    return [mesh, line];
  }

  ghost(places) {
    this.clear(this.ghosts);
    (places ?? []).forEach((place, index) => this.plate(place, index, true));
    this.draw();
  }

  residuals(found, scale) {
    this.clear(this.arrows);
    if (found) {
      found.place.forEach((place, k) => {
        const value = this.vector(found.value[k]).multiplyScalar(scale);
        if (value.length() < 1e-6) return;
        const hot = found.standardised[k] > 3.5;
        this.arrows.add(new THREE.ArrowHelper(value.clone().normalize(), this.vector(place), value.length(), hot ? 0xd7301f : 0x555555, 0.25 * value.length(), 0.12 * value.length()));
      });
    }
    this.draw();
  }

  move(index) {
    // Let a direction swing, or stop.
    this.motion = index;
    if (this.lines) {
      this.scene.remove(this.lines);
      this.lines.geometry.dispose();
      this.lines = null;
    }
    const direction = this.design?.motions?.directions[index ?? -1];
    if (!direction) {
      this.motion = null;
      this.amplitude = 0;
      this.swing();
      this.draw();
      return;
    }
    const colour = this.dark() ? 0xff8a80 : 0xb3261e;
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour }));
    // Its bounds change with every picture.
    this.lines.frustumCulled = false;
    this.scene.add(this.lines);
    const animate = (now) => {
      if (this.motion !== index || !this.lines) return;
      this.amplitude = SHARE * this.size * (this.still ? 1 : Math.sin((2 * Math.PI * now) / PERIOD));
      this.swing();
      this.draw();
      if (!this.still) requestAnimationFrame(animate);
    };
    requestAnimationFrame(animate);
  }

  swing() {
    if (!this.design) return;
    const data = this.design.motions ?? { directions: [] };
    const direction = this.motion === null ? null : data.directions[this.motion];
    if (direction && this.lines) this.lines.geometry.setFromPoints(this.lattice(direction.nodes, data.nodes));
    this.plates.forEach((plate, index) => {
      if (!plate.mesh) return;
      const by = new Map();
      if (direction) {
        data.position.forEach((position, k) => {
          if (data.names[position] === plate.place.name) by.set(data.ball[k], direction.readings[k]);
        });
      }
      let k = 0;
      plate.balls.forEach((ball, number) => {
        if (!plate.place.read[number]) return;
        const place = ball.clone();
        if (by.has(number)) place.addScaledVector(this.vector(by.get(number)), this.amplitude);
        plate.mesh.setMatrixAt(k, new THREE.Matrix4().setPosition(place));
        k += 1;
      });
      plate.mesh.instanceMatrix.needsUpdate = true;
    });
  }

  home() {
    if (!this.design) return;
    const middle = this.low.clone().add(this.high).multiplyScalar(0.5);
    const flat = this.design.scene.dimension === 2;
    const from = flat ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(-0.75, -1.15, 0.72);
    const narrow = Math.max(1, 1.15 / Math.max(this.camera.aspect, 0.2));
    this.camera.position.copy(middle).addScaledVector(from.normalize(), 1.62 * this.size * narrow);
    this.controls.target.copy(middle);
    this.controls.update();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    // Once for each frame, after the figures, however often it is asked for.
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.scene.background = new THREE.Color(this.dark() ? 0x14181e : 0xfbfcfe);
      this.renderer.render(this.scene, this.camera);
    });
  }

  ray(event) {
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(
      (2 * (event.clientX - box.left)) / box.width - 1,
      1 - (2 * (event.clientY - box.top)) / box.height,
    );
    const caster = new THREE.Raycaster();
    caster.setFromCamera(at, this.camera);
    return caster;
  }

  // Where a plate is on the screen, for tests and for whoever drives the page.
  screen(name) {
    const plate = this.plates.find((one) => one.place.name === name);
    if (!plate) return null;
    const middle = plate.balls.reduce((sum, ball) => sum.add(ball), new THREE.Vector3()).divideScalar(plate.balls.length);
    middle.project(this.camera);
    const box = this.canvas.getBoundingClientRect();
    return [box.left + ((middle.x + 1) / 2) * box.width, box.top + ((1 - middle.y) / 2) * box.height];
  }

  press(event) {
    if (event.button !== 0) return;
    const caster = this.ray(event);
    const hits = caster.intersectObjects(this.plates.map((plate) => plate.sheet));
    const chosen = hits.find((hit) => this.plates[hit.object.userData.index].place.name === this.selected);
    const hit = chosen ?? hits[0];
    if (!hit) return;
    const plate = this.plates[hit.object.userData.index];
    this.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    if (plate.place.name !== this.selected) this.handlers.onSelect(plate.place.name);
    const normal = this.vector(plate.place.rotation.map((row) => row.at(-1)));
    if (this.design.scene.dimension === 2) normal.set(0, 0, 1);
    this.drag = { name: plate.place.name, from: hit.point.clone(), normal: normal.normalize(), by: [0, 0, 0], far: false };
  }

  pull(event) {
    if (!this.drag) return;
    const { from, normal } = this.drag;
    const ray = this.ray(event).ray;
    const by = new THREE.Vector3();
    if (event.shiftKey && this.design.scene.dimension === 3) {
      // Along the normal: the point of the line through the grip that is nearest to the ray.
      const across = new THREE.Vector3().crossVectors(normal, ray.direction);
      const length = across.lengthSq();
      if (length < 1e-6) return;
      const amount = new THREE.Vector3().subVectors(ray.origin, from).cross(ray.direction).dot(across) / length;
      by.copy(normal).multiplyScalar(Math.round(amount / this.step) * this.step);
    } else {
      const hit = ray.intersectPlane(new THREE.Plane().setFromNormalAndCoplanarPoint(normal, from), new THREE.Vector3());
      if (!hit) return;
      const moved = hit.sub(from);
      by.set(...moved.toArray().map((one) => Math.round(one / this.step) * this.step));
      const along = by.dot(normal);
      by.addScaledVector(normal, -along);
    }
    const next = by.toArray().map((one) => Math.round(one * 1e6) / 1e6).slice(0, this.design.scene.dimension);
    if (JSON.stringify(next) === JSON.stringify(this.drag.by)) return;
    this.drag.by = next;
    this.drag.far = true;
    const plate = this.plates.find((one) => one.place.name === this.drag.name);
    plate?.group.position.copy(this.vector(next));
    this.draw();
    this.handlers.onDrag(this.drag.name, next);
  }

  release(event) {
    this.controls.enabled = true;
    if (!this.drag) return;
    this.canvas.releasePointerCapture(event.pointerId);
    const { name, by, far } = this.drag;
    this.drag = null;
    if (far) this.handlers.onDrop(name, by);
  }
}

function ramp(share) {
  const stops = [[44, 127, 184], [255, 255, 191], [215, 48, 31]];
  const at = Math.min(share * 2, 1.999999);
  const k = Math.floor(at);
  return stops[k].map((one, c) => Math.round(one + (stops[k + 1][c] - one) * (at - k)));
}
