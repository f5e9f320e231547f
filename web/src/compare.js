// Several runs in one view: their bodies as the large picture is seen, their histories in one diagram each, their numbers.
import { MODES, painted } from "./colours.js";
import { byId, element } from "./elements.js";
import { Ranges, baseOnTheLeft, framed, radiusOf, valued } from "./frame.js";
import { COLOURS, capital, plotCards } from "./history.js";
import { short } from "./numbers.js";
import { EXPLORE } from "./page.js";
import { View } from "./scene.js";
import { Shapes } from "./shapes.js";
import { fillTable } from "./tables.js";

export class Comparison {
  // choose(number): put a run into the large picture.
  constructor(page, choose) {
    Object.assign(this, { page, choose, bodies: [] });
  }

  // runs: [{ name, title, packed }], of which those without a design are left out.
  load(runs, chosen) {
    const there = runs.flatMap(({ name, packed }, number) => (packed ? [{ name, number, packed }] : []));
    byId("comparison").hidden = runs.length < 2;
    if (runs.length < 2) return;
    this.all = there.map(({ name, number, packed }) => this.#prepared(name, number, packed));
    const points = this.all.flatMap(({ points }) => points);
    for (const each of this.all) this.#place(each, points);
    const colours = (number) => COLOURS[number % COLOURS.length];
    const histories = this.all.map(({ name, number, facts }) => ({ name, colour: colours(number), facts }));
    const longest = Math.max(1, ...histories.map(({ facts }) => facts.history.length));
    this.marked = plotCards(comparedPlots(histories), Array.from({ length: longest }, (_, design) => design), byId("compared-plots"), (design) => {
      this.page.choose({ design: Math.min(design, this.page.last) });
    });
    fillTable(byId("compared"), comparedTable(histories));
    this.chosen = chosen;
    this.follow();
  }

  #prepared(name, number, packed) {
    const before = this.all?.find((each) => each.number === number && each.packed === packed);
    if (before) return before;
    const { facts } = packed;
    const shapes = new Shapes(packed);
    facts.radius ??= radiusOf(shapes.atRest(0).positions);
    baseOnTheLeft(facts);
    return { name, number, packed, facts, shapes, points: framed(facts, shapes), ranges: new Ranges(facts, shapes) };
  }

  #place({ name, number, shapes }, points) {
    this.bodies[number] ??= this.#figure(number);
    const { figure, view } = this.bodies[number];
    figure.querySelector("b").textContent = name;
    view?.load(shapes, points);
  }

  #figure(number) {
    const place = element("div", { class: "view" }, element("canvas"), element("div", { class: "words-in-space" }), element("div", { class: "scale" }));
    const caption = element("button", { type: "button" }, element("b"), element("span"));
    const figure = element("figure", { class: "card body" }, place, caption);
    figure.addEventListener("click", () => this.choose(number));
    byId("bodies").append(figure);
    try {
      return { figure, view: new View(place, true) };
    } catch {
      return { figure, view: null };
    }
  }

  // Show in every small picture what the large one shows, as far as the run has it.
  follow() {
    if (!this.all) return;
    const { state } = this.page;
    this.marked(Math.min(state.design, Math.max(...this.all.map(({ facts }) => facts.history.length)) - 1));
    const shown = this.all.map((each) => ({ ...each, ...this.#shown(each) }));
    const named = shown.map(({ shape, shapes, ranges, task }) => ({ ...valued(state.mode, shape, shapes, ranges, task), ranges }));
    for (const [place, { number, shape, facts, design, task, entry }] of shown.entries()) {
      const { figure, view } = this.bodies[number];
      const { values, name } = named[place];
      // One scale for all.
      const ends = named.filter((each) => each.name === name).map((each) => each.ranges.of(name, each.values));
      const range = [Math.min(...ends.map(([low]) => low)), Math.max(...ends.map(([, high]) => high))];
      view?.show(shape, painted(values, range, MODES[state.mode].stops), null, task, null, byId("marks").checked);
      view?.cut(this.page.cut.where);
      const motion = entry.motions[task || facts.tasks[0].name];
      figure.querySelector("span").textContent = `design ${entry.iteration} of ${facts.history.at(-1).iteration}: ${motion.word} ${motion.text}${shape.stretch ? "" : ", at rest"}`;
      figure.classList.toggle("chosen", design === state.design && facts === this.page.facts);
    }
    this.turn();
  }

  // The design of the same number, or the last one beside the last; the task of the same name, or the first.
  #shown({ facts, shapes }) {
    const { state, last, part } = this.page;
    const own = facts.history.length - 1;
    const design = state.design === last ? own : Math.min(state.design, own);
    const asked = state.task === EXPLORE ? facts.tasks[0].name : state.task;
    const task = asked && !facts.tasks.some(({ name }) => name === asked) ? facts.tasks[0].name : asked;
    const stops = shapes.stops(design, task);
    const stop = stops[Math.round((state.task === EXPLORE ? 1 : part) * (stops.length - 1))];
    return { design, task: stop ? task : "", entry: facts.history[design], shape: stop ? shapes.moved(design, stop) : shapes.atRest(design) };
  }

  // Show only these runs' bodies, in this order; a single run has none beside the large picture.
  arrange(kept) {
    for (const [number, body] of this.bodies.entries()) if (body) body.figure.hidden = !kept.includes(number);
    byId("bodies").append(...kept.flatMap((number) => this.bodies[number]?.figure ?? []));
  }

  // Look from where the large picture is seen.
  turn() {
    if (!this.page.view?.scene) return;
    for (const each of this.bodies) if (each?.view?.scene) each.view.like(this.page.view);
  }
}

// Diagrams with one line for every run: what they have in common, under the same words and units.
export function comparedPlots(runs) {
  const line = ({ name, colour, facts }, read) => ({ name, colour, values: facts.history.map(read) });
  const plots = new Map();
  const add = (title, unit, made, bound) => {
    const key = `${title} ${unit}`;
    if (!plots.has(key)) plots.set(key, { title, unit, lines: [], bound, named: true });
    const plot = plots.get(key);
    // A bound that is not that of all would mislead.
    if (plot.bound?.value !== bound?.value) plot.bound = undefined;
    plot.lines.push(made);
  };
  for (const run of runs) {
    add("Objective", "", line(run, (entry) => entry.objective));
    for (const { name } of run.facts.tasks) {
      const { word, unit } = run.facts.history[0].motions[name];
      add(run.facts.tasks.length > 1 ? `${name}: ${word}` : capital(word), unit === "°" ? "degrees" : unit, line(run, (entry) => entry.motions[name].value));
    }
    for (const { key, word, unit, bound, at_least: atLeast } of run.facts.limits) {
      add(`Limit: ${word}`, unit, line(run, (entry) => entry.limits[key]), { value: bound, atLeast });
    }
  }
  return [...plots.values()];
}

// The last designs side by side, a column to every run.
export function comparedTable(runs) {
  const last = ({ facts }) => facts.history.at(-1);
  const of = (read) => runs.map((run) => read(run.facts, last(run)));
  const tasks = [...new Set(runs.flatMap(({ facts }) => facts.tasks.map(({ name }) => name)))];
  const limits = [...new Map(runs.flatMap(({ facts }) => facts.limits.map(({ key, word, unit }) => [key, { key, word, unit }]))).values()];
  return [
    ["last design", ...runs.map(({ name }) => name)],
    ["title", ...of((facts) => facts.title)],
    ["designs", ...of((_, entry) => entry.iteration)],
    ["ended", ...of((facts) => (facts.result ? facts.result.reason : "not yet"))],
    ["objective", ...of((_, entry) => short(entry.objective, 5))],
    ...tasks.map((name) => [`task ${name}`, ...of((_, entry) => (entry.motions[name] ? `${entry.motions[name].word} ${entry.motions[name].text} at ${entry.motions[name].at}` : "–"))]),
    ["limits", ...of((_, entry) => (entry.held ? "satisfied" : "violated"))],
    ...limits.map(({ key, word, unit }) => [`${word}${unit ? `, ${unit}` : ""}`, ...of((_, entry) => short(entry.limits[key]))]),
    ["elements", ...of((_, entry) => entry.elements)],
    ["time", ...of((facts) => (facts.result ? facts.result.spent : "–"))],
  ];
}
