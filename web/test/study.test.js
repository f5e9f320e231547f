import assert from "node:assert/strict";
import { test } from "node:test";
import { fits, memberTable, named, sorted } from "../src/study.js";

const member = (name, changes, value, held, word = "bending") => ({
  member: { name, changes },
  tasks: [{ name: "bend" }],
  result: { completed: true, reason: "it is a test" },
  history: [{ iteration: 3, objective: -value, held, motions: { bend: { value, unit: "°", word, found: `${value}°`, text: `${value}° (target 60°)` } }, seconds: { total: 2 } }],
});

const { heads, rows } = memberTable([
  member("soft", { "end_effector.spring.bending_y": "50 N*mm/rad" }, 58, true),
  member("stiff", { "end_effector.spring.bending_y": "400 N*mm/rad" }, 17, false),
  member("free", {}, 136, true),
]);
const column = (head) => heads.indexOf(head);

test("a row has what a member changes and what it came to", () => {
  assert.deepEqual(rows[1].map(({ text }) => text), ["stiff", "400 N*mm/rad", "17", "−17", "violated", "3", "2", "finished"]);
  assert.deepEqual(heads, ["run", "bending y", "bend: bending, °", "objective", "limits", "designs", "time, s", "state"]);
});

test("where members are asked for different motions, every cell says which", () => {
  const mixed = memberTable([member("one", {}, 58, true), member("other", {}, 17, true, "twist")]);
  assert.equal(mixed.heads[1], "bend");
  assert.deepEqual(mixed.rows.map((row) => row[1].text), ["bending 58° (target 60°)", "twist 17° (target 60°)"]);
});

test("quantities are sorted as numbers, and what is missing comes last", () => {
  assert.deepEqual(sorted(rows, column("bending y"), false), [0, 1, 2]);
  assert.deepEqual(sorted(rows, column("bending y"), true), [1, 0, 2]);
  assert.deepEqual(sorted(rows, column("bend: bending, °"), true), [2, 0, 1]);
  assert.deepEqual(sorted(rows, column("run"), false), [2, 0, 1]);
});

test("a filter needs every word", () => {
  const kept = (words) => rows.filter((row) => fits(row, words)).map(([{ text }]) => text);
  assert.deepEqual(kept("satisfied"), ["soft", "free"]);
  assert.deepEqual(kept("SATISFIED 50"), ["soft"]);
  assert.deepEqual(kept(""), ["soft", "stiff", "free"]);
});

test("keys that end alike are told apart by what is before", () => {
  assert.deepEqual(named(["body.radius", "body.chamber[0].radius", "mesh.size"]), ["body radius", "chamber[0] radius", "size"]);
  assert.deepEqual(named(["body.chamber[0].center[1]", "body.chamber[1].center[1]"]), ["chamber[0] center[1]", "chamber[1] center[1]"]);
  assert.deepEqual(named([]), []);
});
