// The fast model of a body, as src/pneumorph/surrogate/reader.py reads it: poses from pressures, and pressures for a place.
// Pressures are arrays in MPa in the order of the model's chambers; lengths are in mm, angles in rad.
import { basisOf, gradientOf } from "./chebyshev.js";
import { eigenvalues, solved } from "./linear.js";

export const MOTIONS = ["shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist"];

const PER_RADIAN = 180 / Math.PI; // mm that count as much as a radian
const EFFORT = 1e-4; // weight of pressures against distances
const [STEPS, STARTS, SEEDS] = [25, 4, 512]; // most steps from a start, most starts, poses among which they are chosen
const TINY = 1e-9; // of a range

export class Model {
  // told: { chambers, bounds, corners, index, coefficients, soft, errors } and perhaps more: one row of coefficients to a polynomial, six
  // of the tip's motions and then one to the volume of each chamber; soft: the same of its compliance against forces.
  constructor(told) {
    Object.assign(this, told);
    this.lower = this.bounds.map(([low]) => low);
    this.range = this.bounds.map(([low, high]) => high - low);
    this.seeds = this.spread(SEEDS);
    this.seedMotions = this.seeds.map((p) => this.motions(p));
    const ends = [0, 1, 2].map((row) => this.seedMotions.map((motion) => motion[row]));
    this.reach = Math.hypot(...ends.map((all) => Math.max(...all) - Math.min(...all))) || 1;
    this.error = Math.hypot(this.errors.translation_mm, PER_RADIAN * this.errors.rotation_rad);
  }

  // The amounts of the modes of its shape, which a page has.
  amountsAt(p) {
    return times(basisOf(this.scaled(p), this.amounts.index), this.amounts.coefficients);
  }

  // Translation and rotation vector of the tip.
  motions(p) {
    return this.values(p).slice(0, 6);
  }

  // The same, then the volumes of the chambers.
  values(p) {
    return times(basisOf(this.scaled(p), this.index), this.coefficients);
  }

  // Derivatives of the motions by the pressures: six rows.
  jacobian(p) {
    const columns = gradientOf(this.scaled(p), this.index).map((slopes, c) => times(slopes, this.coefficients).map((slope) => (2 * slope) / this.range[c]));
    return MOTIONS.map((_, row) => columns.map((column) => column[row]));
  }

  // By how much the tip goes, mm per MPa, in the direction in which it goes least, of those in which it can be moved, and most.
  fineness(p) {
    const rows = this.jacobian(p).slice(0, 3);
    const few = rows[0].length < 3 ? rows[0].map((_, c) => rows.map((row) => row[c])) : rows;
    const squares = eigenvalues(few.map((one) => few.map((other) => dot(one, other))));
    return [squares[0], squares.at(-1)].map((square) => Math.sqrt(Math.max(square, 0)));
  }

  // Compliance of the tip against forces, mm/N: three rows.
  compliance(p) {
    const [xx, yx, yy, zx, zy, zz] = times(basisOf(this.scaled(p), this.soft.index), this.soft.coefficients);
    return [[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]];
  }

  // Stiffness of the tip against forces, N/mm: along the axis in which it is softest, and stiffest; infinite where it is held.
  stiffness(p) {
    const soft = eigenvalues(this.compliance(p));
    return [soft[2], soft[0]].map((value) => 1 / Math.max(value, 0));
  }

  // Pressures from -1 to 1 over their ranges.
  scaled(p) {
    return p.map((value, c) => Math.min(Math.max((2 * (value - this.lower[c])) / this.range[c] - 1, -1), 1));
  }

  // Whether pressures are within the bounds, beyond which the model says nothing.
  covers(p) {
    return p.every((value, c) => value >= this.bounds[c][0] - TINY * this.range[c] && value <= this.bounds[c][1] + TINY * this.range[c]);
  }

  // Whether stable states are known there.
  inside(p) {
    const within = (corner) => p.every((value, c) => value >= Math.min(corner[c], 0) - TINY * this.range[c] && value <= Math.max(corner[c], 0) + TINY * this.range[c]);
    return this.covers(p) && this.corners.some(within);
  }

  // The pressures in the domain with which the tip moves as wanted, { motion: mm or rad }, or as near to it as it can: { p,
  // missed, reached }, where a degree counts as a millimetre. near: pressures from which to begin.
  pressuresFor(wanted, near = null) {
    const rows = Object.keys(wanted).map((name) => MOTIONS.indexOf(name));
    const scale = rows.map((row) => (row < 3 ? 1 : PER_RADIAN));
    const asked = { rows, scale, goal: Object.values(wanted) };
    const away = this.seedMotions.map((motion) => Math.hypot(...rows.map((row, k) => (motion[row] - asked.goal[k]) * scale[k])));
    const nearest = away.map((_, k) => k).sort((one, other) => away[one] - away[other] || one - other);
    const first = near ?? this.seeds[nearest[0]];
    const others = [];
    for (let k = 4; k < 4 * STARTS; k += 4) others.push(this.seeds[nearest[k]]);
    const boxes = this.#boxes(first);
    let best = { p: first, missed: Infinity };
    for (const start of [first, ...others]) {
      for (const box of boxes) {
        const found = this.#descend(start, box, asked);
        if (found.missed < best.missed) best = found;
        if (best.missed <= 0.1 * this.error) return { ...best, reached: true };
      }
    }
    return { ...best, reached: best.missed <= this.error };
  }

  // Pressures all over the domain: a lattice of Korobov's kind, clipped to it, and its corners.
  spread(count) {
    const phases = [2, 3, 5, 7, 11, 13, 17, 19].slice(0, this.chambers.length).map(Math.sqrt);
    const points = Array.from({ length: count }, (_, k) => phases.map((phase, c) => this.lower[c] + (((k + 1) * phase) % 1) * this.range[c]));
    const base = this.bounds.map(([low, high]) => Math.min(Math.max(0, low), high));
    return [...points, ...this.corners, ...this.corners.map(() => base)].filter((p) => this.inside(p));
  }

  // Levenberg's and Marquardt's method from p in a box.
  #descend(p, [low, high], asked) {
    const { range } = this;
    const effort = (EFFORT * this.reach) ** 2;
    const merits = (off, at) => dot(off, off) + effort * at.reduce((sum, value, c) => sum + (value / range[c]) ** 2, 0);
    p = p.map((value, c) => Math.min(Math.max(value, low[c]), high[c]));
    let damping = 1e-3;
    let { off, slope } = this.#off(p, asked);
    let merit = merits(off, p);
    for (let step = 0; step < STEPS; step++) {
      const gradient = p.map((value, c) => dot(slope.map((row) => row[c]), off) + (effort * value) / range[c]);
      const most = p.map((value, c) => [(low[c] - value) / range[c], (high[c] - value) / range[c]]);
      const free = p.map((_, c) => c).filter((c) => !((most[c][0] >= -1e-12 && gradient[c] > 0) || (most[c][1] <= 1e-12 && gradient[c] < 0)));
      if (free.length === 0 || damping > 1e9) break;
      const hessian = free.map((a) => free.map((b) => (dot(slope.map((row) => row[a]), slope.map((row) => row[b])) + (a === b ? effort : 0)) * (a === b ? 1 + damping : 1)));
      const moves = solved(hessian, free.map((c) => -gradient[c]));
      const there = p.slice();
      free.forEach((c, k) => (there[c] += Math.min(Math.max(moves[k], most[c][0]), most[c][1]) * range[c]));
      const next = this.#off(there, asked);
      const better = merits(next.off, there);
      if (better < merit) {
        const small = merit - better < 1e-10 * merit + 1e-18 * this.reach ** 2;
        [p, merit, damping] = [there, better, damping / 10];
        ({ off, slope } = next);
        if (small) break;
      } else damping *= 10;
    }
    return { p, missed: Math.hypot(...off) };
  }

  // What is missed, mm, and its derivatives by the pressures as parts of their ranges.
  #off(p, { rows, scale, goal }) {
    const [motions, jacobian] = [this.motions(p), this.jacobian(p)];
    return {
      off: rows.map((row, k) => (motions[row] - goal[k]) * scale[k]),
      slope: rows.map((row, k) => jacobian[row].map((value, c) => value * this.range[c] * scale[k])),
    };
  }

  // The boxes of the domain, those nearest to p first.
  #boxes(p) {
    const boxes = this.corners.map((corner) => {
      const low = corner.map((end, c) => Math.max(Math.min(end, 0), this.bounds[c][0]));
      const high = corner.map((end, c) => Math.min(Math.max(end, 0), this.bounds[c][1]));
      const outside = p.reduce((sum, value, c) => sum + Math.max(low[c] - value, value - high[c], 0) / this.range[c], 0);
      return { box: [low, high], outside };
    });
    return boxes.sort((one, other) => one.outside - other.outside).map(({ box }) => box);
  }
}

const dot = (one, other) => one.reduce((sum, value, k) => sum + value * other[k], 0);

// A row times a matrix.
function times(row, matrix) {
  const found = new Array(matrix[0].length).fill(0);
  row.forEach((factor, k) => matrix[k].forEach((value, column) => (found[column] += factor * value)));
  return found;
}
