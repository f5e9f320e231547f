// The fast model of a design as the page uses it: the body at pressures, the pressures for a place, where the tip can go.
// Pressures by chamber are in kPa, as on the page.
import { tipOf } from "./marks.js";
import { MOTIONS, Model } from "./model.js";
import { named } from "./named.js";

const PLACES = 800;

export class Driven {
  constructor(facts, shapes) {
    Object.assign(this, { facts, shapes, design: facts.model.design, model: new Model(facts.model) });
    this.rest = tipOf(shapes.modelled(facts.model.amounts.coefficients[0].map(() => 0)), facts.length).at.toArray();
    this.pressures = this.model.spread(PLACES);
    this.places = this.pressures.map((p) => this.#tip(this.model.motions(p)));
    // What places may be coloured by: mm per kPa, N/mm.
    this.finest = this.pressures.map((p) => this.model.fineness(p)[0] / 1e3);
    this.softest = this.pressures.map((p) => this.model.stiffness(p)[0]);
  }

  // What the tip's motions lead it to.
  #tip = (motions) => this.rest.map((value, axis) => value + motions[axis]);

  // The model's pressures; null where it does not have some of these.
  #own(wanted) {
    const { chambers } = this.model;
    if (Object.entries(wanted).some(([name, value]) => value !== 0 && !chambers.includes(name))) return null;
    const p = chambers.map((name) => (wanted[name] ?? 0) / 1e3);
    return this.model.covers(p) ? p : null;
  }

  // The force, N, that moves the tip by a length at most, with one digit.
  forceFor(length) {
    return Number((length * Math.min(...this.softest)).toPrecision(1));
  }

  // The body at pressures: its shape, the motions of the tip and its place, volumes, how finely it moves (mm per kPa) and how stiff
  // it is (N/mm), its compliance, whether a stable state is known there; null where the model does not have these pressures.
  at(wanted) {
    const p = this.#own(wanted);
    if (!p) return null;
    const values = this.model.values(p);
    const motions = values.slice(0, 6);
    const volumes = named(this.model.chambers.map((name, c) => [name, values[6 + c]]));
    const [fineness, stiffness] = [this.model.fineness(p).map((value) => value / 1e3), this.model.stiffness(p)];
    const [shape, compliance] = [this.shapes.modelled(this.model.amountsAt(p)), this.model.compliance(p)];
    return { shape, motions, tip: this.#tip(motions), volumes, fineness, stiffness, compliance, inside: this.model.inside(p) };
  }

  // The pressures with which the tip is nearest to a place, turned by a rotation vector if there is one, beginning from others or
  // anywhere, and what is missed, mm.
  for(place, turn = null, near = null) {
    const wanted = [...place.map((value, axis) => value - this.rest[axis]), ...(turn ?? [])];
    const named = Object.fromEntries(wanted.map((value, k) => [MOTIONS[k], value]));
    const { p, missed, reached } = this.model.pressuresFor(named, near && this.#own(near));
    return { pressures: this.#named(p), missed, reached };
  }

  // The pressures of a place among `places`.
  ofPlace(number) {
    return this.#named(this.pressures[number]);
  }

  #named = (p) => named(this.model.chambers.map((name, c) => [name, 1e3 * p[c]]));
}
