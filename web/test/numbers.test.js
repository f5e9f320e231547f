import assert from "node:assert/strict";
import test from "node:test";
import { gzipSync } from "node:zlib";
import { painted, quantile } from "../src/colours.js";
import { netsAsCsv } from "../src/downloads.js";
import { short, ticks } from "../src/numbers.js";
import { unpack } from "../src/packed.js";

test("numbers are short, and say where there is none", () => {
  assert.deepEqual([0, 13.06963, -0.2, 123456, 0.00012, null, NaN].map((value) => short(value)), [
    "0", "13.07", "−0.2", "1.23e+5", "1.20e-4", "–", "–",
  ]);
});

test("ticks are round and within", () => {
  assert.deepEqual(ticks(0, 10), [0, 5, 10]);
  assert.deepEqual(ticks(-0.31, 0.33), [-0.2, 0, 0.2]);
  assert.deepEqual(ticks(7, 7), [7]);
});

test("colours run from the first stop to the last, and stay there", () => {
  const colours = painted([-1, 0, 1, 2], [0, 1], ["#000000", "#808080", "#ffffff"]);
  assert.deepEqual(Array.from(colours), [0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
  assert.equal(quantile([4, 1, 3, 2], 0.5), 3);
});

test("packed arrays are whole steps, by weight of their bytes", async () => {
  const described = {
    short: { at: 0, shape: [2], step: 0.5, width: 2, differences: false },
    walk: { at: 4, shape: [3, 1], step: 1, width: 1, differences: true },
  };
  const head = new TextEncoder().encode(JSON.stringify({ facts: { a: 1 }, arrays: described }));
  const length = [head.length, 0, 0, 0];
  // 258 and -2; then 5, 4, 6.
  const content = Uint8Array.from([...length, ...head, 2, 254, 1, 255, 5, 255, 2]);
  const packed = await unpack(gzipSync(content).toString("base64"));
  assert.deepEqual(Array.from(packed.array("short")), [129, -1]);
  assert.deepEqual(Array.from(packed.array("walk")), [5, 4, 6]);
  assert.deepEqual([packed.facts.a, packed.has("walk"), packed.has("toString")], [1, true, false]);
});

test("nets are lines of a table", () => {
  const surface = { name: "A", cavity: true, columns: 2 };
  const shapes = { facts: { history: [{ iteration: 7 }] }, surfaces: [surface], points: () => Float64Array.of(1, 2, 3, 4, 5, 6) };
  assert.equal(netsAsCsv(shapes, [0]), "design,surface,row,column,x_mm,y_mm,z_mm\n7,chamber_A,0,0,1.0000,2.0000,3.0000\n7,chamber_A,0,1,4.0000,5.0000,6.0000\n");
});
