// The tables of the page: what a design does, its limits, how the run went, the material.
import { element } from "./elements.js";
import { atMost, short } from "./numbers.js";

const degrees = (vector) => vector.map((angle) => (angle === null ? null : (180 / Math.PI) * angle));
const three = (vector) => vector.map((value) => (value === null ? "–" : (Math.abs(value) < 0.005 ? "0.00" : value.toFixed(2).replace("-", "−")))).join(", ");

// Rows of cells; the first row is the head, and the first cell of every other row heads it.
export function fillTable(table, [head, ...rows]) {
  const cell = (value, name, attributes = {}) => element(name, attributes, value instanceof Node ? value : String(value));
  table.replaceChildren(
    element("thead", {}, element("tr", {}, ...head.map((value) => cell(value, "th", { scope: "col" })))),
    element("tbody", {}, ...rows.map(([first, ...rest]) =>
      element("tr", {}, cell(first, "th", { scope: "row" }), ...rest.map((value) => cell(value, "td"))))),
  );
}

export function tasksTable(facts, entry) {
  const names = facts.tasks.map((task) => task.name);
  const of = (read) => names.map((name) => read(entry.tasks[name], entry.motions[name]));
  return [
    ["", ...names],
    ["asked for", ...of((_, motion) => motion.word)],
    ["found", ...of((_, motion) => element("b", {}, motion.text))],
    ["at", ...of((_, motion) => motion.at)],
    ["objective", ...of((task) => short(task.objective, 5))],
    ["tip moves, mm", ...of((task) => three(task.translation_mm))],
    ["tip turns, °", ...of((task) => three(degrees(task.rotation_rad)))],
    ["largest stretch", ...of((task) => short(task.max_stretch, 4) + (task.beyond_validity ? " (beyond the rubber’s range)" : ""))],
    ["chambers, mm³", ...of((task) => Object.entries(task.volume_mm3).map(([name, volume]) => `${name} ${short(volume)}`).join(", "))],
    ["stable", ...of((task) => (task.stable ? "yes" : "no"))],
  ];
}

// How finely the tip moves and how stiff it is there, by the fast model.
function capable({ fineness, stiffness }) {
  const stiff = stiffness.map((value) => (Number.isFinite(value) ? short(value, 3) : "held"));
  return [
    ["1 kPa moves it, mm", `${short(fineness[0], 2)} at least, ${short(fineness[1], 2)} at most`],
    ["stiffness of the tip, N/mm", `${stiff[0]} at least, ${stiff[1]} at most`],
  ];
}

// A state at pressures that were set on the page; modelled: what the fast model says there, if there is one.
export function exploredTable(step, words, modelled = null) {
  const volumes = Object.entries(step.volume_mm3).map(([name, volume]) => `${name} ${short(volume)}`);
  return [
    ["", words],
    ["tip moves, mm", three(step.translation_mm)],
    ["tip turns, °", three(degrees(step.rotation_rad))],
    ["largest stretch", short(step.max_stretch, 4)],
    ["chambers, mm³", volumes.join(", ")],
    ...(modelled ? capable(modelled) : []),
    ["stable", step.stable ? "yes" : "no"],
  ];
}

// The same by the fast model, with the largest errors that were measured.
export function modelledTable({ motions, volumes, fineness, stiffness, errors, inside }, words) {
  return [
    ["", words],
    ["tip moves, mm", `${three(motions.slice(0, 3))} ± ${atMost(errors.translation_mm)}`],
    ["tip turns, °", `${three(degrees(motions.slice(3)))} ± ${atMost((180 / Math.PI) * errors.rotation_rad)}`],
    ["chambers, mm³", `${Object.entries(volumes).map(([name, volume]) => `${name} ${short(volume)}`).join(", ")} ± ${atMost(errors.volume_mm3)}`],
    ...capable({ fineness, stiffness }),
    ["in the model’s domain", inside ? "yes" : "no"],
  ];
}

// What rounding errors may do to a value at its bound.
const ROUNDING = 1e-9;

export function limitsTable(facts, entry) {
  const rows = facts.limits.map(({ key, word, unit, bound, at_least: atLeast }) => {
    const value = entry.limits[key];
    // In mm if the bound is zero.
    const excess = value === null ? 0 : (atLeast ? bound - value : value - bound) / (bound || 1);
    const used = value === null ? null : !bound ? Math.max(1 + excess, 0) : atLeast ? bound / Math.max(value, 1e-12) : value / bound;
    const satisfied = excess <= ROUNDING;
    const bar = element("span", { class: satisfied ? "used" : "used broken" }, element("i"));
    bar.firstChild.style.width = `${100 * Math.min(used ?? 0, 1)}%`;
    const sign = atLeast ? "≥" : "≤";
    const verdict = element("span", { class: satisfied ? "ok" : "broken" }, value === null ? "–" : satisfied ? "satisfied" : "violated");
    return [word, `${sign} ${short(bound)} ${unit}`, `${short(value, 5)} ${unit}`, bar, verdict];
  });
  return [["limit", "bound", "worst value", "used", ""], ...rows];
}

export function designRows(entry) {
  return [
    ["design", entry.iteration],
    ["objective", short(entry.objective, 6)],
    ["elements, unknowns", `${entry.elements}, ${entry.dofs}`],
    ["new mesh", entry.remeshed ? "yes" : "no"],
    ["largest motion of a control point", entry.step_mm === null ? "–" : `${short(entry.step_mm, 3)} mm`],
    ["actual over predicted gain", short(entry.ratio, 3)],
    ["optimality (gradient left by the limits)", entry.optimality === null ? "–" : `${short(100 * entry.optimality, 3)} %`],
    ["factorisations", entry.factorisations],
    ["time", `${short(entry.seconds.total, 3)} s`],
    ["time in equivalents", short(entry.equivalents, 3)],
  ];
}

export function runRows({ result, made_by: madeBy, history }) {
  const page = ["this page by", madeBy];
  if (!result) return [["designs", history.at(-1).iteration], ["ended", "not yet"], page];
  const versions = Object.entries(result.versions).map(([name, version]) => [name, version ?? "–"]);
  return [
    ["designs", result.iterations],
    ["finished", result.completed ? "yes" : "no"],
    ["time", result.spent],
    ["peak memory", result.peak_memory_MB === null ? "–" : `${Math.round(result.peak_memory_MB)} MB`],
    ...versions,
    page,
  ];
}

export function fillPairs(list, pairs) {
  list.replaceChildren(
    ...pairs.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value instanceof Node ? value : String(value))]),
  );
}
