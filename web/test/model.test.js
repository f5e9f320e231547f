// The reader of fast models says what the one in Python says; tests/support/models.py has asked it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { MOTIONS, Model } from "../src/model.js";
import { eigenvalues, solved } from "../src/linear.js";

const { model: told, asked, found } = JSON.parse(readFileSync(new URL("model.json", import.meta.url), "utf8"));
const model = new Model(told);

// As exact as sums of floating-point numbers in another order are.
function near(values, expected, part = 1e-12) {
  const size = Math.max(...expected.map(Math.abs), 1e-9);
  values.forEach((value, k) => assert.ok(Math.abs(value - expected[k]) <= part * size, `${value} is not ${expected[k]}`));
  assert.equal(values.length, expected.length);
}

test("poses, volumes, derivatives and the domain", () => {
  assert.ok(asked.some(({ inside }) => inside) && asked.some(({ inside }) => !inside));
  for (const { p, motions, volumes, jacobian, inside } of asked) {
    near(model.motions(p), motions);
    near(model.values(p).slice(6), volumes);
    model.jacobian(p).forEach((row, k) => near(row, jacobian[k], 1e-10));
    assert.equal(model.inside(p), inside);
  }
});

test("how finely the tip moves, and how stiff it is", () => {
  for (const { p, fineness, stiffness } of asked) {
    near(model.fineness(p), fineness, 1e-7);
    near(model.stiffness(p), stiffness, 1e-9);
  }
});

test("eigenvalues, also of matrices with equal ones", () => {
  near(eigenvalues([[2, 1, 0], [1, 2, 0], [0, 0, 3]]), [1, 3, 3]);
  near(eigenvalues([[0, 1], [1, 0]]), [-1, 1]);
});

test("derivatives are those of the motions", () => {
  const [p, step] = [[0.02, 0.011], 1e-7];
  const jacobian = model.jacobian(p);
  for (const c of [0, 1]) {
    const [more, less] = [1, -1].map((sign) => model.motions(p.map((value, k) => value + (k === c ? sign * step : 0))));
    near(more.map((value, row) => (value - less[row]) / (2 * step)), jacobian.map((row) => row[c]), 1e-6);
  }
});

test("pressures for motions, in reach and out of it", () => {
  assert.ok(found.some(({ reached }) => reached) && found.some(({ reached }) => !reached));
  for (const { wanted, near: start, p, missed, reached } of found) {
    const answer = model.pressuresFor(wanted, start);
    near(answer.p, p, 1e-9);
    assert.ok(Math.abs(answer.missed - missed) < 1e-9);
    assert.equal(answer.reached, reached);
    assert.ok(model.inside(answer.p));
  }
});

test("what is nearest cannot be improved by a small step within the domain", () => {
  const wanted = { shift_x: 30, shift_y: 4 };
  const answer = model.pressuresFor(wanted);
  assert.equal(answer.reached, false);
  const missed = (p) => Math.hypot(...Object.entries(wanted).map(([name, value]) => model.motions(p)[MOTIONS.indexOf(name)] - value));
  for (let k = 0; k < 16; k++) {
    const there = answer.p.map((value, c) => value + 1e-5 * [Math.cos(k), Math.sin(k)][c]);
    if (model.inside(there)) assert.ok(missed(there) > answer.missed - 1e-6);
  }
});

test("systems of equations, also where rows have to change places", () => {
  near(solved([[0, 2], [1, 1]], [4, 5]), [3, 2]);
  near(solved([[4, 1, 0], [1, 3, 1], [0, 1, 2]], [6, 10, 8]), [1, 2, 3]);
});
