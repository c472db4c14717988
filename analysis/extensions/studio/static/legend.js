// The legend of the map.
import { $, make, micro, page } from "./page.js";

// How far colours of the map go, in words.
export function legend() {
  const kind = $("map").value;
  const { map } = page.state.design ?? {};
  const values = map?.slices.flatMap((slice) => slice.values.flat()) ?? [];
  const known = values.filter((value) => value !== null);
  $("legend").replaceChildren();
  if (!kind || !map) return;
  if (!known.length) {
    $("legend").append("Map: everything is undetermined, so that there is nothing to colour.");
    return;
  }
  const to_target = map.scale?.unit === "target";
  const words = (value) => (to_target ? `${Number(value.toPrecision(2))}` : `${micro(value)} µm`);
  const [least, most] = [Math.min(...known), Math.max(...known)];
  const high = map.scale?.high ?? most;
  const ramp = make("span", { class: "ramp" });
  if (to_target && high > 1) {
    const mark = make("i");
    mark.style.left = `${100 / high}%`;
    ramp.append(mark);
  }
  $("legend").append(
    to_target ? "Largest uncertainty of the lengths from each point, as a ratio to the target: "
      : kind === "lengths" ? "Largest standard uncertainty of the lengths from each point: "
        : "Standard uncertainty of a corrected co-ordinate, which depends on the origin: ",
    make("span", { class: "nowrap" }, words(map.scale?.low ?? least), " ",
      ramp, ` ${words(high)}`, to_target && high === 1 ? " = target" : ""),
    map.scale ? `; here ${words(least)} to ${words(most)}` : "",
    to_target && high > 1 ? " (the mark is at 1 = target)" : "",
    known.length < values.length ? "; grey: undetermined" : "");
}
