// The page of a run: what is shown and what is chosen, kept together. It can be given more of the run, or another one.
import { MODES, painted, showLegend } from "./colours.js";
import { Cut } from "./cut.js";
import { bytesOf, netsAsCsv, save } from "./downloads.js";
import { Driven } from "./driven.js";
import { byId, element } from "./elements.js";
import { Ranges, baseOnTheLeft, framed, radiusOf, valued } from "./frame.js";
import { historyPlots } from "./history.js";
import { short } from "./numbers.js";
import { Player } from "./player.js";
import { View } from "./scene.js";
import { Shapes } from "./shapes.js";
import { designRows, fillPairs, fillTable, limitsTable, runRows, tasksTable } from "./tables.js";

// In place of a task: pressures that are set on the page.
export const EXPLORE = "*";

const HERE = "point at the body for its name";

export class RunPage {
  explorable = false; // whether there is a server that solves
  explored = null; // { shape, words }: the state at pressures that were set
  shown; // called after every change of what is shown

  constructor() {
    this.state = { design: 0, task: "", stop: 0, mode: "", motion: "" };
    this.designs = new Player(byId("design"), byId("play-designs"), 220, (design) => this.choose({ design }));
    this.pressures = new Player(byId("stop"), byId("play-pressures"), 320, (stop) => this.choose({ stop }));
    this.view = makeView(() => `${this.facts.directory}.png`);
    this.cut = new Cut((where) => {
      this.view?.cut(where);
      this.shown?.();
    });
    byId("task").addEventListener("change", (event) => this.choose({ task: event.target.value }));
    byId("mode").append(...Object.entries(MODES).map(([key, { option }]) => element("option", { value: key }, option)));
    byId("mode").addEventListener("change", (event) => this.choose({ mode: event.target.value }));
    byId("motion").addEventListener("change", (event) => this.choose({ motion: event.target.value }));
    for (const name of ["ghost", "marks"]) byId(name).addEventListener("change", () => this.show());
    byId("view").addEventListener("pointermove", (event) => {
      if (!event.buttons) this.#point(event.clientX, event.clientY);
    });
    keys(this.designs, this.pressures);
  }

  get last() {
    return this.facts.history.length - 1;
  }

  // Show a run; where it is the same one with more designs, what was chosen stays, and the last stays the last.
  load(packed, same = false) {
    const { state } = this;
    const atLast = !same || (state.design === this.last && state.task !== EXPLORE);
    const { facts } = packed;
    Object.assign(this, { facts, shapes: new Shapes(packed) });
    facts.radius ??= radiusOf(this.shapes.atRest(0).positions);
    baseOnTheLeft(facts);
    this.ranges = new Ranges(facts, this.shapes);
    state.design = atLast ? this.last : Math.min(state.design, this.last);
    if (!same) this.#begin();
    this.#tasks();
    this.model = facts.model ? new Driven(facts, this.shapes) : null;
    const points = framed(facts, this.shapes, this.model?.places);
    this.view?.load(this.shapes, points, same);
    this.view?.reach?.load(this.model.places, facts.model.chambers.length > 2);
    this.marked = historyPlots(facts, byId("plots"), (design) => this.choose({ design }));
    describe(facts, this.shapes, state);
    this.cut.load(facts, points, this.view, same);
    this.choose({});
  }

  #begin() {
    const { state, shapes, facts } = this;
    const task = facts.tasks[0].name;
    const stops = shapes.stops(state.design, task).length;
    const inflated = stops > 0;
    Object.assign(state, { task: inflated ? task : "", stop: Math.max(stops - 1, 0), mode: state.mode || (inflated ? "stretch" : "thickness") });
    this.explored = null;
  }

  #tasks() {
    const { tasks } = this.facts;
    const options = tasks.map(({ name }) => element("option", { value: name }, tasks.length > 1 ? `inflated: ${name}` : "inflated"));
    if (this.explorable || this.facts.model) options.push(element("option", { value: EXPLORE }, "set pressures"));
    byId("task").replaceChildren(element("option", { value: "" }, "at rest"), ...options);
    byId("task").value = this.state.task;
    // Runs of earlier versions do not have it.
    const rubber = byId("mode").querySelector("[value=rubber]");
    rubber.hidden = rubber.disabled = !this.shapes.thickened;
    if (rubber.disabled && this.state.mode === "rubber") this.state.mode = "thickness";
    byId("mode").value = this.state.mode;
  }

  // Which motion the colour of added rubber is about, where a task is about several.
  #motions() {
    const { state, shapes } = this;
    const motions = state.mode === "rubber" ? shapes.motions(state.design, state.task).map(({ motion }) => motion) : [];
    byId("motions").hidden = motions.length < 2;
    byId("motion").replaceChildren(...motions.map((motion) => element("option", { value: motion }, motion)));
    byId("motion").value = motions.includes(state.motion) ? state.motion : (motions[0] ?? "");
  }

  choose(changes) {
    const { state, shapes } = this;
    const before = shapes.stops(state.design, state.task).length - 1;
    const full = state.stop >= before;
    Object.assign(state, changes);
    if ("design" in changes) this.explored = null;
    const count = shapes.stops(state.design, state.task).length;
    // The whole pressures stay the whole, however many stops there are to them.
    state.stop = "stop" in changes ? state.stop : full ? Math.max(count - 1, 0) : Math.min(state.stop, Math.max(count - 1, 0));
    this.show();
  }

  show() {
    const { facts, shapes, state, view, explored } = this;
    const entry = facts.history[state.design];
    const exploring = state.task === EXPLORE;
    const stops = exploring ? [] : shapes.stops(state.design, state.task);
    const stop = stops[state.stop];
    const free = exploring ? explored : null;
    const shape = free ? free.shape : stop ? shapes.moved(state.design, stop) : shapes.atRest(state.design);
    const whole = stop !== undefined && state.stop === stops.length - 1;
    if (view) {
      const { values, name, words } = valued(state.mode, shape, shapes, this.ranges, state.task, state.motion);
      const range = this.ranges.of(name, values);
      const colours = painted(values, range, MODES[state.mode].stops);
      view.show(shape, colours, byId("ghost").checked ? this.#ghost() : null, stop || free ? state.task : "", whole ? entry.tasks[state.task] : null, byId("marks").checked);
      this.drawn = shape;
      byId("here").textContent = state.mode === "limits" ? HERE : "";
      showLegend(byId("legend"), state.mode, range, words ?? MODES[state.mode].word);
    }
    byId("task").value = state.task;
    this.#motions();
    byId("inflation").hidden = exploring;
    this.designs.show(state.design, this.last, `${entry.iteration} of ${facts.history[this.last].iteration}`);
    this.pressures.show(state.stop, stops.length - 1, stop ? pressureWords(stop.pressures) : "at rest");
    byId("stored").textContent = exploring ? "" : this.#storedWords(stops);
    byId("shown").textContent = free ? `design ${entry.iteration} at ${free.words}` : this.#shownWords(entry, stop, whole);
    this.marked(state.design);
    byId("of-design").textContent = `design ${entry.iteration}`;
    fillTable(byId("tasks"), tasksTable(facts, entry));
    fillTable(byId("limits"), limitsTable(facts, entry));
    fillPairs(byId("design-facts"), designRows(entry));
    byId("held").textContent = entry.held ? "The design satisfies all limits." : "The design violates limits.";
    byId("held").className = entry.held ? "ok" : "broken";
    this.shown?.();
  }

  // Which limit is nearest at a place of the window.
  #point(x, y) {
    const { view, shapes, drawn, facts } = this;
    if (!view || !drawn || this.state.mode !== "limits") return;
    const vertex = view.vertexAt(x, y);
    const { values, limits } = shapes.used(drawn);
    byId("here").textContent = vertex === null ? HERE : `here ${facts.limit_words[limits[vertex]]}, ${values[vertex].toFixed(0)} %`;
  }

  // The start as it is under the same task and as near to the same part of its pressures as is stored.
  #ghost() {
    const { shapes, state } = this;
    const stops = shapes.stops(0, state.task);
    const own = shapes.stops(state.design, state.task);
    if (stops.length === 0 || own.length === 0) return shapes.atRest(0);
    return shapes.moved(0, stops[Math.round(partOf(state.stop, own) * (stops.length - 1))]);
  }

  // What part of its pressures is shown, 0 to 1.
  get part() {
    return partOf(this.state.stop, this.shapes.stops(this.state.design, this.state.task));
  }

  #storedWords(stops) {
    const there = this.facts.states.filter(({ tasks }) => tasks.length > 0).map(({ design }) => design);
    if (there.length === 0) return "No inflated shapes are stored in this run: designs are shown at rest.";
    const which = there.length > 1 ? `designs ${there.slice(0, -1).join(", ")} and ${there.at(-1)}` : `design ${there[0]}`;
    if (this.state.task && stops.length === 0) return `The design is shown at rest: inflated shapes are stored for ${which} only.`;
    if (stops.length > 0 && stops.length < 4) return `Shapes are stored at ${stops.length === 1 ? "the full pressures only" : `${stops.length} pressures`}; nothing is drawn between them.`;
    return "";
  }

  #shownWords(entry, stop, whole) {
    if (!stop) return `design ${entry.iteration} at rest`;
    if (!whole) return `design ${entry.iteration} at ${pressureWords(stop.pressures)}`;
    const motion = entry.motions[this.state.task];
    return `${motion.word}: ${motion.text} at ${motion.at}`;
  }
}

const partOf = (stop, stops) => (stops.length > 1 ? stop / (stops.length - 1) : 1);

function makeView(name) {
  try {
    const view = new View(byId("view"));
    byId("reset").addEventListener("click", () => view.reset());
    byId("picture").addEventListener("click", () => {
      byId("view").querySelector("canvas").toBlob((picture) => save(name(), picture, "image/png"));
    });
    return view;
  } catch (error) {
    byId("no-view").hidden = false;
    byId("no-view").textContent = `This browser cannot draw in three dimensions (${error.message}); the numbers are below.`;
    return null;
  }
}

// Pressures in MPa as people read them.
export function pressureWords(pressures) {
  const all = Object.entries(pressures);
  const words = all.slice(0, 4).map(([name, value]) => `${all.length > 1 ? `${name} ` : ""}${short(1e3 * value, 3)}`);
  return `${words.join(", ")}${all.length > 4 ? ", …" : ""} kPa`;
}

function describe(facts, shapes, state) {
  const { result, history } = facts;
  byId("title").textContent = facts.title;
  const motions = facts.tasks.map(({ name }) => {
    const [start, end] = [history[0].motions[name], history.at(-1).motions[name]];
    return element("li", {}, element("span", {}, facts.tasks.length > 1 ? `${name}: ${end.word}` : end.word), element("b", {}, end.text), element("small", {}, `from ${start.found}, at ${end.at}`));
  });
  byId("headline").replaceChildren(...motions);
  byId("reason").textContent = result
    ? `The run ended after design ${result.iterations} because ${result.reason}.`
    : `The run has not come to its end: this is what there is after design ${history.at(-1).iteration}.`;
  byId("warnings").replaceChildren(...facts.warnings.map((text) => element("li", {}, text)));
  byId("notes").textContent = facts.notes.length ? `In this page ${facts.notes.join(", and ")}.` : "";
  fillPairs(byId("run"), runRows(facts));
  fillPairs(byId("material"), facts.material);
  byId("problem").textContent = facts.problem;
  const button = (words, act) => {
    const made = element("button", { type: "button" }, words);
    made.addEventListener("click", act);
    byId("files").append(made);
  };
  byId("files").replaceChildren();
  const stem = facts.directory;
  button("Control nets of this design (CSV)", () => save(`${stem}-nets-${history[state.design].iteration}.csv`, netsAsCsv(shapes, [state.design])));
  button("Control nets of all designs (CSV)", () => save(`${stem}-nets.csv`, netsAsCsv(shapes, history.map((_, design) => design))));
  button("Problem file (TOML)", () => save("problem.toml", facts.problem));
  for (const { name, content } of facts.files) {
    if (content) button(`Exact CAD: ${name}`, () => save(name, bytesOf(content), "model/step"));
  }
  const large = facts.files.filter(({ content }) => !content).map(({ name, bytes }) => `make/${name} (${short(bytes / 1e6, 3)} MB)`);
  byId("more-files").textContent = large.length
    ? `Too large for this page, in the run directory: ${large.join(", ")}.`
    : facts.files.length ? "The CAD was written by the last pneumorph make." : "To add exact CAD (STEP) here, run pneumorph make and then pneumorph report.";
}

function keys(designs, pressures) {
  const acts = { "[": () => designs.step(-1), "]": () => designs.step(1), ",": () => pressures.step(-1), ".": () => pressures.step(1), p: () => designs.toggle(), i: () => pressures.toggle() };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input:not([type=range])")) return;
    acts[event.key]?.();
  });
}
