// The plane that cuts the body, as it is chosen on the page.
import { byId } from "./elements.js";
import { extremes } from "./frame.js";
import { short } from "./numbers.js";

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

export class Cut {
  // changed(where) is called with { normal, offset }, or null where nothing is cut.
  constructor(changed) {
    this.changed = changed;
    this.axis = byId("cut-axis");
    this.at = byId("cut-at");
    this.flip = byId("cut-flip");
    this.axis.addEventListener("change", () => this.#turn());
    for (const input of [this.at, this.flip]) input.addEventListener("input", () => this.apply());
  }

  // A run with the points of its picture; of the same run the plane stays.
  load(facts, points, view, same) {
    Object.assign(this, { facts, points, view });
    if (!same) {
      const { normal, offset } = facts.view;
      const sign = normal.find((part) => Math.abs(part) > 0.5);
      this.axis.value = ["x", "y", "z"][normal.findIndex((part) => Math.abs(part) > 0.5)];
      this.flip.checked = sign < 0;
      this.#range();
      this.at.value = sign * offset;
    } else this.#range();
    this.apply();
  }

  apply() {
    const axis = this.axis.value;
    byId("cut-shown").textContent = axis ? `${axis} = ${short(Number(this.at.value), 3)} mm` : "off";
    this.at.disabled = this.flip.disabled = !axis;
    const way = this.flip.checked ? -1 : 1;
    this.where = axis ? { normal: AXES[axis].map((part) => way * part), offset: way * Number(this.at.value) } : null;
    this.changed(this.where);
  }

  #turn() {
    const axis = this.axis.value;
    this.#range();
    this.at.value = axis === "z" ? this.facts.length / 2 : 0;
    // Keep the half behind the plane, so that its cut face is seen.
    if (this.view && axis) this.flip.checked = this.view.isBefore(AXES[axis]);
    this.apply();
  }

  #range() {
    const [low, high] = this.axis.value ? extremes(this.points, "xyz".indexOf(this.axis.value)) : [0, 1];
    Object.assign(this.at, { min: low.toFixed(2), max: high.toFixed(2) });
  }
}
