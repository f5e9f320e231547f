// Names that every object of JavaScript has are names like others.
import assert from "node:assert/strict";
import { test } from "node:test";
import { named, parsed } from "../src/named.js";
import { nearest } from "../src/nearest.js";

const NAMES = ["hasOwnProperty", "constructor", "toString", "valueOf", "__proto__", "isPrototypeOf"];

test("what is not there is not there, and what is there is found", () => {
  const text = `{"in": [{"A": 1}]}`;
  for (const name of NAMES) {
    assert.equal(parsed(text)[name], undefined);
    assert.equal(parsed(text).in[0][name], undefined);
    assert.equal(parsed(`[{"${name}": 3}]`)[0][name], 3);
    assert.deepEqual(Object.keys(parsed(`{"${name}": 3}`)), [name]);
    assert.equal(named([])[name], undefined);
    assert.equal(named([[name, 3]])[name], 3);
    assert.deepEqual(Object.entries(named([[name, 3]])), [[name, 3]]);
  }
});

test("pressures of chambers with such names have distances", () => {
  for (const name of NAMES) {
    const known = [named([[name, 9]]), named([[name, 1]])];
    assert.equal(nearest(known, named([[name, 8]])), known[0]);
    assert.equal(nearest(known, named([])), known[1]);
  }
});
