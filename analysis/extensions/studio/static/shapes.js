// Vectors, boxes and plates, in metres or pixels.
const BODY = [0.014, 0.014, 0.004]; // of a plate beyond its balls, as parts of the volume's size

export const vector = ([x, y, z = 0]) => [x, y, z];
export const plus = (one, other, times = 1) => one.map((value, k) => value + times * other[k]);
export const dot = (one, other) => one.reduce((sum, value, k) => sum + value * other[k], 0);
export const between = (one, other, share = 0.5) => plus(one, plus(other, one, -1), share);
export const apart = (one, other) => Math.hypot(...plus(one, other, -1));
export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

export function boxOf(points) {
  const [min, max] = [Math.min, Math.max].map((end) =>
    points[0].map((_, k) => end(...points.map((point) => point[k]))));
  return { min, max };
}

// Corners of a box, whose index has a bit for each axis; edges along x, y and z; faces as indices.
export const cornersOf = ({ min, max }) => [...Array(8).keys()].map((k) =>
  [k & 4 ? max[0] : min[0], k & 2 ? max[1] : min[1], k & 1 ? max[2] : min[2]]);
export const edgesOf = (corners) => [4, 2, 1].map((bit) =>
  corners.flatMap((start, k) => (k & bit ? [] : [[start, corners[k | bit]]])));
export const FACES = [[4, 2, 1], [2, 1, 4], [1, 4, 2]].flatMap(([a, b, c]) =>
  [[0, b, b | c, c], [a, a | c, a | b | c, a | b]]);

// A plate with its styli; walls are for what the scales read: balls less the probe's offset.
export function plateOf(place, offsets, size, look) {
  const [balls, probes] = [place.balls, offsets].map((points) => points.map(vector));
  const read = balls.filter((_, k) => place.read[k]);
  const used = read.length ? read : balls;
  const middle = used.reduce((sum, ball) => plus(sum, ball, 1 / used.length), [0, 0, 0]);
  const nearest = used.reduce((best, ball) =>
    (apart(ball, middle) < apart(best, middle) - 1e-9 ? ball : best));
  const styli = probes.map((offset) => [nearest, plus(nearest, offset, -1)]);
  const scales = probes.flatMap((offset) => used.map((ball) => plus(ball, offset, -1)));
  // A box around the balls in the plate's own axes.
  const axes = [0, 1, 2].map((k) => (k < place.rotation.length
    ? vector(place.rotation.map((row) => row[k])) : [0, 0, 1]));
  const box = boxOf(balls.map((ball) => axes.map((axis) => dot(axis, ball))));
  const around = { min: plus(box.min, BODY, -size), max: plus(box.max, BODY, size) };
  const corners = cornersOf(around).map((corner) =>
    axes.reduce((sum, axis, k) => plus(sum, axis, corner[k]), [0, 0, 0]));
  const extent = boxOf(scales.length ? scales : used);
  return { place, look, balls, middle, styli, extent, corners, normal: axes[2] };
}

// The lines of an arrow between pixels.
export function arrow(from, to) {
  const along = plus(to, from, -1).map((one) => one / (apart(from, to) || 1));
  const wings = [-3.5, 3.5].map((off) => plus(plus(to, along, -7), [-along[1], along[0]], off));
  return [[from, to], ...wings.map((wing) => [to, wing])];
}

// The least of 1, 2 or 5 times a power of ten that is not below a number.
export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((one) => one * power > least * (1 - 1e-9));
}
