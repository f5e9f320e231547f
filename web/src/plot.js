// Small diagrams over the designs of a run; a line marks the design that is shown, and a click chooses one.
import { drawn } from "./elements.js";
import { short, ticks } from "./numbers.js";

const [WIDE, HIGH] = [320, 178];
const [LEFT, RIGHT, TOP, BOTTOM] = [46, 10, 10, 26];

// lines: [{ name, values, colour, fine }], of which fine are values without the error of the mesh, where known; bound: { value, atLeast }, bars: stacked instead of lines, named: with a legend also for
// one line; chosen(design) is called.
export class Plot {
  constructor({ title, unit, designs, lines, bound, bars = false, fromZero = bars }, chosen) {
    Object.assign(this, { designs, lines, unit, bound });
    const totals = designs.map((_, i) => lines.reduce((sum, line) => sum + (line.values[i] ?? 0), 0));
    const values = (bars ? totals : lines.flatMap(({ values, fine = [] }) => [...values, ...fine])).filter(Number.isFinite);
    if (bound) values.push(bound.value);
    let [low, high] = [Math.min(...values), Math.max(...values)];
    if (fromZero) low = Math.min(low, 0);
    const margin = 0.08 * (high - low || Math.abs(high) || 1);
    [low, high] = [fromZero && low >= 0 ? 0 : low - margin, high + margin];
    this.x = (place) => LEFT + ((place + 0.5) / designs.length) * (WIDE - LEFT - RIGHT);
    this.y = (value) => HIGH - BOTTOM - ((value - low) / (high - low)) * (HIGH - BOTTOM - TOP);
    this.svg = drawn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img" }, drawn("title", {}, title));
    if (bound) this.#forbid(bound);
    for (const value of ticks(low, high)) this.#across(value);
    for (const place of ticks(0, designs.length - 1, Math.min(6, designs.length)).filter(Number.isInteger)) {
      this.#text(this.x(place), HIGH - 8, String(designs[place]), "middle");
    }
    this.marker = this.svg.appendChild(drawn("line", { class: "marker", y1: TOP, y2: HIGH - BOTTOM }));
    if (bars) this.#stack(lines, low);
    else for (const line of lines) this.#line(line);
    this.dots = lines.map(({ colour }) => this.svg.appendChild(drawn("circle", { r: bars ? 0 : 4, fill: colour })));
    this.svg.addEventListener("click", (event) => {
      const box = this.svg.getBoundingClientRect();
      const along = (((event.clientX - box.left) / box.width) * WIDE - LEFT) / (WIDE - LEFT - RIGHT);
      chosen(Math.min(Math.max(Math.floor(along * designs.length), 0), designs.length - 1));
    });
  }

  // Mark a design.
  mark(place) {
    this.marker.setAttribute("x1", this.x(place));
    this.marker.setAttribute("x2", this.x(place));
    this.lines.forEach(({ values }, number) => {
      const there = Number.isFinite(values[place]);
      this.dots[number].setAttribute("visibility", there ? "visible" : "hidden");
      if (!there) return;
      this.dots[number].setAttribute("cx", this.x(place));
      this.dots[number].setAttribute("cy", this.y(values[place]));
    });
  }

  // Where a value breaks its limit.
  #forbid({ value, atLeast }) {
    const [at, end] = [this.y(value), atLeast ? HIGH - BOTTOM : TOP];
    const place = { x: LEFT, width: WIDE - LEFT - RIGHT, y: Math.min(at, end), height: Math.abs(at - end) };
    this.svg.append(
      drawn("rect", { class: "forbidden", ...place }),
      drawn("line", { class: "bound", x1: LEFT, x2: WIDE - RIGHT, y1: at, y2: at }),
    );
  }

  #across(value) {
    const at = this.y(value);
    if (at < TOP - 1 || at > HIGH - BOTTOM + 1) return;
    this.svg.append(drawn("line", { class: "grid", x1: LEFT, x2: WIDE - RIGHT, y1: at, y2: at }));
    this.#text(LEFT - 6, at + 3.5, short(value), "end");
  }

  #text(x, y, words, anchor) {
    this.svg.append(drawn("text", { x, y, "text-anchor": anchor }, words));
  }

  #line({ values, colour, fine = [] }) {
    let path = "";
    values.forEach((value, place) => {
      if (Number.isFinite(value)) path += `${path ? "L" : "M"}${this.x(place).toFixed(1)} ${this.y(value).toFixed(1)}`;
    });
    this.svg.append(drawn("path", { d: path, class: "line", stroke: colour }));
    fine.forEach((value, place) => {
      if (!Number.isFinite(value)) return;
      const [x, y] = [this.x(place), this.y(value)];
      const stroke = `M${x.toFixed(1)} ${this.y(values[place]).toFixed(1)}V${y.toFixed(1)}M${(x - 3).toFixed(1)} ${y.toFixed(1)}h6`;
      this.svg.append(drawn("path", { d: stroke, class: "line", stroke: colour }));
    });
  }

  #stack(lines, low) {
    const wide = Math.max((0.8 * (WIDE - LEFT - RIGHT)) / this.designs.length, 1);
    this.designs.forEach((_, place) => {
      let from = low;
      for (const { values, colour } of lines) {
        const to = from + (values[place] ?? 0);
        const [y, height] = [this.y(to), Math.max(this.y(from) - this.y(to), 0)];
        this.svg.append(drawn("rect", { x: this.x(place) - wide / 2, width: wide, y, height, fill: colour }));
        from = to;
      }
    });
  }
}
