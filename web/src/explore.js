// Pressures that are set on the page. Where there is a fast model of the design, it is drawn at once; where there is a
// server, the state that is asked for takes its place once it is solved, and until then the nearest known one is shown
// where there is no model.
import * as server from "./client.js";
import { DISPLACEMENT } from "./colours.js";
import { byId, element } from "./elements.js";
import { named } from "./named.js";
import { keyOf, nearest, stepOf } from "./nearest.js";
import { EXPLORE, pressureWords } from "./page.js";
import { atMost, short } from "./numbers.js";
import { exploredTable, fillTable, modelledTable } from "./tables.js";

const PATIENCE = 150; // milliseconds without a change before a state is asked for
const EVERY = 700; // milliseconds between looks at the sweep
const MOST = 60; // states that are kept
const AXES = ["x", "y", "z"];
const DEGREES = 180 / Math.PI;

export class Explorer {
  // number(): which run of a server is shown; null without a server.
  constructor(page, number = null) {
    Object.assign(this, { page, number, sliders: [], wanted: named([]), target: null, tip: null, turn: null, place: "", run: "", known: [], states: new Map(), ticket: 0, task: "" });
    for (const name of ["target", "turn"]) {
      for (const axis of AXES) byId(`${name}-${axis}`).addEventListener("change", () => this.#aim(numbers("target"), this.#typedTurn(), true));
    }
    byId("turned").addEventListener("change", (event) => this.#aim(this.target?.place ?? this.tip, event.target.checked ? this.turn : null, true));
    for (const name of ["places", "places-by", "soft"]) byId(name).addEventListener("change", () => this.#reach());
  }

  // Called after every change of what the page shows.
  follow() {
    const { state, facts, view } = this.page;
    const exploring = state.task === EXPLORE;
    byId("explore").hidden = !exploring;
    if (!exploring) {
      this.task = state.task;
      this.place = "";
      view?.reach?.show(null);
      return;
    }
    const place = `${this.number?.()} ${facts.history[state.design].iteration} ${facts.directory}`;
    if (place === this.place) return this.#reach();
    this.place = place;
    const run = `${this.number?.()} ${facts.directory}`;
    if (run !== this.run) this.sliders = [];
    this.run = run;
    this.known = [];
    this.states.clear();
    this.#sliders();
    if (this.number) this.#sweep(place, true);
    this.#want(this.wanted);
  }

  get #design() {
    return this.page.facts.history[this.page.state.design].iteration;
  }

  // The fast model, if it is of the design that is shown.
  get #model() {
    return this.page.model?.design === this.#design ? this.page.model : null;
  }

  // One to a chamber; they begin at the pressures of the task that was shown, and stay where they have been set.
  #sliders() {
    const { facts, state } = this.page;
    const given = facts.sliders ?? facts.model.chambers.map((chamber, c) => ({ chamber, least: facts.model.bounds[c][0], most: facts.model.bounds[c][1] }));
    const chambers = given.map(({ chamber }) => chamber).join();
    if (this.sliders.length > 0 && this.sliders.map(({ chamber }) => chamber).join() === chambers) return;
    const tasks = facts.history[state.design].tasks;
    const begin = (tasks[this.task] ?? tasks[facts.tasks[0].name]).pressure_MPa;
    this.sliders = given.map(({ chamber, least, most }, number) => {
      const step = stepOf(1e3 * least, 1e3 * most);
      const [low, high] = [Math.floor((1e3 * least) / step + 1e-9) * step, Math.ceil((1e3 * most) / step - 1e-9) * step];
      const slider = element("input", { type: "range", id: `chamber-${number}`, min: low, max: high, step });
      const shown = element("output", { for: slider.id });
      slider.addEventListener("input", () => this.#want(named([...Object.entries(this.wanted), [chamber, Number(slider.value)]])));
      const row = element("div", { class: "row" }, element("span"), element("label", { for: slider.id }, chamber), slider, shown);
      return { chamber, slider, shown, row, begin: Math.min(Math.max(1e3 * begin[chamber], low), high) };
    });
    this.wanted = named(this.sliders.map((each) => [each.chamber, each.begin]));
    byId("chambers").replaceChildren(...this.sliders.map(({ row }) => row));
  }

  // Show what is known now; ask for what is wanted when the sliders rest. target: { place, turn, missed, reached }.
  #want(wanted, target = null) {
    Object.assign(this, { wanted, target });
    for (const { chamber, slider, shown } of this.sliders) {
      slider.value = wanted[chamber];
      shown.textContent = `${short(wanted[chamber], 4)} kPa`;
    }
    const ticket = ++this.ticket;
    clearTimeout(this.timer);
    this.modelled = this.#model?.at(wanted) ?? null;
    const there = this.states.get(keyOf(wanted)) ?? this.#ofTask(wanted);
    this.solving = !there && this.number !== null;
    if (there) return this.#show(there, wanted);
    if (this.modelled) this.#draw(wanted);
    else if (!this.number) this.#unknown();
    else this.#near(wanted, ticket);
    if (this.solving) this.timer = setTimeout(() => this.#solve(wanted, ticket), PATIENCE);
  }

  // The tip to a place, turned if the target is, or as near to it as it gets; from anywhere once the target stays there.
  #aim(place, turn, rests) {
    const model = this.#model;
    if (!model || ![...place, ...(turn ?? [])].every(Number.isFinite)) return;
    const { pressures, missed, reached } = model.for(place, turn, rests ? null : this.wanted);
    this.#want(this.#whole(pressures), { place, turn, missed, reached });
  }

  // The rotation vector that is typed, if the target is to be turned.
  #typedTurn() {
    return byId("turned").checked ? numbers("turn").map((degrees) => degrees / DEGREES) : null;
  }

  // With no pressure in the chambers that the model does not have.
  #whole(pressures) {
    return named(this.sliders.map(({ chamber }) => [chamber, pressures[chamber] ?? 0]));
  }

  // The body of the fast model.
  #draw(wanted) {
    const { shape, motions, tip, volumes, fineness, stiffness, inside } = this.modelled;
    const { errors, held_out: count } = this.page.facts.model;
    const words = wordsOf(wanted);
    const off = `off by at most ${atMost(errors.translation_mm)} mm at the tip and ${atMost(errors.shape_mm)} mm on the surfaces`;
    this.#say(`Drawn by the fast model, which was ${off} at ${count} exact states.${this.solving ? " The exact state is being solved …" : ""}`);
    if (!inside) byId("explore-warnings").replaceChildren(element("li", {}, "Outside the domain of the model: no stable state is known at these pressures."));
    fillTable(byId("explored"), modelledTable({ motions, volumes, fineness, stiffness, errors, inside }, words));
    Object.assign(this, { tip, turn: motions.slice(3) });
    this.page.explored = { shape, words: `${words}, by the fast model` };
    byId("explore").dataset.drawn = keyOf(wanted);
    this.page.show();
  }

  // Neither a model nor a server knows.
  #unknown() {
    this.tip = null;
    this.#say(`The fast model is that of design ${this.page.model.design}: choose that design to set pressures.`);
    byId("explored").replaceChildren();
    this.page.explored = null;
    this.page.show();
  }

  // The target, and where the tip can go.
  #reach() {
    const { view } = this.page;
    const drives = this.#model !== null && this.tip !== null;
    byId("driving").hidden = !drives;
    const { reach } = view ?? {};
    if (reach) {
      const turn = () => this.target?.turn ?? null;
      reach.moved = (place, rests) => this.#aim(place, turn(), rests);
      reach.turned = (turn, rests) => this.#aim(this.target.place, turn, rests);
      reach.chosen = (number) => this.#want(this.#whole(this.#model.ofPlace(number)));
      reach.show(drives ? this.tip : null, this.target?.place ?? null, byId("places").checked, turn());
      this.#paint(reach, drives);
      this.#soften(reach, drives);
    }
    if (!drives) return;
    byId("turned").checked = Boolean(this.target?.turn);
    byId("turns").hidden = !byId("turned").checked;
    byId("places-colours").hidden = !byId("places").checked;
    const [at, turn] = [this.target?.place ?? this.tip, this.target?.turn ?? this.turn];
    AXES.forEach((axis, k) => {
      byId(`target-${axis}`).value = at[k].toFixed(2);
      byId(`turn-${axis}`).value = (DEGREES * turn[k]).toFixed(2);
    });
    const counted = this.target?.turn ? ", where 1° counts as 1 mm" : "";
    byId("reached").textContent = !this.target
      ? "Drag the ball at the tip, or type a place: the pressures follow."
      : this.target.reached ? "The target is reached." : `The target is out of reach by ${short(this.target.missed, 2)} mm${counted}; this is the nearest ${this.target.turn ? "pose" : "place"}.`;
  }

  // Where small forces move the tip to; the size of the force is that which the longest half axis shows best.
  #soften(reach, drives) {
    const shown = drives && this.modelled && byId("soft").checked;
    const force = shown ? this.page.model.forceFor(reach.wide) : 0;
    reach.soften(this.tip, shown ? this.modelled.compliance : null, force);
    byId("soft-words").textContent = shown ? `(where ${force} N in any direction moves the tip, if it were linear)` : "";
  }

  // The places in the colours that were chosen, and their scale.
  #paint(reach, drives) {
    const by = drives && byId("places").checked ? byId("places-by").value : "";
    const painted = `${by} ${this.place}`;
    byId("places-scale").hidden = !by;
    if (reach.painted === painted || !this.page.model) return;
    reach.painted = painted;
    const values = by ? this.page.model[by] : null;
    const range = values && [Math.min(...values), Math.max(...values)];
    reach.paint(values, range, DISPLACEMENT);
    if (!values) return;
    const [low, bar, high] = byId("places-scale").children;
    [low.textContent, high.textContent] = range.map((value) => short(value, 2));
    bar.style.background = `linear-gradient(to right, ${DISPLACEMENT.join(", ")})`;
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
    this.#say(`Solving at ${wordsOf(wanted)} …`);
    if (!near) return;
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
    this.tip = this.page.model ? this.page.model.rest.map((value, axis) => value + found.step.translation_mm[axis]) : null;
    this.turn = found.step.rotation_rad;
    const off = exact && this.modelled && Math.hypot(...found.step.translation_mm.map((value, axis) => value - this.modelled.motions[axis]));
    this.#say(exact ? (this.modelled ? `This is the exact state. The tip of the fast model is at most ${atMost(off)} mm from it.` : "") : `Solving at ${wordsOf(wanted)} … Shown until then is the nearest known state, at ${words}.`);
    byId("explore-warnings").replaceChildren(...found.warnings.map((text) => element("li", {}, text)));
    fillTable(byId("explored"), exploredTable(found.step, words, exact ? this.modelled : null));
    this.page.explored = { shape: found.shape, words };
    byId("explore").dataset.solved = exact ? keyOf(wanted) : "";
    byId("explore").dataset.drawn = "";
    this.page.show();
  }

  #picture(stop, wanted) {
    const words = pressureWords(stop.pressures);
    this.#say(`Solving at ${wordsOf(wanted)} … Shown until then is the stored shape at ${words}.`);
    byId("explore-warnings").replaceChildren();
    byId("explored").replaceChildren();
    this.tip = null;
    this.page.explored = { shape: this.page.shapes.moved(this.page.state.design, stop), words };
    this.page.show();
  }

  #say(words, warning = "") {
    byId("solving").textContent = words;
    byId("explore").dataset.solved = "";
    byId("explore-warnings").replaceChildren();
    if (warning) byId("explore-warnings").replaceChildren(element("li", {}, warning));
  }

  async #sweep(place, start) {
    if (place !== this.place) return;
    try {
      const { known, left } = await server.sweep(this.number(), this.#design, start);
      if (place !== this.place) return;
      const more = known.length > this.known.length;
      this.known = known;
      if (more && this.solving && !this.modelled) this.#near(this.wanted, this.ticket);
      if (left > 0) setTimeout(() => this.#sweep(place, false), EVERY);
    } catch (error) {
      if (place === this.place) this.#say(error.message);
    }
  }
}

const numbers = (name) => AXES.map((axis) => Number(byId(`${name}-${axis}`).value));

const inKilopascals = (pressures) => named(Object.entries(pressures).map(([name, value]) => [name, 1e3 * value]));

const wordsOf = (kilopascals) => pressureWords(named(Object.entries(kilopascals).map(([name, value]) => [name, value / 1e3])));
