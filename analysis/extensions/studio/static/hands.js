// Mouse and fingers: plates are dragged, stop at walls, and go back when a drag is cancelled; what
// is dragged elsewhere turns, moves and enlarges the view.
import { apart, between, clamp, dot, plus } from "./shapes.js";

const OUTSIDE = 1e-6; // metres beyond a wall that count
const HOLD = 500; // milliseconds that a finger rests where something is to be put
const STILL = 6; // pixels that a resting pointer may move
const NOWHERE = [0, 0, 0];

export class Hands {
  constructor(view) {
    Object.assign(this, { view, drag: null, holding: null });
    this.fingers = new Map(); // pixels of pointers that are down
    this.dropped = new Map(); // how far plates were dragged whose answers have not come
    const on = (type, does) => view.svg.addEventListener(type, does, { passive: false });
    on("pointerdown", (event) => this.press(event));
    on("pointermove", (event) => this.pull(event));
    on("pointerup", (event) => this.release(event, false));
    on("pointercancel", (event) => this.release(event, true));
    // Where it was pressed: this event itself is in whole pixels.
    on("dblclick", () => this.pressed || this.put(this.from));
    on("contextmenu", (event) => event.preventDefault());
    on("wheel", (event) => {
      event.preventDefault();
      const step = event.ctrlKey ? 0.99 : 0.999; // two fingers on a pad, or a wheel
      if (view.design) view.enlarge(step ** event.deltaY, this.pixel(event));
    });
    window.addEventListener("blur", () => this.drop(true));
    window.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !this.drag) return;
      event.preventDefault();
      event.stopPropagation();
      this.fingers.clear();
      this.drop(true);
    }, { capture: true });
  }

  pixel({ clientX, clientY }) {
    const { left, top } = this.view.svg.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  // How far a plate is drawn from where it is.
  offset(name) {
    const { drag, dropped } = this;
    return drag?.name === name ? plus(drag.start, drag.by) : dropped.get(name) ?? NOWHERE;
  }

  press(event) {
    const { view, fingers } = this;
    const { pointerId } = event;
    if (event.isPrimary) fingers.clear();
    const at = this.pixel(event);
    fingers.set(pointerId, at);
    view.svg.setPointerCapture(pointerId);
    clearTimeout(this.holding);
    // Two fingers move the view, and the plate is where it was.
    if (fingers.size > 1) this.drop(true);
    if (fingers.size > 1 || event.button !== 0 || !view.design) return;
    this.from = at;
    this.pressed = event.target.closest("[data-name]");
    if (!this.pressed) {
      if (event.pointerType === "touch") this.holding = setTimeout(() => this.put(at), HOLD);
      return;
    }
    const { name } = this.pressed.dataset;
    this.drag = { name, pointerId, start: this.offset(name), by: NOWHERE };
    if (name !== view.selected) view.handlers.onSelect(name);
  }

  pull(event) {
    const { view, drag, fingers } = this;
    const at = this.pixel(event);
    const before = fingers.get(event.pointerId);
    if (!before || !view.design) return;
    fingers.set(event.pointerId, at);
    const isFar = apart(at, this.from ?? at) >= STILL;
    if (isFar) clearTimeout(this.holding);
    if (!drag) this.look(event, before, at);
    else if (event.pointerId === drag.pointerId && (drag.far || isFar)) this.carry(event, at);
  }

  // Turn the view, or move it, with a second finger that enlarges it.
  look({ pointerId, buttons, ctrlKey, metaKey, shiftKey }, before, at) {
    const { view, fingers } = this;
    const [, other] = [...fingers].find(([id]) => id !== pointerId) ?? [];
    const by = plus(at, before, -1);
    if (other) {
      view.shift = plus(view.shift, by, 0.5);
      view.enlarge(apart(at, other) / (apart(before, other) || 1), between(at, other));
    } else if (view.flat || buttons > 1 || ctrlKey || metaKey || shiftKey) {
      view.set({ shift: plus(view.shift, by) });
    } else {
      const [turn, rise] = by.map((pixels) => (360 * pixels) / view.room[1]); // in degrees
      view.set({ turn: view.turn + turn, rise: clamp(view.rise + rise, -90, 90) });
    }
  }

  // The plate goes with the pointer, in its plane or along its normal.
  carry(event, at) {
    const { view, drag } = this;
    const plate = view.named(drag.name);
    const way = plate && this.way(plate, at, event.shiftKey && !view.flat);
    if (!way) return;
    const extent = Object.values(plate.extent).map((end) => plus(end, drag.start));
    const by = rounded(event.altKey ? way : this.stopped(extent, plate.normal, way), 1e-6);
    if (!apart(by, drag.by)) return;
    const leaves = extent.some((end) => !this.isInside(plus(end, by)));
    Object.assign(drag, { by, far: true, leaves });
    view.dress();
    view.handlers.onDrag(drag.name, this.components(by));
  }

  way({ normal, middle }, at, isAlong) {
    const { view, from } = this;
    const { eye: [, , towards], step } = view;
    // Along the normal, in the plane with it that faces the eye most.
    const facing = isAlong ? plus(towards, normal, -dot(towards, normal)) : normal;
    const [start, end] = [from, at].map((one) => view.meet(one, facing, middle));
    if (!start) return null;
    const by = plus(end, start, -1);
    if (isAlong) return plus(NOWHERE, normal, Math.round(dot(by, normal) / step) * step);
    const steps = rounded(by, step);
    return plus(steps, normal, -dot(steps, normal));
  }

  // As far as the scales read within the volume; what is outside already comes back only.
  stopped([low, high], normal, way) {
    const { min, max } = this.view.volume;
    const [below, above] = [plus(min, low, -1), plus(max, high, -1)];
    const kept = way.map((one, k) => clamp(one, Math.min(0, below[k]), Math.max(0, above[k])));
    // A plate that leans stops on its way.
    const isStraight = normal.some((one) => Math.abs(one) > 1 - 1e-9);
    const shares = kept.map((one, k) => (Math.abs(way[k]) > 1e-9 ? one / way[k] : 1));
    return isStraight ? kept : plus(NOWHERE, way, Math.min(...shares));
  }

  components = (vector) => vector.slice(0, this.view.flat ? 2 : 3);

  isInside(point) {
    const { min, max } = this.view.volume;
    return point.every((one, k) => one === clamp(one, min[k] - OUTSIDE, max[k] + OUTSIDE));
  }

  release({ pointerId }, isCancelled) {
    clearTimeout(this.holding);
    this.fingers.delete(pointerId);
    if (pointerId === this.drag?.pointerId) this.drop(isCancelled);
  }

  // The end of a drag; if it is cancelled, the plate is where it was and nothing has happened.
  async drop(isCancelled) {
    const { drag, view } = this;
    clearTimeout(this.holding);
    if (!drag) return;
    this.drag = null;
    const { name, start, by, far } = drag;
    const isDone = far && !isCancelled && view.named(name);
    if (isDone) this.dropped.set(name, plus(start, by));
    view.dress();
    // The figures are those of the plate that has not moved.
    if (far && !isDone && view.design) view.handlers.onDrag(name, this.components(NOWHERE));
    if (!isDone || !by.some(Boolean)) return;
    if (await view.handlers.onDrop(name, this.components(by)) !== false) return;
    this.settle();
    view.dress();
  }

  // A design has come, or a change was refused: plates are where it has them.
  settle() {
    this.dropped.clear();
    if (this.drag) this.drag.start = NOWHERE;
  }

  // A position is asked for on the floor of the volume.
  put(at) {
    const { view } = this;
    if (!view.design) return;
    const { min, max } = view.volume;
    const point = view.meet(at, [0, 0, 1], min);
    if (!point || !this.isInside(point)) return;
    const inside = rounded(point, view.step).map((one, k) => clamp(one, min[k], max[k]));
    view.handlers.onPlace(this.components(rounded(inside, 1e-6)));
  }
}

const rounded = (vector, step) => vector.map((one) =>
  Math.round(Math.round(one / step) * step * 1e9) / 1e9 + 0);
