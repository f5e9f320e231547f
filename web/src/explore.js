// Pressures that are set on the page: the nearest known state at once, and the one that is asked for once it is solved.
import * as server from "./client.js";
import { byId, element } from "./elements.js";
import { named } from "./named.js";
import { keyOf, nearest, stepOf } from "./nearest.js";
import { EXPLORE, pressureWords } from "./page.js";
import { short } from "./numbers.js";
import { exploredTable, fillTable } from "./tables.js";

const PATIENCE = 150; // milliseconds without a change before a state is asked for
const EVERY = 700; // milliseconds between looks at the sweep
const MOST = 60; // states that are kept

export class Explorer {
  // number(): which run is shown.
  constructor(page, number) {
    Object.assign(this, { page, number, sliders: [], place: "", known: [], states: new Map(), ticket: 0, task: "" });
  }

  // Called after every change of what the page shows.
  follow() {
    const { state, facts } = this.page;
    const exploring = state.task === EXPLORE;
    byId("explore").hidden = !exploring;
    if (!exploring) {
      this.task = state.task;
      this.place = "";
      return;
    }
    const place = `${this.number()} ${facts.history[state.design].iteration} ${facts.directory}`;
    if (place === this.place) return;
    this.place = place;
    this.known = [];
    this.states.clear();
    this.#sliders();
    this.#sweep(place, true);
    this.#want();
  }

  get #design() {
    return this.page.facts.history[this.page.state.design].iteration;
  }

  get #wanted() {
    return named(this.sliders.map(({ chamber, slider }) => [chamber, Number(slider.value)]));
  }

  // One to a chamber; they begin at the pressures of the task that was shown, and stay where they have been set.
  #sliders() {
    const { facts, state } = this.page;
    const chambers = facts.sliders.map(({ chamber }) => chamber).join();
    if (this.sliders.length > 0 && this.sliders.map(({ chamber }) => chamber).join() === chambers) return;
    const tasks = facts.history[state.design].tasks;
    const begin = (tasks[this.task] ?? tasks[facts.tasks[0].name]).pressure_MPa;
    this.sliders = facts.sliders.map(({ chamber, least, most }, number) => {
      const step = stepOf(1e3 * least, 1e3 * most);
      const [low, high] = [Math.floor((1e3 * least) / step) * step, Math.ceil((1e3 * most) / step) * step];
      const slider = element("input", { type: "range", id: `chamber-${number}`, min: low, max: high, step });
      slider.value = 1e3 * begin[chamber];
      const shown = element("output", { for: slider.id });
      slider.addEventListener("input", () => this.#want());
      const row = element("div", { class: "row" }, element("span"), element("label", { for: slider.id }, chamber), slider, shown);
      return { chamber, slider, shown, row };
    });
    byId("chambers").replaceChildren(...this.sliders.map(({ row }) => row));
  }

  // Show what is near now; ask for what is wanted when the sliders rest.
  #want() {
    for (const { slider, shown } of this.sliders) shown.textContent = `${short(Number(slider.value), 4)} kPa`;
    const ticket = ++this.ticket;
    clearTimeout(this.timer);
    const wanted = this.#wanted;
    const there = this.states.get(keyOf(wanted)) ?? this.#ofTask(wanted);
    this.solving = !there;
    if (there) return this.#show(there, wanted);
    this.#near(wanted, ticket);
    this.timer = setTimeout(() => this.#solve(wanted, ticket), PATIENCE);
  }

  // The state of a task at its whole pressures, which a run has stored with its numbers; nothing needs to be solved.
  #ofTask(wanted) {
    const { facts, shapes, state } = this.page;
    for (const { name } of facts.tasks) {
      const found = facts.history[state.design].tasks[name];
      const stop = shapes.stops(state.design, name).at(-1);
      // What a warning would be needed for is solved, and the solver warns.
      if (stop && found.stable && !found.beyond_validity && keyOf(inKilopascals(found.pressure_MPa)) === keyOf(wanted)) {
        return { step: found, warnings: [], shape: shapes.moved(state.design, stop), pressures: wanted };
      }
    }
    return null;
  }

  // The shapes that the run has stored of this design: pictures without all numbers, but there at once.
  #stored() {
    const { facts, shapes, state } = this.page;
    return facts.tasks.flatMap(({ name }) => shapes.stops(state.design, name).map((stop) => ({ stop, pressures: inKilopascals(stop.pressures) })));
  }

  async #near(wanted, ticket) {
    const stored = this.#stored();
    const near = nearest([...this.known, ...stored.map(({ pressures }) => pressures)], wanted);
    if (!near) return this.#say(`Solving at ${wordsOf(wanted)} …`);
    const only = this.known.includes(near) ? undefined : stored.find(({ pressures }) => pressures === near);
    if (only) return this.#picture(only.stop, wanted);
    const found = await this.#asked(near);
    if (ticket === this.ticket && this.solving && found?.shape) this.#show(found, wanted);
  }

  async #solve(wanted, ticket) {
    const place = this.place;
    const found = await this.#asked(wanted);
    if (place !== this.place || ticket !== this.ticket) return;
    this.solving = false;
    if (found === null) return this.#say("Another page asked for a state since; move a slider to ask again.");
    if (found.step.converged) {
      if (!this.known.some((each) => keyOf(each) === keyOf(wanted))) this.known.push(wanted);
      return this.#show(found, wanted);
    }
    this.#say(this.page.explored ? `Nothing was found at ${wordsOf(wanted)}; shown is the state at ${this.page.explored.words}.` : `Nothing was found at ${wordsOf(wanted)}.`, found.step.reason);
  }

  // A state of the design that is shown, from the server if it is not here; null where another was wanted first.
  async #asked(pressures) {
    const [place, key] = [this.place, keyOf(pressures)];
    if (this.states.has(key)) return this.states.get(key);
    try {
      const packed = await server.state(this.number(), this.#design, pressures);
      if (packed === null || place !== this.place) return null;
      const { step, warnings, state } = packed.facts;
      const shape = step.converged ? this.page.shapes.explored(this.page.state.design, packed) : null;
      const found = { step, warnings, state, shape, pressures };
      if (step.converged) this.states.set(key, found);
      if (this.states.size > MOST) this.states.delete(this.states.keys().next().value);
      return found;
    } catch (error) {
      return { step: { converged: false, reason: error.message }, warnings: [], pressures };
    }
  }

  #show(found, wanted) {
    const exact = keyOf(found.pressures) === keyOf(wanted);
    const words = pressureWords(found.step.pressure_MPa);
    this.#say(exact ? "" : `Solving at ${wordsOf(wanted)} … Shown until then is the nearest known state, at ${words}.`);
    byId("explore-warnings").replaceChildren(...found.warnings.map((text) => element("li", {}, text)));
    fillTable(byId("explored"), exploredTable(found.step, words));
    this.page.explored = { shape: found.shape, words };
    byId("explore").dataset.solved = exact ? keyOf(wanted) : "";
    this.page.show();
  }

  #picture(stop, wanted) {
    const words = pressureWords(stop.pressures);
    this.#say(`Solving at ${wordsOf(wanted)} … Shown until then is the stored shape at ${words}.`);
    byId("explore-warnings").replaceChildren();
    byId("explored").replaceChildren();
    this.page.explored = { shape: this.page.shapes.moved(this.page.state.design, stop), words };
    this.page.show();
  }

  #say(words, warning = "") {
    byId("solving").textContent = words;
    byId("explore").dataset.solved = "";
    if (warning) byId("explore-warnings").replaceChildren(element("li", {}, warning));
  }

  async #sweep(place, start) {
    if (place !== this.place) return;
    try {
      const { known, left } = await server.sweep(this.number(), this.#design, start);
      if (place !== this.place) return;
      const more = known.length > this.known.length;
      this.known = known;
      if (more && this.solving) this.#near(this.#wanted, this.ticket);
      if (left > 0) setTimeout(() => this.#sweep(place, false), EVERY);
    } catch (error) {
      if (place === this.place) this.#say(error.message);
    }
  }
}

const inKilopascals = (pressures) => named(Object.entries(pressures).map(([name, value]) => [name, 1e3 * value]));

const wordsOf = (kilopascals) => pressureWords(named(Object.entries(kilopascals).map(([name, value]) => [name, value / 1e3])));
