// A tube from its control net: triangles of the spline surface, and of the discs that close flat ends.
import { clampedRows, periodicRows, sampled } from "./spline.js";

const RINGS = 6; // of an end disc
const ONE = { numbers: new Int32Array(4), values: Float64Array.of(1, 0, 0, 0) };

export class Tube {
  // fine: samples to each span of the splines.
  constructor({ rows, columns, ends }, fine) {
    const [across, along] = [fine * columns, fine * (rows - 3) + 1];
    Object.assign(this, { columns, across, along, flat: ends.map((end) => end === "flat"), index: [] });
    this.rowsQ = periodicRows(columns, Array.from({ length: across }, (_, k) => k / across));
    this.rowsR = clampedRows(rows, Array.from({ length: along }, (_, k) => k / (along - 1)));
    // r_q × r_r points from solid to void.
    for (let i = 0; i + 1 < along; i++) strip(this.index, i * across, (i + 1) * across, across, false);
    let first = along * across;
    for (const base of [true, false].filter((_, tip) => this.flat[tip])) {
      for (let k = 0; k < across; k++) {
        const [a, b] = [first + 1 + k, first + 1 + ((k + 1) % across)];
        this.index.push(first, base ? b : a, base ? a : b);
      }
      for (let ring = 0; ring + 1 < RINGS; ring++) {
        strip(this.index, first + 1 + ring * across, first + 1 + (ring + 1) * across, across, !base);
      }
      first += 1 + RINGS * across;
    }
    this.count = first;
  }

  // Write the vertices of a control net (three numbers each) from a place on.
  put(net, points, place) {
    const tube = sampled(net, this.columns, this.rowsR, this.rowsQ);
    points.set(tube, place);
    const stride = 3 * this.columns;
    let at = place + tube.length;
    for (const row of [net.subarray(0, stride), net.subarray(net.length - stride)].filter((_, tip) => this.flat[tip])) {
      at = disc(points, at, row, sampled(row, this.columns, ONE, this.rowsQ));
    }
  }

  // A value to every vertex from a grid (rows along r, columns around), or that of the nearest point of the grid, from a
  // place on. On an end disc it goes from the rim to the mean of the rim; the nearest one is that of the rim.
  spread(grid, nearest, values, first) {
    const { across, along, flat } = this;
    for (let i = 0; i < along; i++) {
      for (let k = 0; k < across; k++) values[first + i * across + k] = at(grid, i / (along - 1), k / across, nearest);
    }
    let place = first + along * across;
    for (const row of [first, first + (along - 1) * across].filter((_, tip) => flat[tip])) {
      const rim = values.subarray(row, row + across);
      const mean = nearest ? rim[0] : rim.reduce((sum, value) => sum + value, 0) / across;
      values[place++] = mean;
      for (let ring = 1; ring <= RINGS; ring++) {
        for (const value of rim) values[place++] = nearest ? value : mean + (ring / RINGS) * (value - mean);
      }
    }
  }
}

// The value of a grid at r and q, periodic in q, between its points or at the nearest one.
function at({ shape: [rows, columns], values }, r, q, nearest) {
  const [up, aside] = [r * (rows - 1), q * columns];
  const value = (row, column) => values[row * columns + (column % columns)];
  if (nearest) return value(Math.round(up), Math.round(aside));
  const [i, k] = [Math.min(Math.floor(up), rows - 2), Math.floor(aside)];
  const between = (row) => value(row, k) + (aside - k) * (value(row, k + 1) - value(row, k));
  return between(i) + (up - i) * (between(i + 1) - between(i));
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
