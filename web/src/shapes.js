// The shapes of a run: every design at rest from what is stored of its surfaces, stored designs as tasks move them.
import { named } from "./named.js";
import { Lattice } from "./surface.js";
import { Walls } from "./thickness.js";

export class Shapes {
  constructor(packed) {
    this.packed = packed;
    this.facts = packed.facts;
    this.surfaces = this.facts.surfaces.map((surface) => {
      const [, ...shape] = packed.shape(surface.stored);
      const made = surface.kind === "tube" ? { rows: shape[0], columns: shape[1] } : { count: shape[0], index: packed.array(`corners ${surface.key}`) };
      return { ...surface, ...made, size: shape.reduce((product, part) => product * part, 1), designs: packed.array(surface.stored) };
    });
    this.obstacles = this.facts.obstacles.map((name) => ({
      name,
      positions: packed.array(`obstacle points ${name}`),
      index: Uint32Array.from(packed.array(`obstacle triangles ${name}`)),
    }));
    this.lattice = new Lattice(this.surfaces);
    this.kept = new Map();
  }

  // What is stored of a surface in a design, three numbers to a point: its control net, or its vertices.
  points(surface, design) {
    return surface.designs.subarray(design * surface.size, (design + 1) * surface.size);
  }

  // A design at rest.
  atRest(design) {
    return this.#once(`rest ${design}`, () => {
      const positions = this.lattice.positions(this.surfaces.map((surface) => this.points(surface, design)));
      return { positions, rest: positions, index: this.lattice.index, owner: this.lattice.owner, tip: null, design, skin: "rest", obstacles: named([]) };
    });
  }

  // What is stored of a design under a task: its stops, or nothing.
  stops(design, task) {
    const iteration = this.facts.history[design].iteration;
    const stored = this.facts.states.find((state) => state.design === iteration);
    return stored?.tasks.find((each) => each.task === task)?.stops ?? [];
  }

  // A stored design at one of these stops.
  moved(design, stop) {
    return this.#once(`moved ${stop.name}`, () => ({ ...inflated(this.packed, this.#stored(design).skin, stop), design, skin: "stored" }));
  }

  // What is stored of a design, with the surfaces of its mesh; null where nothing is.
  #stored(design) {
    return this.#once(`stored ${design}`, () => {
      const { iteration } = this.facts.history[design];
      const state = this.facts.states.find((each) => each.design === iteration);
      return state ? { ...state, skin: this.#skin(this.packed, state) } : null;
    });
  }

  // A design in a state that came alone, in a block of its own.
  explored(design, packed) {
    const { state } = packed.facts;
    const skin = this.#skin(packed, state);
    // Thickness is measured once for every mesh.
    const mesh = `explored ${skin.rest.length} ${skin.rest.reduce((sum, value) => sum + value, 0)}`;
    return { ...inflated(packed, skin, state.tasks[0].stops[0]), design, skin: mesh };
  }

  // The body as its fast model has it, by the amounts of its modes.
  modelled(amounts) {
    const { model } = this.facts;
    const skin = this.#once("model", () => this.#skin(this.packed, { design: "model", parts: model.parts }));
    const [moved, stretched] = ["moved", "stretched"].map((what) => amounts.map((_, k) => this.#once(`${what} ${k}`, () => Float32Array.from(this.packed.array(`${what} model ${k}`)))));
    const sum = (start, modes) => modes.reduce((all, mode, k) => (mode.forEach((value, i) => (all[i] += amounts[k] * value)), all), start);
    const design = this.facts.history.findIndex(({ iteration }) => iteration === model.design);
    const stretch = sum(new Float64Array(skin.rest.length / 3).fill(1), stretched);
    return { ...skin, positions: sum(Float64Array.from(skin.rest), moved), stretch, design, skin: "model", obstacles: model.obstacles };
  }

  // Wall thickness at the vertices of a shape up to `most`, by the surfaces of its design at rest.
  thickness(shape, most) {
    return this.#once(`thickness ${shape.skin} ${shape.design}`, () => {
      return this.#walls(shape.design).distances(shape.rest, shape.owner, most);
    });
  }

  // At the vertices of a shape, by its design at rest: the share of the nearest limit that is used, in per cent, and the
  // number of that limit among the words for limits.
  used(shape) {
    return this.#once(`used ${shape.skin} ${shape.design}`, () => {
      const there = this.#usedAtRest(shape.design);
      if (shape.skin === "rest") return there;
      const same = this.#walls(shape.design).nearest(shape.rest, shape.owner);
      return { values: Float32Array.from(same, (i) => there.values[i]), limits: Uint8Array.from(same, (i) => there.limits[i]) };
    });
  }

  // The motions of a task, or of the first one that has some stored, of which it is stored what more rubber does to them.
  motions(design, task) {
    const all = this.#stored(design)?.tasks.filter(({ thickening }) => thickening) ?? [];
    return (all.find((each) => each.task === task) ?? all[0])?.thickening ?? [];
  }

  // What more rubber at the vertices of a shape does to one of these motions, and words for that; null where there is none.
  thickening(shape, task, motion) {
    const stored = this.#stored(shape.design);
    const motions = this.motions(shape.design, task);
    const thickening = motions.find((each) => each.motion === motion) ?? motions[0];
    if (!thickening) return null;
    return this.#once(`${thickening.name} ${shape.skin}`, () => {
      const values = this.packed.array(thickening.name);
      if (shape.skin === "stored") return { values, words: thickening.words };
      const { rest, index, owner } = stored.skin;
      const same = new Walls(rest, index, owner).nearest(shape.rest, shape.owner);
      return { values: Float32Array.from(same, (i) => values[i]), words: thickening.words };
    });
  }

  // Whether that is stored of any design.
  get thickened() {
    return this.facts.states.some(({ tasks }) => tasks.some(({ thickening }) => thickening));
  }

  #usedAtRest(design) {
    return this.#once(`used at rest ${design}`, () => {
      const stored = (what) => this.surfaces.map(({ key }) => storedOf(this.packed, `${what} ${key}`, design));
      return { values: this.lattice.spread(stored("used")).map((share) => 100 * share), limits: this.lattice.spread(stored("limit"), true) };
    });
  }

  #walls(design) {
    return this.#once(`walls ${design}`, () => {
      const { positions, index, owner } = this.atRest(design);
      return new Walls(positions, index, owner);
    });
  }

  // How far the vertices have come: from rest under pressure, from the start where the design is at rest.
  displacement(shape) {
    const from = shape.stretch ? shape.rest : this.atRest(0).positions;
    return Float32Array.from({ length: shape.positions.length / 3 }, (_, i) =>
      Math.hypot(...[0, 1, 2].map((axis) => shape.positions[3 * i + axis] - from[3 * i + axis])),
    );
  }

  // The surfaces of a design's mesh.
  #skin(packed, { design: number, parts }) {
    const rest = Float32Array.from(packed.array(`points ${number}`));
    const owner = new Uint16Array(rest.length / 3);
    let [first, tip] = [0, null];
    for (const part of parts) {
      const surface = this.surfaces.findIndex((s) => s.cavity === part.cavity && (!s.cavity || s.name === part.surface));
      owner.fill(surface, first, part.vertices);
      if (part.face === "tip") tip = [first, part.vertices];
      first = part.vertices;
    }
    return { rest, index: Uint32Array.from(packed.array(`triangles ${number}`)), owner, tip };
  }

  // The latest of what was made, so that playing does not make it again and again.
  #once(key, make) {
    if (!this.kept.has(key)) {
      const made = make();
      this.kept.set(key, made);
      if (this.kept.size > 160) this.kept.delete(this.kept.keys().next().value);
    }
    return this.kept.get(key);
  }
}

// The numbers of one design on a surface.
function storedOf(packed, name, design) {
  const [, ...shape] = packed.shape(name);
  const size = shape.reduce((product, part) => product * part, 1);
  return { shape, values: packed.array(name).subarray(design * size, (design + 1) * size) };
}

function inflated(packed, skin, { name, obstacles }) {
  const u = packed.array(`u ${name}`);
  return { ...skin, positions: skin.rest.map((value, i) => value + u[i]), stretch: packed.array(`stretch ${name}`), obstacles };
}
