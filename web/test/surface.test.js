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
  const large = new Lattice([{ rows: 200, columns: 60, ends: "flat" }]);
  assert.ok(large.count < 60_000 && large.count > 10_000);
});
