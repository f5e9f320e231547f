// Wall thickness: the distance from a point of one surface to the nearest point of any other.

// Triangles in a grid of cells, found by the vertices they hang on.
export class Walls {
  constructor(points, index, owner) {
    Object.assign(this, { points, index, owner });
    const count = points.length / 3;
    this.low = [0, 1, 2].map((axis) => least(points, axis));
    const size = [0, 1, 2].map((axis) => -least(points, axis, -1) - this.low[axis]);
    // A few vertices to each cell that a surface passes through: surfaces fill about a box's six sides.
    const area = 2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
    this.cell = Math.max(2 * Math.sqrt(area / count), 1e-6);
    this.cells = size.map((length) => Math.floor(length / this.cell) + 1);
    this.most = Math.max(...this.cells);
    const cellOf = Int32Array.from({ length: count }, (_, i) => this.#cellAt(points, 3 * i));
    [this.starts, this.members] = grouped(cellOf, this.cells[0] * this.cells[1] * this.cells[2]);
    [this.fans, this.fan] = grouped(index, count);
    // The one surface that a cell has vertices of; -1 where there are several.
    this.only = Int32Array.from({ length: this.starts.length - 1 }, (_, cell) => {
      const [first, end] = [this.starts[cell], this.starts[cell + 1]];
      for (let m = first + 1; m < end; m++) if (owner[this.members[m]] !== owner[this.members[first]]) return -1;
      return first < end ? owner[this.members[first]] : -1;
    });
  }

  // Distances of points (three numbers each) of the surfaces `owner`; those beyond `most` are `most`.
  distances(points, owner, most = Infinity) {
    return Float32Array.from(owner, (own, i) => this.#distance(points[3 * i], points[3 * i + 1], points[3 * i + 2], own, most));
  }

  // Of points of the surfaces `owner` the numbers of the nearest vertices of the same surface.
  nearest(points, owner) {
    return Uint32Array.from(owner, (own, i) => this.#nearest(points[3 * i], points[3 * i + 1], points[3 * i + 2], own));
  }

  #nearest(x, y, z, own) {
    const { points, owner, starts, members, cells } = this;
    const place = [this.#place(x, 0), this.#place(y, 1), this.#place(z, 2)];
    let [nearest, square] = [0, Infinity];
    // A vertex is near as a rule: in the cells around, or in twice as many.
    for (let reach = 1; reach < 2 * this.most && square > ((reach / 2) * this.cell) ** 2; reach *= 2) {
      const low = place.map((at) => Math.max(at - reach, 0));
      const high = place.map((at, axis) => Math.min(at + reach, cells[axis] - 1));
      for (let i = low[0]; i <= high[0]; i++) {
        for (let j = low[1]; j <= high[1]; j++) {
          const row = (i * cells[1] + j) * cells[2];
          for (let m = starts[row + low[2]]; m < starts[row + high[2] + 1]; m++) {
            const other = members[m];
            if (owner[other] !== own) continue;
            const found = (points[3 * other] - x) ** 2 + (points[3 * other + 1] - y) ** 2 + (points[3 * other + 2] - z) ** 2;
            if (found < square) [square, nearest] = [found, other];
          }
        }
      }
    }
    return nearest;
  }

  #place(value, axis) {
    return Math.min(Math.max(Math.floor((value - this.low[axis]) / this.cell), 0), this.cells[axis] - 1);
  }

  #cellAt(points, at) {
    const i = this.#place(points[at], 0);
    return (i * this.cells[1] + this.#place(points[at + 1], 1)) * this.cells[2] + this.#place(points[at + 2], 2);
  }

  #distance(x, y, z, own, most) {
    const { points, owner, starts, members, cells, only } = this;
    const [ci, cj, ck] = [this.#place(x, 0), this.#place(y, 1), this.#place(z, 2)];
    let nearest = -1;
    let square = most * most;
    // Shells of cells, until none can have a nearer vertex.
    for (let shell = 0; shell <= this.most && (shell - 1) * this.cell < Math.sqrt(square); shell++) {
      for (let i = Math.max(ci - shell, 0); i <= Math.min(ci + shell, cells[0] - 1); i++) {
        for (let j = Math.max(cj - shell, 0); j <= Math.min(cj + shell, cells[1] - 1); j++) {
          const rim = Math.abs(i - ci) === shell || Math.abs(j - cj) === shell;
          const step = rim || shell === 0 ? 1 : 2 * shell;
          for (let k = ck - shell; k <= ck + shell; k += step) {
            if (k < 0 || k >= cells[2]) continue;
            const cell = (i * cells[1] + j) * cells[2] + k;
            if (only[cell] === own) continue;
            for (let m = starts[cell]; m < starts[cell + 1]; m++) {
              const other = members[m];
              if (owner[other] === own) continue;
              const dx = points[3 * other] - x;
              const dy = points[3 * other + 1] - y;
              const dz = points[3 * other + 2] - z;
              const found = dx * dx + dy * dy + dz * dz;
              if (found < square) [square, nearest] = [found, other];
            }
          }
        }
      }
    }
    if (nearest < 0) return most;
    for (let m = this.fans[nearest]; m < this.fans[nearest + 1]; m++) {
      square = Math.min(square, this.#toTriangle(x, y, z, 3 * Math.floor(this.fan[m] / 3)));
    }
    return Math.sqrt(square);
  }

  // Squared distance to a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
  #toTriangle(x, y, z, corner) {
    const { points, index } = this;
    const [a, b, c] = [3 * index[corner], 3 * index[corner + 1], 3 * index[corner + 2]];
    const ab = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const ac = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const ap = [x - points[a], y - points[a + 1], z - points[a + 2]];
    const bp = [x - points[b], y - points[b + 1], z - points[b + 2]];
    const cp = [x - points[c], y - points[c + 1], z - points[c + 2]];
    const [d1, d2, d3, d4, d5, d6] = [dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)];
    const away = (v, w) => {
      const off = ap.map((part, axis) => part - v * ab[axis] - w * ac[axis]);
      return dot(off, off);
    };
    if (d1 <= 0 && d2 <= 0) return dot(ap, ap);
    if (d3 >= 0 && d4 <= d3) return dot(bp, bp);
    const vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return away(d1 / (d1 - d3), 0);
    if (d6 >= 0 && d5 <= d6) return dot(cp, cp);
    const vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return away(0, d2 / (d2 - d6));
    const va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
      const w = (d4 - d3) / (d4 - d3 + d5 - d6);
      return away(1 - w, w);
    }
    const all = va + vb + vc;
    return all > 0 ? away(vb / all, vc / all) : dot(ap, ap);
  }
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function least(points, axis, sign = 1) {
  let found = Infinity;
  for (let i = axis; i < points.length; i += 3) found = Math.min(found, sign * points[i]);
  return found;
}

// Places sorted by their group: where every group begins, and its members.
function grouped(groups, count) {
  const starts = new Int32Array(count + 1);
  for (const group of groups) starts[group + 1]++;
  for (let i = 0; i < count; i++) starts[i + 1] += starts[i];
  const next = starts.slice(0, count);
  const members = new Int32Array(groups.length);
  groups.forEach((group, place) => (members[next[group]++] = place));
  return [starts, members];
}
