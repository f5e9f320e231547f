import assert from "node:assert/strict";
import test from "node:test";
import { netsAsCsv } from "../src/downloads.js";
import { Shapes } from "../src/shapes.js";

// Two cubes, one in the other, that are stored as triangles in two designs; the inner one grows.
const corner = (v, half) => [v & 1 ? half : -half, v & 2 ? half : -half, v & 4 ? half : -half];
const cube = (half) => Array.from({ length: 8 }, (_, v) => corner(v, half)).flat();
const index = [0, 3, 1, 0, 2, 3, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 7, 3, 2, 6, 7, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
const inward = index.map((_, i) => index[i - (i % 3) + [0, 2, 1][i % 3]]);
const arrays = {
  "shell exterior": [[2, 8, 3], [...cube(5), ...cube(5)]],
  "shell chamber A": [[2, 8, 3], [...cube(2), ...cube(3)]],
  "corners exterior": [[36], index],
  "corners chamber A": [[36], inward],
  "used exterior": [[2, 8], Array.from({ length: 16 }, (_, i) => i / 100)],
  "used chamber A": [[2, 8], new Array(16).fill(0.5)],
  "limit exterior": [[2, 8], new Array(16).fill(1)],
  "limit chamber A": [[2, 8], new Array(16).fill(2)],
};
const facts = {
  surfaces: [
    { name: "exterior", cavity: false, key: "exterior", kind: "triangles", stored: "shell exterior" },
    { name: "A", cavity: true, key: "chamber A", kind: "triangles", stored: "shell chamber A" },
  ],
  obstacles: [],
  states: [],
  history: [{ iteration: 0 }, { iteration: 1 }],
};
const packed = { facts, shape: (name) => arrays[name][0], array: (name) => Float64Array.from(arrays[name][1]) };

test("a body of surfaces that are stored as triangles", () => {
  const shapes = new Shapes(packed);
  const [start, end] = [shapes.atRest(0), shapes.atRest(1)];
  assert.deepEqual(Array.from(start.positions), [...cube(5), ...cube(2)]);
  assert.deepEqual(Array.from(end.positions), [...cube(5), ...cube(3)]);
  assert.deepEqual(Array.from(end.index), [...index, ...inward.map((i) => i + 8)]);
  assert.deepEqual(Array.from(end.owner), [...new Array(8).fill(0), ...new Array(8).fill(1)]);
  const thin = shapes.thickness(end, 10);
  thin.forEach((wall, i) => assert.ok(Math.abs(wall - (i < 8 ? Math.hypot(2, 2, 2) : 2)) < 1e-6, `${wall} at ${i}`));
  const used = shapes.used(end);
  assert.ok(Math.abs(used.values[3] - 11) < 1e-4 && used.values[9] === 50);
  assert.deepEqual([used.limits[0], used.limits[15]], [1, 2]);
  assert.ok(Math.abs(shapes.displacement(end)[15] - Math.sqrt(3)) < 1e-6);
  assert.equal(netsAsCsv(shapes, [1]).split("\n")[9], "1,chamber_A,0,0,-3.0000,-3.0000,-3.0000");
});
