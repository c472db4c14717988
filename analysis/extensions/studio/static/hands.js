// Mouse and fingers: plates are dragged, stop at walls, and go back when a drag is cancelled.
import { Plane, Vector3 } from "three";

const SNAP = 0.003; // metres from a wall at which a plate goes to it
const OUTSIDE = 1e-6; // metres beyond a wall that count
const HOLD = 500; // milliseconds that a finger rests where something is to be put
const STILL = 6; // pixels that a resting pointer may move
const AXES = ["x", "y", "z"];

export class Hands {
  constructor(view) {
    this.view = view;
    this.drag = this.holding = null;
    this.from = [0, 0]; // where the last pointer went down
    this.fingers = new Set();
    const { canvas } = view;
    // Before the controls, which turn the view unless a plate is dragged.
    canvas.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    canvas.addEventListener("pointerup", (event) => this.release(event, false));
    canvas.addEventListener("pointercancel", (event) => this.release(event, true));
    canvas.addEventListener("pointerleave", () => view.hover(null));
    canvas.addEventListener("dblclick", (event) => this.put(event));
    window.addEventListener("blur", () => this.drop(true));
    window.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !this.drag) return;
      event.preventDefault();
      event.stopPropagation();
      this.drop(true);
    }, { capture: true });
  }

  // Whether the view turns, moves and grows with the pointers.
  free(isFree) {
    const { controls, flat } = this.view;
    controls.enableRotate = isFree && !flat;
    controls.enablePan = controls.enableZoom = isFree;
  }

  press(event) {
    const { view } = this;
    if (event.isPrimary) this.fingers.clear();
    this.fingers.add(event.pointerId);
    clearTimeout(this.holding);
    // Two fingers move the view, and the plate is where it was.
    if (this.fingers.size > 1) this.drop(true);
    else if (event.button === 0 && view.design) {
      this.from = [event.clientX, event.clientY];
      const met = view.under(event);
      if (met) this.grip(event, met);
      else if (event.pointerType === "touch") {
        this.holding = setTimeout(() => this.put(event), HOLD);
      }
    }
  }

  grip({ pointerId }, { plate: { place, normal }, point }) {
    this.free(false);
    this.view.canvas.setPointerCapture(pointerId);
    const by = new Vector3();
    this.drag = { name: place.name, pointerId, point, normal, by, far: false, leaves: false };
    if (place.name !== this.view.selected) this.view.handlers.onSelect(place.name);
  }

  pull(event) {
    const { view, drag } = this;
    const [x, y] = this.from;
    const isStill = Math.hypot(event.clientX - x, event.clientY - y) < STILL;
    if (!isStill) clearTimeout(this.holding);
    if (!drag && event.pointerType !== "touch" && !event.buttons && view.design) {
      view.hover(view.under(event)?.plate.place.name ?? null);
    }
    const plate = drag && view.named(drag.name);
    if (!plate || event.pointerId !== drag.pointerId || (!drag.far && isStill)) return;
    const way = this.way(view.ray(event).ray, event.shiftKey && !view.flat);
    if (!way) return;
    const by = rounded(event.altKey ? way : this.stopped(plate, way), 1e-6);
    if (by.equals(drag.by)) return;
    const moved = plate.extent.clone().translate(by);
    const leaves = !view.volume.clone().expandByScalar(OUTSIDE).containsBox(moved);
    Object.assign(drag, { by, far: true, leaves });
    plate.group.position.copy(by);
    view.dress();
    view.handlers.onDrag(drag.name, this.told(by));
  }

  // How far the pointer has moved the plate: in its plane, or along its normal.
  way(ray, isAlong) {
    const { point, normal } = this.drag;
    const { step } = this.view;
    if (isAlong) {
      // The point of the line through the grip that is nearest to the ray.
      const across = new Vector3().crossVectors(normal, ray.direction);
      const apart = new Vector3().subVectors(ray.origin, point).cross(ray.direction).dot(across);
      const steps = Math.round(apart / across.lengthSq() / step);
      return across.lengthSq() < 1e-6 ? null : normal.clone().multiplyScalar(steps * step);
    }
    const plane = new Plane().setFromNormalAndCoplanarPoint(normal, point);
    const by = ray.intersectPlane(plane, new Vector3());
    if (!by) return null;
    rounded(by.sub(point), step);
    return by.addScaledVector(normal, -by.dot(normal));
  }

  // As far as the scales read within the volume; what is outside already comes back only.
  stopped({ extent }, way) {
    const { min, max } = this.view.volume;
    const by = way.clone();
    let share = 1;
    for (const axis of AXES.filter((one) => Math.abs(way[one]) > 1e-9)) {
      const walls = [min[axis] - extent.min[axis], max[axis] - extent.max[axis]];
      const kept = Math.min(Math.max(way[axis], Math.min(0, walls[0])), Math.max(0, walls[1]));
      share = Math.min(share, kept / way[axis]);
      by[axis] = walls.find((wall) => Math.abs(kept - wall) < SNAP) ?? kept;
    }
    // A plate that leans stops on its way.
    const isStraight = AXES.some((axis) => Math.abs(this.drag.normal[axis]) > 1 - 1e-9);
    return isStraight ? by : way.clone().multiplyScalar(share);
  }

  told(by) {
    return by.toArray().slice(0, this.view.design.scene.dimension);
  }

  release({ pointerId }, isCancelled) {
    clearTimeout(this.holding);
    this.fingers.delete(pointerId);
    if (pointerId === this.drag?.pointerId) this.drop(isCancelled);
  }

  // The end of a drag; if it is cancelled, the plate is where it was and nothing has happened.
  drop(isCancelled) {
    const { drag, view } = this;
    clearTimeout(this.holding);
    if (!drag) return;
    this.drag = null;
    this.free(true);
    if (isCancelled) view.named(drag.name)?.group.position.set(0, 0, 0);
    view.dress();
    if (!view.design || !drag.far) return;
    // The figures are those of the plate that has not moved.
    if (isCancelled) view.handlers.onDrag(drag.name, this.told(new Vector3()));
    else if (drag.by.length()) view.handlers.onDrop(drag.name, this.told(drag.by));
  }

  // Answers that come meanwhile let go of a plate only if it is there no more.
  resume() {
    if (!this.drag) return;
    const plate = this.view.named(this.drag.name);
    if (plate) plate.group.position.copy(this.drag.by);
    else this.drop(true);
  }

  // A position is asked for on the volume's lower face, or else on the nearest plane of a plate.
  put(event) {
    const { view } = this;
    if (!view.design || !view.handlers.onPlace || view.under(event)) return;
    const { ray } = view.ray(event);
    const { min, max } = view.volume;
    const room = view.volume.clone().expandByScalar(OUTSIDE);
    const meet = (normal, point) =>
      ray.intersectPlane(new Plane().setFromNormalAndCoplanarPoint(normal, point), new Vector3());
    const isIn = (point) => point && room.containsPoint(point);
    const planes = view.plates.map(({ normal, middle }) => meet(normal, middle)).filter(isIn);
    planes.sort((a, b) => a.distanceTo(ray.origin) - b.distanceTo(ray.origin));
    const at = [meet(new Vector3(0, 0, 1), min), ...planes].find(isIn);
    if (!at) return;
    view.handlers.onPlace(this.told(rounded(rounded(at, view.step).clamp(min, max), 1e-6)));
  }
}

function rounded(vector, step) {
  return vector.fromArray(vector.toArray().map((one) =>
    Math.round(Math.round(one / step) * step * 1e9) / 1e9 + 0));
}
