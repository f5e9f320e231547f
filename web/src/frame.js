// What of a run should be in the picture, and the ends of its colours.
import { quantile } from "./colours.js";
import { besides } from "./obstacles.js";

const THICK = 3; // colours of walls end at most at so many times the least wall

// The shapes of a design under the whole pressures of every task, where they are stored.
function whole(facts, shapes, design) {
  return facts.tasks.flatMap(({ name }) => shapes.stops(design, name).slice(-1).map((stop) => shapes.moved(design, stop)));
}

// Everything that should be seen, three numbers each; places: where the tip can go.
export function framed(facts, shapes, places = []) {
  const last = facts.history.length - 1;
  const moved = [...whole(facts, shapes, 0), ...whole(facts, shapes, last)];
  const points = [shapes.atRest(0), shapes.atRest(last), ...moved].flatMap(({ positions }) => thinned(positions));
  for (const { target } of facts.tasks) points.push(...(target?.line ?? []).flat(), ...(target?.place ?? []));
  points.push(...places.flat());
  // The clamp too.
  const wide = 1.3 * facts.radius;
  for (const x of [-wide, wide]) for (const y of [-wide, wide]) points.push(x, y, -0.03 * facts.length);
  return points.concat(besides(shapes.obstacles, moved, points, facts.length));
}

// The ends of the colours by what is coloured, the same for all designs.
export class Ranges {
  constructor(facts, shapes) {
    const last = facts.history.length - 1;
    const stops = whole(facts, shapes, last);
    const most = (read, least) => stops.reduce((high, shape) => Math.max(high, read(shape)), least);
    this.wall = facts.limits.find(({ key }) => key === "wall_mm")?.bound ?? 1;
    this.most = THICK * this.wall;
    this.ends = {
      stretch: [1, most((shape) => quantile(shape.stretch, 0.998), 1.01)],
      displacement: [0, most((shape) => quantile(shapes.displacement(shape), 1), 1e-6)],
      change: [0, Math.max(quantile(shapes.displacement(shapes.atRest(last)), 0.998), 1e-6)],
      limits: [0, 100],
      plain: [0, 1],
    };
    Object.assign(this, { shapes, last });
  }

  // Of a name that `valued` gives, for these values where they have ends of their own.
  of(name, values) {
    // When it is asked for: distances take a moment.
    if (name === "thickness") this.ends.thickness ??= this.#thickness();
    if (name === "rubber") {
      const most = quantile(values.map(Math.abs), 0.99) || 1;
      return [-most, most];
    }
    return this.ends[name];
  }

  #thickness() {
    const { shapes, wall, most, last } = this;
    const thick = [0, last].map((design) => quantile(shapes.thickness(shapes.atRest(design), most), 0.8));
    return [wall, Math.max(...thick, 1.1 * wall)];
  }
}

// The values of a mode on a shape, the name of their range, and words for the scale where they are not the mode's own.
export function valued(mode, shape, shapes, ranges, task, motion) {
  const count = shape.positions.length / 3;
  const rubber = mode === "rubber" ? shapes.thickening(shape, task, motion) : null;
  const name = mode === "displacement" && !shape.stretch ? "change" : mode;
  const fields = {
    thickness: () => shapes.thickness(shape, ranges.most),
    limits: () => shapes.used(shape).values,
    stretch: () => shape.stretch ?? new Float32Array(count).fill(1),
    displacement: () => shapes.displacement(shape),
    change: () => shapes.displacement(shape),
    rubber: () => rubber?.values ?? new Float32Array(count),
    plain: () => new Float32Array(count),
  };
  const words = { change: "Change since the start", displacement: "Displacement from rest", rubber: rubber?.words }[name];
  return { values: fields[name](), name, words };
}

// The largest distance from the axis.
export function radiusOf(positions) {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) most = Math.max(most, Math.hypot(positions[i], positions[i + 1]));
  return most;
}

// Where the body lies, look at it from the side on which its base is on the left.
export function baseOnTheLeft({ gravity, view }) {
  if (!gravity) return;
  const [[a, b], [u, v]] = [view.normal, gravity];
  if (b * u - a * v >= 0) return;
  view.normal = view.normal.map((part) => -part);
  view.offset = -view.offset;
}

export function extremes(points, axis) {
  const values = points.filter((_, i) => i % 3 === axis);
  return [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
}

function thinned(positions) {
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 1500));
  const found = [];
  for (let i = 0; i < positions.length; i += step) found.push(positions[i], positions[i + 1], positions[i + 2]);
  return found;
}
