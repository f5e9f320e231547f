// The diagrams of a run: what its tasks come to, every limit with its bound, designed pressures, and what it cost.
import { element } from "./elements.js";
import { short } from "./numbers.js";
import { Plot } from "./plot.js";

export const COLOURS = ["#2f74b5", "#d07a2d", "#3f9160", "#8a5a9e", "#b0496b", "#7d7a2f", "#3aa0a8", "#666f7a"];
const PHASES = { geometry: "mesh", equilibrium: "equilibrium", gradient: "gradient", subproblem: "sub-problem" };
const UNITS = { "°": "degrees" };

export function historyPlots(facts, place, chosen) {
  return plotCards(plotsOf(facts), facts.history.map((entry) => entry.iteration), place, chosen);
}

// Diagrams over these designs in place of those that were there; what it returns marks a design in all.
export function plotCards(plots, designs, place, chosen) {
  place.replaceChildren();
  const cards = plots.map((asked) => {
    const plot = new Plot({ ...asked, designs }, chosen);
    const reading = element("output");
    const legend = element("p", { class: "legend-line" });
    for (const { name, colour } of asked.named || asked.lines.length > 1 ? asked.lines : []) {
      const swatch = element("i");
      swatch.style.background = colour;
      legend.append(element("span", {}, swatch, name));
    }
    const head = element("figcaption", {}, element("b", {}, asked.title), reading);
    place.append(element("figure", { class: "card plot" }, head, plot.svg, legend));
    return { plot, reading, asked };
  });
  return (design) => {
    for (const { plot, reading, asked } of cards) {
      plot.mark(design);
      reading.textContent = readingOf(asked, design);
    }
  };
}

function readingOf({ lines, unit, bound, bars }, design) {
  const values = lines.map((line) => line.values[design]);
  const shown = bars ? [values.reduce((sum, value) => sum + (value ?? 0), 0)] : values;
  const text = shown.slice(0, 3).map((value) => short(value)).join(" · ") + (shown.length > 3 ? " …" : "");
  const fine = lines.length === 1 ? lines[0].fine?.[design] : undefined;
  const error = Number.isFinite(fine) ? ` ± ${short(Math.abs(fine - values[0]))}` : "";
  const limit = bound ? ` (${bound.atLeast ? "≥" : "≤"} ${short(bound.value)})` : "";
  return `${text}${error}${unit ? ` ${unit}` : ""}${limit}`;
}

function plotsOf(facts) {
  const { history } = facts;
  const line = (name, number, read) => ({ name, colour: COLOURS[number % COLOURS.length], values: history.map(read) });
  const plots = [{ title: "Objective", unit: "", lines: [line("objective", 0, (entry) => entry.objective)] }];
  const units = [...new Set(facts.tasks.map((task) => history[0].motions[task.name].unit))];
  for (const unit of units) {
    const tasks = facts.tasks.filter((task) => history[0].motions[task.name].unit === unit);
    const words = [...new Set(tasks.map((task) => history[0].motions[task.name].word))];
    plots.push({
      title: capital(words.length === 1 ? words[0] : "tasks"),
      unit: UNITS[unit] ?? unit,
      lines: tasks.map((task, number) => ({
        ...line(task.name, number, (entry) => entry.motions[task.name].value),
        fine: history.map((entry) => entry.motions[task.name].fine),
      })),
    });
  }
  for (const { key, word, unit, bound, at_least: atLeast } of facts.limits) {
    plots.push({ title: `Limit: ${word}`, unit, bound: { value: bound, atLeast }, lines: [line(word, 0, (entry) => entry.limits[key])] });
  }
  const pressures = facts.tasks.flatMap((task) =>
    Object.keys(history[0].tasks[task.name].pressure_MPa).map((chamber) => [task.name, chamber]),
  );
  const lines = pressures.map(([task, chamber], number) =>
    line(facts.tasks.length > 1 ? `${task} ${chamber}` : chamber, number, (entry) => 1e3 * entry.tasks[task].pressure_MPa[chamber]),
  );
  const designed = lines.filter(({ values }) => values.some((value) => Math.abs(value - values[0]) > 1e-9));
  if (designed.length > 0) plots.push({ title: "Designed pressures", unit: "kPa", lines: designed });
  plots.push({
    title: "Cost of a design",
    unit: "s",
    bars: true,
    lines: Object.entries(PHASES).map(([key, name], number) => ({ ...line(name, number, (entry) => entry.seconds[key]) })),
  });
  return plots;
}

export const capital = (words) => words.charAt(0).toUpperCase() + words.slice(1);
