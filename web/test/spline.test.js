import assert from "node:assert/strict";
import test from "node:test";
import { clampedRows, periodicRows, sampled } from "../src/tube/spline.js";

const parameters = Array.from({ length: 41 }, (_, k) => k / 40);
const sum = (values) => values.reduce((total, value) => total + value, 0);

for (const [name, rows, count] of [["periodic", periodicRows, 8], ["clamped", clampedRows, 7], ["of one span", clampedRows, 4]]) {
  test(`${name} functions are positive and add up to one`, () => {
    const { numbers, values } = rows(count, parameters);
    assert.ok(values.every((value) => value >= -1e-15) && numbers.every((number) => number >= 0 && number < count));
    parameters.forEach((_, place) => assert.ok(Math.abs(sum(values.slice(4 * place, 4 * place + 4)) - 1) < 1e-12));
  });
}

test("clamped ends are the end control points, and Greville's points make a straight line", () => {
  const greville = [0, 1 / 12, 1 / 4, 1 / 2, 3 / 4, 11 / 12, 1];
  const { numbers, values } = clampedRows(7, parameters);
  parameters.forEach((t, place) => {
    const found = sum([0, 1, 2, 3].map((k) => values[4 * place + k] * greville[numbers[4 * place + k]]));
    assert.ok(Math.abs(found - t) < 1e-12);
  });
});

test("a periodic curve closes, and control point 0 belongs to q = 0", () => {
  const { numbers, values } = periodicRows(8, [0, 1]);
  assert.deepEqual(values.slice(0, 4), values.slice(4));
  assert.deepEqual(Array.from(numbers.slice(0, 3)), [7, 0, 1]);
  assert.ok(values[1] > values[0] && values[1] > values[2]);
});

test("a surface of a linear net is linear along the tube", () => {
  const net = Array.from({ length: 5 * 8 }, (_, i) => [0, 0, [0, 1 / 6, 1 / 2, 5 / 6, 1][Math.floor(i / 8)]]).flat();
  const points = sampled(Float64Array.from(net), 8, clampedRows(5, parameters), periodicRows(8, [0.3]));
  parameters.forEach((t, place) => assert.ok(Math.abs(points[3 * place + 2] - t) < 1e-12));
});
