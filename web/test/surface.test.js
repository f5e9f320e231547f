import assert from "node:assert/strict";
import test from "node:test";
import { Lattice } from "../src/surface.js";
import { Walls } from "../src/thickness.js";
import { nets, surfaces } from "./bodies.js";

const lattice = new Lattice(surfaces);
const points = lattice.positions(nets);

test("the triangles bound the rubber, from solid to void", () => {
  let volume = 0;
  for (let i = 0; i < lattice.index.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => points.subarray(3 * lattice.index[i + k], 3 * lattice.index[i + k] + 3));
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
  }
  const expected = Math.PI * (100 * 40 - 36 * 30);
  assert.ok(Math.abs(volume / expected - 1) < 5e-3, `${volume} of ${expected}`);
});

test("every edge has two triangles, but where a disc meets its tube", () => {
  const edges = new Map();
  for (let i = 0; i < lattice.index.length; i += 3) {
    for (let k = 0; k < 3; k++) {
      const [a, b] = [lattice.index[i + k], lattice.index[i + ((k + 1) % 3)]];
      edges.set(`${a} ${b}`, (edges.get(`${a} ${b}`) ?? 0) + 1);
    }
  }
  assert.ok([...edges.values()].every((count) => count === 1));
  const open = [...edges.keys()].filter((edge) => !edges.has(edge.split(" ").reverse().join(" ")));
  // Both sides of four rims, four samples to a column.
  assert.equal(open.length, 4 * 2 * 2 * (32 + 24));
});

test("walls between tubes, and under the ends", () => {
  const walls = new Walls(points, lattice.index, lattice.owner);
  const asked = Float32Array.from([6, 0, 20, 0, 10, 20, 0, 0, 0, 10, 0, 1]);
  const found = walls.distances(asked, Uint16Array.from([1, 0, 0, 0]));
  [4, 4, 5, Math.hypot(4, 4)].forEach((wall, i) => assert.ok(Math.abs(found[i] - wall) < 0.02, `${found[i]} of ${wall}`));
  assert.deepEqual(Array.from(walls.distances(asked, Uint16Array.from([1, 0, 0, 0]), 3)), [3, 3, 3, 3]);
});

test("a body of very many control points gets fewer samples", () => {
  const large = new Lattice([{ kind: "tube", rows: 200, columns: 60, ends: ["flat", "flat"] }]);
  assert.ok(large.count < 60_000 && large.count > 10_000);
});

test("the nearest vertices of a surface, however far", () => {
  const walls = new Walls(points, lattice.index, lattice.owner);
  const own = walls.nearest(points, lattice.owner);
  // Discs and tubes share the places of their rims.
  own.forEach((found, i) => assert.deepEqual(points.slice(3 * found, 3 * found + 3), points.slice(3 * i, 3 * i + 3)));
  const asked = Float32Array.from([9, 2, 30, -1, 0.5, 90, 5, -4, 21]);
  const owner = Uint16Array.from([1, 1, 0]);
  const away = (i, k) => Math.hypot(...[0, 1, 2].map((axis) => points[3 * i + axis] - asked[3 * k + axis]));
  [...walls.nearest(asked, owner)].forEach((found, k) => {
    const least = Math.min(...Array.from(lattice.owner, (own, i) => (own === owner[k] ? away(i, k) : Infinity)));
    assert.equal(lattice.owner[found], owner[k]);
    assert.ok(Math.abs(away(found, k) - least) < 1e-9);
  });
});

test("values are spread from grids over tubes and discs", () => {
  const grid = (rows, columns, value) => ({ shape: [rows, columns], values: Float64Array.from({ length: rows * columns }, (_, i) => value(Math.floor(i / columns), i % columns)) });
  // Linear along r and a wave around it, so that the mean of every row is that of its ends.
  const wave = grid(13, 64, (row, column) => row / 12 + 0.1 * Math.sin((2 * Math.PI * column) / 64));
  const values = lattice.spread([wave, grid(2, 2, () => 3)]);
  const { first, across, along, flat } = lattice.parts[0];
  assert.ok(flat[0] && flat[1] && first === 0);
  for (let i = 0; i < along; i++) {
    for (let k = 0; k < across; k++) {
      const expected = i / (along - 1) + 0.1 * Math.sin((2 * Math.PI * k) / across);
      assert.ok(Math.abs(values[i * across + k] - expected) < 1e-3);
    }
  }
  const centre = along * across;
  assert.ok(Math.abs(values[centre]) < 1e-6 && Math.abs(values[centre + 1 + 6 * across] - 1) < 1e-6);
  assert.ok(Math.abs(values[centre + 1 + 5 * across + 5] - values[5]) < 1e-6);
  lattice.owner.forEach((owner, i) => owner === 1 && assert.equal(values[i], 3));
  // Numbers of limits are not mixed.
  const numbers = lattice.spread([grid(5, 8, (row, column) => 7 * ((row + column) % 2)), grid(2, 2, () => 3)], true);
  assert.deepEqual([...new Set(numbers)].sort(), [0, 3, 7]);
});

test("surfaces of stored triangles beside a tube: their vertices, values and walls", () => {
  // A box about the inner tube.
  const corners = new Float64Array(24);
  for (let v = 0; v < 8; v++) corners.set([v & 1 ? 8 : -8, v & 2 ? 8 : -8, v & 4 ? 40 : 0], 3 * v);
  const index = [0, 3, 1, 0, 2, 3, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 7, 3, 2, 6, 7, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
  const mixed = new Lattice([{ kind: "triangles", count: 8, index: Float64Array.from(index) }, surfaces[1]]);
  const placed = mixed.positions([corners, nets[1]]);
  assert.deepEqual(Array.from(placed.subarray(0, 24)), Array.from(corners));
  assert.deepEqual(Array.from(mixed.index.subarray(0, 36)), index);
  assert.equal(mixed.count, 8 + mixed.parts[1].count);
  let volume = 0;
  for (let i = 0; i < mixed.index.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => placed.subarray(3 * mixed.index[i + k], 3 * mixed.index[i + k] + 3));
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
  }
  assert.ok(Math.abs(volume / (256 * 40 - 36 * Math.PI * 30) - 1) < 5e-3, `${volume}`);
  const walls = new Walls(placed, mixed.index, mixed.owner);
  const found = walls.distances(Float32Array.from([8, 0, 20, 0, 0, 0]), Uint16Array.from([0, 0]));
  assert.ok(Math.abs(found[0] - 2) < 0.02 && Math.abs(found[1] - 5) < 0.02, `${found}`);
  const values = mixed.spread([{ shape: [8], values: Float64Array.from({ length: 8 }, (_, i) => i) }, { shape: [2, 2], values: new Float64Array(4).fill(9) }]);
  assert.deepEqual(Array.from(values.subarray(0, 9)), [0, 1, 2, 3, 4, 5, 6, 7, 9]);
});
