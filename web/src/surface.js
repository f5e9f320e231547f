// Vertices and triangles of a body's surfaces, of each as its kind is drawn.
import { Triangles } from "./triangles.js";
import { Tube } from "./tube/tube.js";

const MOST = 40_000; // vertices of a body's tubes, within which playing is smooth

// Which vertices a body has and how they hang together; the same for every design of a run.
export class Lattice {
  // surfaces: [{ kind: "tube", rows, columns, ends } or { kind: "triangles", count, index }]; perSpan: samples to each span
  // of the splines, fewer where there are too many.
  constructor(surfaces, perSpan = 4) {
    const tubes = surfaces.filter(({ kind }) => kind === "tube");
    const wanted = (n) => tubes.reduce((sum, s) => sum + n * n * s.rows * s.columns, 0);
    let fine = perSpan;
    while (fine > 1 && wanted(fine) > MOST) fine--;
    this.parts = surfaces.map((surface) => (surface.kind === "tube" ? new Tube(surface, fine) : new Triangles(surface)));
    this.owner = []; // surface of every vertex
    const index = [];
    let first = 0;
    this.parts.forEach((part, number) => {
      part.first = first;
      for (const corner of part.index) index.push(first + corner);
      first += part.count;
      for (let i = 0; i < part.count; i++) this.owner.push(number);
    });
    this.index = Uint32Array.from(index);
    this.owner = Uint16Array.from(this.owner);
    this.count = first;
  }

  // Vertices (three numbers each) from what is stored of a design, one flat array to a surface.
  positions(stored) {
    const points = new Float32Array(3 * this.count);
    this.parts.forEach((part, number) => part.put(stored[number], points, 3 * part.first));
    return points;
  }

  // A value to every vertex from what is stored of every surface, { shape, values }, or the nearest of these.
  spread(stored, nearest = false) {
    const values = new Float32Array(this.count);
    this.parts.forEach((part, number) => part.spread(stored[number], nearest, values, part.first));
    return values;
  }
}
