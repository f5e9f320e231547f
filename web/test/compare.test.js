import assert from "node:assert/strict";
import test from "node:test";
import { comparedPlots, comparedTable } from "../src/compare.js";
import { keyOf, nearest, stepOf } from "../src/nearest.js";

function run(name, objectives, { task = "extend", bound = 2, result = null } = {}) {
  const history = objectives.map((objective, iteration) => ({
    iteration, objective, held: iteration > 0, limits: { wall_mm: 2.5 }, elements: 9,
    motions: { [task]: { word: "extension", unit: "mm", value: -objective, text: `${-objective} mm`, at: "60 kPa" } },
  }));
  const limits = [{ key: "wall_mm", word: "wall", unit: "mm", bound, at_least: true }];
  return { name, colour: `#${name}`, facts: { title: name.toUpperCase(), history, limits, tasks: [{ name: task }], result } };
}

test("runs share a diagram of what they have in common", () => {
  const plots = comparedPlots([run("a", [-1, -2, -3]), run("b", [-4])]);
  assert.deepEqual(plots.map(({ title, unit }) => [title, unit]), [["Objective", ""], ["Extension", "mm"], ["Limit: wall", "mm"]]);
  assert.deepEqual(plots[1].lines.map(({ name, values }) => [name, values]), [["a", [1, 2, 3]], ["b", [4]]]);
  assert.deepEqual(plots[2].bound, { value: 2, atLeast: true });
});

test("a bound that differs is not drawn", () => {
  const [, , wall] = comparedPlots([run("a", [-1]), run("b", [-1], { bound: 3 })]);
  assert.equal(wall.bound, undefined);
  assert.equal(wall.lines.length, 2);
});

test("last designs stand side by side, and what a run does not have is a dash", () => {
  const ended = { reason: "it is done", spent: "48 s" };
  const rows = comparedTable([run("a", [-1, -2], { result: ended }), run("b", [-4], { task: "bend" })]);
  const found = Object.fromEntries(rows.map(([name, ...cells]) => [name, cells]));
  assert.deepEqual(found["last design"], ["a", "b"]);
  assert.deepEqual(found.ended, ["it is done", "not yet"]);
  assert.deepEqual(found["task extend"], ["extension 2 mm at 60 kPa", "–"]);
  assert.deepEqual(found["task bend"], ["–", "extension 4 mm at 60 kPa"]);
  assert.deepEqual(found.limits, ["satisfied", "violated"]);
});

test("the nearest known pressures", () => {
  const known = [{ A: 0, B: 0 }, { A: 30, B: 0 }, { A: 30, B: 40 }];
  assert.deepEqual(nearest(known, { A: 25, B: 10 }), { A: 30, B: 0 });
  assert.equal(nearest([], { A: 1 }), null);
  assert.equal(keyOf({ B: 1, A: 22.5 }), keyOf({ A: 22.50001, B: 1 }));
});

test("steps of sliders are round, about two hundred of them", () => {
  assert.deepEqual([[0, 75], [-62.5, 0], [0, 100], [0, 1.25]].map((ends) => stepOf(...ends)), [0.5, 0.5, 0.5, 0.01]);
});
