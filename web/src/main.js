// The page of a run: reads its block, and keeps what is shown and what is chosen together.
import { MODES, PLAIN, painted, quantile, showLegend } from "./colours.js";
import { bytesOf, netsAsCsv, save } from "./downloads.js";
import { byId, element } from "./elements.js";
import { historyPlots } from "./history.js";
import { short } from "./numbers.js";
import { unpack } from "./packed.js";
import { Player } from "./player.js";
import { View } from "./scene.js";
import { Shapes } from "./shapes.js";
import { designRows, fillPairs, fillTable, limitsTable, runRows, tasksTable } from "./tables.js";

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const THICK = 3; // colours of walls end at most at so many times the least wall

async function begin() {
  const packed = await unpack(byId("block").textContent.trim());
  const { facts } = packed;
  const shapes = new Shapes(packed);
  const last = facts.history.length - 1;
  const first = shapes.stops(last, facts.tasks[0].name);
  const inflated = first.length > 0;
  facts.radius = radiusOf(shapes.atRest(0).positions);
  baseOnTheLeft(facts);

  const state = {
    design: last,
    task: inflated ? facts.tasks[0].name : "",
    stop: Math.max(first.length - 1, 0),
    mode: inflated ? "stretch" : "thickness",
  };
  const ranges = rangesOf(facts, shapes);
  const view = makeView(facts, shapes);
  const marked = historyPlots(facts, byId("plots"), (design) => choose({ design }));
  const designs = new Player(byId("design"), byId("play-designs"), 220, (design) => choose({ design }));
  const pressures = new Player(byId("stop"), byId("play-pressures"), 320, (stop) => choose({ stop }));

  function choose(changes) {
    const before = shapes.stops(state.design, state.task).length - 1;
    const full = state.stop >= before;
    Object.assign(state, changes);
    const count = shapes.stops(state.design, state.task).length;
    // The whole pressures stay the whole, however many stops there are to them.
    state.stop = "stop" in changes ? state.stop : full ? Math.max(count - 1, 0) : Math.min(state.stop, Math.max(count - 1, 0));
    show();
  }

  function show() {
    const entry = facts.history[state.design];
    const stops = shapes.stops(state.design, state.task);
    const stop = stops[state.stop];
    const shape = stop ? shapes.moved(state.design, stop) : shapes.atRest(state.design);
    const whole = stop !== undefined && state.stop === stops.length - 1;
    if (view) {
      const { values, range, words } = coloured(shape, stop);
      view.show(shape, values, byId("ghost").checked ? ghostOf() : null, stop ? state.task : "", whole ? entry.tasks[state.task] : null, byId("marks").checked);
      showLegend(byId("legend"), state.mode, range, words);
    }
    designs.show(state.design, last, `${entry.iteration} of ${facts.history[last].iteration}`);
    pressures.show(state.stop, stops.length - 1, stop ? pressureWords(stop) : "at rest");
    byId("stored").textContent = storedWords(stops);
    byId("shown").textContent = shownWords(entry, stop, whole);
    marked(state.design);
    byId("of-design").textContent = `design ${entry.iteration}`;
    fillTable(byId("tasks"), tasksTable(facts, entry));
    fillTable(byId("limits"), limitsTable(facts, entry));
    fillPairs(byId("design-facts"), designRows(entry));
    byId("held").textContent = entry.held ? "All limits are held." : "Not all limits are held.";
    byId("held").className = entry.held ? "ok" : "broken";
  }

  // The start as it is under the same task and as near to the same part of its pressures as is stored.
  function ghostOf() {
    const stops = shapes.stops(0, state.task);
    const own = shapes.stops(state.design, state.task);
    if (stops.length === 0 || own.length === 0) return shapes.atRest(0);
    const part = own.length > 1 ? state.stop / (own.length - 1) : 1;
    return shapes.moved(0, stops[Math.round(part * (stops.length - 1))]);
  }

  function coloured(shape, stop) {
    const count = shape.positions.length / 3;
    const name = state.mode === "displacement" && !stop ? "change" : state.mode;
    const range = ranges[name];
    const fields = {
      thickness: () => shapes.thickness(shape, THICK * ranges.wall),
      stretch: () => shape.stretch ?? new Float32Array(count).fill(1),
      displacement: () => shapes.displacement(shape),
      change: () => shapes.displacement(shape),
      plain: () => new Float32Array(count),
    };
    const words = { change: "Change since the start", displacement: "Displacement from rest" }[name];
    return { values: painted(fields[name](), range, MODES[state.mode].stops), range, words: words ?? MODES[state.mode].word };
  }

  function storedWords(stops) {
    const there = facts.states.filter(({ tasks }) => tasks.length > 0).map(({ design }) => design);
    if (there.length === 0) return "No inflated shapes are stored in this run: designs are shown at rest.";
    const which = there.length > 1 ? `designs ${there.slice(0, -1).join(", ")} and ${there.at(-1)}` : `design ${there[0]}`;
    if (state.task && stops.length === 0) return `Shown at rest: inflated shapes are stored for ${which} alone.`;
    if (stops.length > 0 && stops.length < 4) return `Stored are the shapes at ${stops.length === 1 ? "the whole pressures alone" : `${stops.length} pressures`}; nothing is drawn between them.`;
    return "";
  }

  function shownWords(entry, stop, whole) {
    if (!stop) return `design ${entry.iteration} at rest`;
    if (!whole) return `design ${entry.iteration} at ${pressureWords(stop)}`;
    const motion = entry.motions[state.task];
    return `${motion.word}: ${motion.text} at ${motion.at}`;
  }

  byId("task").append(...facts.tasks.map(({ name }) => element("option", { value: name }, facts.tasks.length > 1 ? `inflated: ${name}` : "inflated")));
  byId("task").value = state.task;
  byId("task").addEventListener("change", (event) => choose({ task: event.target.value }));
  byId("mode").append(...Object.entries(MODES).map(([key, { option }]) => element("option", { value: key }, option)));
  byId("mode").value = state.mode;
  byId("mode").addEventListener("change", (event) => choose({ mode: event.target.value }));
  for (const name of ["ghost", "marks"]) byId(name).addEventListener("change", show);
  describe(facts, shapes, state);
  cutting(facts, shapes, view);
  keys(designs, pressures);
  show();
  document.body.dataset.ready = "yes";
}

function makeView(facts, shapes) {
  const last = facts.history.length - 1;
  const moved = facts.tasks.flatMap(({ name }) => [0, last].flatMap((design) => shapes.stops(design, name).slice(-1).map((stop) => shapes.moved(design, stop))));
  const points = [shapes.atRest(0), shapes.atRest(last), ...moved].flatMap(({ positions }) => thinned(positions));
  for (const { target } of facts.tasks) points.push(...(target?.line ?? []).flat(), ...(target?.place ?? []));
  // The clamp too.
  const wide = 1.3 * facts.radius;
  for (const x of [-wide, wide]) for (const y of [-wide, wide]) points.push(x, y, -0.03 * facts.length);
  try {
    const view = new View(byId("view"), facts, points);
    byId("reset").addEventListener("click", () => view.reset());
    byId("picture").addEventListener("click", () => {
      byId("view").querySelector("canvas").toBlob((picture) => save(`${facts.directory}.png`, picture, "image/png"));
    });
    return view;
  } catch (error) {
    byId("no-view").hidden = false;
    byId("no-view").textContent = `This browser cannot draw in three dimensions (${error.message}); the numbers are below.`;
    return null;
  }
}

// The ends of the colours, the same for all designs.
function rangesOf(facts, shapes) {
  const last = facts.history.length - 1;
  const stops = facts.tasks.flatMap(({ name }) => shapes.stops(last, name).slice(-1).map((stop) => shapes.moved(last, stop)));
  const most = (read, least) => stops.reduce((high, shape) => Math.max(high, read(shape)), least);
  const wall = facts.limits.find(({ key }) => key === "wall_mm")?.bound ?? 1;
  const change = shapes.displacement(shapes.atRest(last));
  let thick;
  return {
    // When it is asked for: distances take a moment.
    get thickness() {
      thick ??= [0, last].map((design) => quantile(shapes.thickness(shapes.atRest(design), THICK * wall), 0.8));
      return [wall, Math.max(...thick, 1.1 * wall)];
    },
    stretch: [1, most((shape) => quantile(shape.stretch, 0.998), 1.01)],
    displacement: [0, most((shape) => quantile(shapes.displacement(shape), 1), 1e-6)],
    change: [0, Math.max(quantile(change, 0.998), 1e-6)],
    plain: [0, 1],
    wall,
  };
}

function pressureWords({ pressures }) {
  const all = Object.entries(pressures);
  const words = all.slice(0, 4).map(([name, value]) => `${all.length > 1 ? `${name} ` : ""}${short(1e3 * value, 3)}`);
  return `${words.join(", ")}${all.length > 4 ? ", …" : ""} kPa`;
}

function cutting(facts, shapes, view) {
  const [axis, at, flip] = ["cut-axis", "cut-at", "cut-flip"].map(byId);
  const { normal, offset } = facts.view;
  axis.value = ["x", "y", "z"][normal.findIndex((part) => Math.abs(part) > 0.5)];
  const sign = normal.find((part) => Math.abs(part) > 0.5);
  flip.checked = sign < 0;
  const bounds = view ? [0, 1, 2].map((k) => extremes(view.points, k)) : [];
  const range = () => {
    const [low, high] = bounds["xyz".indexOf(axis.value)] ?? [0, 1];
    Object.assign(at, { min: low.toFixed(2), max: high.toFixed(2) });
  };
  const cut = () => {
    byId("cut-shown").textContent = axis.value ? `${axis.value} = ${short(Number(at.value), 3)} mm` : "off";
    at.disabled = flip.disabled = !axis.value;
    if (!view) return;
    if (!axis.value) return view.cut(null);
    const way = flip.checked ? -1 : 1;
    view.cut({ normal: AXES[axis.value].map((part) => way * part), offset: way * Number(at.value) });
  };
  axis.addEventListener("change", () => {
    range();
    at.value = axis.value === "z" ? facts.length / 2 : 0;
    // Keep the half behind the plane, so that its cut face is seen.
    if (view && axis.value) flip.checked = view.isBefore(AXES[axis.value]);
    cut();
  });
  for (const input of [at, flip]) input.addEventListener("input", cut);
  range();
  at.value = sign * offset;
  cut();
}

function describe(facts, shapes, state) {
  const { result, history } = facts;
  byId("title").textContent = facts.title;
  const motions = facts.tasks.map(({ name }) => {
    const [start, end] = [history[0].motions[name], history.at(-1).motions[name]];
    return element("li", {}, element("span", {}, facts.tasks.length > 1 ? `${name}: ${end.word}` : end.word), element("b", {}, end.text), element("small", {}, `from ${start.text}, at ${end.at}`));
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
    : facts.files.length ? "The CAD is what pneumorph make last wrote." : "Exact CAD (STEP) is added here once pneumorph make has written it and pneumorph report is called again.";
}

function keys(designs, pressures) {
  const acts = { "[": () => designs.step(-1), "]": () => designs.step(1), ",": () => pressures.step(-1), ".": () => pressures.step(1), p: () => designs.toggle(), i: () => pressures.toggle() };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input:not([type=range])")) return;
    acts[event.key]?.();
  });
}

function thinned(positions) {
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 1500));
  const found = [];
  for (let i = 0; i < positions.length; i += step) found.push(positions[i], positions[i + 1], positions[i + 2]);
  return found;
}

function extremes(points, axis) {
  const values = points.filter((_, i) => i % 3 === axis);
  return [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
}

// Where the body lies, look at it from the side on which its base is on the left.
function baseOnTheLeft({ gravity, view }) {
  if (!gravity) return;
  const [[a, b], [u, v]] = [view.normal, gravity];
  if (b * u - a * v >= 0) return;
  view.normal = view.normal.map((part) => -part);
  view.offset = -view.offset;
}

function radiusOf(positions) {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) most = Math.max(most, Math.hypot(positions[i], positions[i + 1]));
  return most;
}

begin().catch((error) => {
  byId("no-view").hidden = false;
  byId("no-view").textContent = `This page could not be read (${error.message}); a browser of 2023 or later is needed.`;
  throw error;
});
