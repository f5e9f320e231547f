// Triangles of a body's surfaces from their control nets: tubes, and the discs that close flat ends.
import { clampedRows, periodicRows, sampled } from "./spline.js";

const RINGS = 6; // of an end disc
const MOST = 40_000; // vertices of a body, within which playing is smooth

// Which vertices a body has and how they hang together; the same for every design of a run.
export class Lattice {
  // surfaces: [{ rows, columns, ends }]; perSpan: samples to each span of the splines, fewer where there are too many.
  constructor(surfaces, perSpan = 4) {
    const wanted = (n) => surfaces.reduce((sum, s) => sum + n * n * s.rows * s.columns, 0);
    let fine = perSpan;
    while (fine > 1 && wanted(fine) > MOST) fine--;
    this.parts = [];
    this.owner = []; // surface of every vertex
    const index = [];
    let first = 0;
    surfaces.forEach((surface, number) => {
      const part = latticeOf(surface, fine);
      for (const corner of part.index) index.push(first + corner);
      this.parts.push({ ...part, columns: surface.columns, first });
      first += part.count;
      for (let i = 0; i < part.count; i++) this.owner.push(number);
    });
    this.index = Uint32Array.from(index);
    this.owner = Uint16Array.from(this.owner);
    this.count = first;
  }

  // Vertices (three numbers each) of the nets, one flat array to a surface.
  positions(nets) {
    const points = new Float32Array(3 * this.count);
    this.parts.forEach((part, number) => {
      const net = nets[number];
      const tube = sampled(net, part.columns, part.rowsR, part.rowsQ);
      points.set(tube, 3 * part.first);
      if (!part.flat) return;
      const stride = 3 * part.columns;
      let at = 3 * part.first + tube.length;
      for (const row of [net.subarray(0, stride), net.subarray(net.length - stride)]) {
        at = disc(points, at, row, sampled(row, part.columns, ONE, part.rowsQ));
      }
    });
    return points;
  }

  // A value to every vertex from a grid (rows along r, columns around) on every surface, or that of the nearest point of
  // the grid. On an end disc it goes from the rim to the mean of the rim; the nearest one is that of the rim.
  spread(grids, nearest = false) {
    const values = new Float32Array(this.count);
    this.parts.forEach(({ across, along, first, flat }, number) => {
      const grid = grids[number];
      for (let i = 0; i < along; i++) {
        for (let k = 0; k < across; k++) values[first + i * across + k] = at(grid, i / (along - 1), k / across, nearest);
      }
      let place = first + along * across;
      for (const row of flat ? [first, first + (along - 1) * across] : []) {
        const rim = values.subarray(row, row + across);
        const mean = nearest ? rim[0] : rim.reduce((sum, value) => sum + value, 0) / across;
        values[place++] = mean;
        for (let ring = 1; ring <= RINGS; ring++) {
          for (const value of rim) values[place++] = nearest ? value : mean + (ring / RINGS) * (value - mean);
        }
      }
    });
    return values;
  }
}

// The value of a grid at r and q, periodic in q, between its points or at the nearest one.
function at({ rows, columns, values }, r, q, nearest) {
  const [up, aside] = [r * (rows - 1), q * columns];
  const value = (row, column) => values[row * columns + (column % columns)];
  if (nearest) return value(Math.round(up), Math.round(aside));
  const [i, k] = [Math.min(Math.floor(up), rows - 2), Math.floor(aside)];
  const between = (row) => value(row, k) + (aside - k) * (value(row, k + 1) - value(row, k));
  return between(i) + (up - i) * (between(i + 1) - between(i));
}

const ONE = { numbers: new Int32Array(4), values: Float64Array.of(1, 0, 0, 0) };

function latticeOf({ rows, columns, ends }, fine) {
  const across = fine * columns;
  const along = fine * (rows - 3) + 1;
  const q = Array.from({ length: across }, (_, k) => k / across);
  const r = Array.from({ length: along }, (_, k) => k / (along - 1));
  const index = [];
  // r_q × r_r points from solid to void.
  for (let i = 0; i + 1 < along; i++) strip(index, i * across, (i + 1) * across, across, false);
  let first = along * across;
  const flat = ends === "flat";
  for (const base of flat ? [true, false] : []) {
    for (let k = 0; k < across; k++) {
      const [a, b] = [first + 1 + k, first + 1 + ((k + 1) % across)];
      index.push(first, base ? b : a, base ? a : b);
    }
    for (let ring = 0; ring + 1 < RINGS; ring++) {
      strip(index, first + 1 + ring * across, first + 1 + (ring + 1) * across, across, !base);
    }
    first += 1 + RINGS * across;
  }
  return { rowsQ: periodicRows(columns, q), rowsR: clampedRows(rows, r), index, count: first, flat, across, along };
}

// Two triangles to every quad between two closed rows of vertices.
function strip(index, lower, upper, across, turned) {
  for (let k = 0; k < across; k++) {
    const next = (k + 1) % across;
    const [a, b, c, d] = [lower + k, lower + next, upper + k, upper + next];
    if (turned) index.push(a, c, b, b, c, d);
    else index.push(a, b, c, b, d, c);
  }
}

// A disc on the rays from the centre of an end row to its rim; the next place.
function disc(points, at, row, rim) {
  const centre = [0, 0, 0];
  for (let i = 0; i < row.length; i++) centre[i % 3] += (3 * row[i]) / row.length;
  points.set(centre, at);
  at += 3;
  for (let ring = 1; ring <= RINGS; ring++) {
    const s = ring / RINGS;
    for (let i = 0; i < rim.length; i++) points[at++] = (1 - s) * centre[i % 3] + s * rim[i];
  }
  return at;
}
