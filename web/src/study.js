// The page of a study: its members in a table that is sorted and filtered, and their bodies side by side in its order.
import { Comparison } from "./compare.js";
import { byId, element } from "./elements.js";
import { short } from "./numbers.js";

export function study(page, blocks) {
  const runs = blocks.map((packed) => ({ name: packed.facts.member.name, packed }));
  const { title, without } = blocks[0].facts.member;
  let chosen = 0;
  const comparison = new Comparison(page, choose);
  page.shown = () => comparison.follow();
  if (page.view) page.view.drawn = () => comparison.turn();
  // The members first; what is said of one of them, above its picture.
  const stage = document.querySelector(".stage");
  const heading = element("h2");
  stage.before(byId("comparison"), heading, byId("headline"), byId("reason"), byId("warnings"));
  show();
  comparison.load(runs, chosen);
  byId("comparison").hidden = false;
  byId("eyebrow").textContent = `pneumorph · a study of ${runs.length} runs`;
  byId("comparison-title").textContent = "Runs of the study, side by side";
  byId("without").textContent = without.join(" ");
  byId("members").hidden = false;
  byId("compared").closest(".card").hidden = true;

  const { heads, rows } = memberTable(blocks.map(({ facts }) => facts));
  const state = { by: 0, down: false };
  const lines = rows.map((cells, number) => {
    const name = element("button", { type: "button" }, cells[0].text);
    const line = element("tr", {}, element("th", { scope: "row" }, name), ...cells.slice(1).map(({ text }) => element("td", {}, text)));
    line.addEventListener("click", () => choose(number));
    return line;
  });
  const columns = heads.map((head, place) => {
    const button = element("button", { type: "button" }, head);
    button.addEventListener("click", () => {
      Object.assign(state, { by: place, down: state.by === place && !state.down });
      arrange();
    });
    return element("th", { scope: "col" }, button);
  });
  byId("member-table").replaceChildren(element("thead", {}, element("tr", {}, ...columns)), element("tbody", {}, ...lines));
  byId("filter").addEventListener("input", arrange);
  arrange();

  function choose(number) {
    chosen = number;
    show();
    mark();
    heading.scrollIntoView({ block: "start" });
  }

  function show() {
    const { name, packed } = runs[chosen];
    page.load(packed);
    heading.textContent = `Run ${name}`;
    byId("title").textContent = document.title = title;
  }

  function mark() {
    lines.forEach((line, number) => line.classList.toggle("chosen", number === chosen));
  }

  // Put rows and bodies in the order asked for, and leave out those that do not have the words.
  function arrange() {
    const order = sorted(rows, state.by, state.down);
    const kept = order.filter((number) => fits(rows[number], byId("filter").value));
    byId("member-table").querySelector("tbody").replaceChildren(...kept.map((number) => lines[number]));
    columns.forEach((column, place) => column.setAttribute("aria-sort", place !== state.by ? "none" : state.down ? "descending" : "ascending"));
    byId("filtered").textContent = `${kept.length} of ${rows.length}`;
    comparison.arrange(kept);
    mark();
  }
}

// The heads of the table and a row for every member; a cell has its text and the value by which it is sorted.
export function memberTable(members) {
  const keys = [...new Set(members.flatMap(({ member }) => Object.keys(member.changes)))];
  const tasks = [...new Set(members.flatMap((facts) => facts.tasks.map(({ name }) => name)))];
  const number = (value, text = short(value)) => ({ text, value });
  // Tasks of one word and unit in all members: these are in the head, and the cells are numbers.
  const kinds = (name) => new Set(members.map(({ history }) => history.at(-1).motions[name]).filter(Boolean).map(({ word, unit }) => (unit ? `${word}, ${unit}` : word)));
  const alike = new Map(tasks.map((name) => [name, [...kinds(name)]]).filter(([, own]) => own.length === 1).map(([name, [own]]) => [name, own]));
  const rows = members.map((facts) => {
    const last = facts.history.at(-1);
    const motion = (name) => last.motions[name];
    const seconds = facts.history.reduce((sum, { seconds: spent }) => sum + (spent.total ?? 0), 0);
    return [
      { text: facts.member.name, value: facts.member.name },
      ...keys.map((key) => ({ text: facts.member.changes[key] ?? "–", value: quantity(facts.member.changes[key]) })),
      ...tasks.map((name) => {
        if (!motion(name)) return { text: "–", value: null };
        const { value, unit, word, found, text } = motion(name);
        return number(value, alike.has(name) ? found.replace(unit, "").trim() : `${word} ${text}`);
      }),
      number(last.objective, short(last.objective, 5)),
      number(last.held ? 0 : 1, last.held ? "satisfied" : "violated"),
      number(last.iteration, String(last.iteration)),
      number(seconds, String(Math.round(seconds))),
      { text: facts.result ? (facts.result.completed ? "finished" : "failed") : "begun", value: facts.result?.reason ?? "" },
    ];
  });
  const heads = ["run", ...named(keys), ...tasks.map((name) => (alike.has(name) ? `${name}: ${alike.get(name)}` : name)), "objective", "limits", "designs", "time, s", "state"];
  return { heads, rows };
}

// "60 kPa" is sorted as 60, other text as text.
function quantity(text) {
  const found = Number.parseFloat(text);
  return Number.isFinite(found) ? found : (text ?? null);
}

// Numbers of rows in the order of a column; rows without a value come last, equal ones stay in their order.
export function sorted(rows, column, down) {
  const sign = down ? -1 : 1;
  const order = (one, other) => {
    const [a, b] = [rows[one][column].value, rows[other][column].value];
    if (a === null || b === null) return (a === null) - (b === null);
    if (typeof a === "number" && typeof b === "number") return sign * (a - b);
    return sign * String(a).localeCompare(String(b), "en", { numeric: true });
  };
  return rows.map((_, number) => number).sort(order);
}

// Whether a row has every word, in whatever cells.
export function fits(cells, words) {
  const all = cells.map(({ text }) => text).join(" ").toLowerCase();
  return words.toLowerCase().split(/\s+/).every((word) => all.includes(word));
}

// The last part of each key as words, and as many of the parts before it as tell keys apart: "body radius", "chamber[0] radius".
export function named(keys) {
  const ends = (key, count) => key.split(".").slice(-count).join(" ").replaceAll("_", " ");
  const most = Math.max(1, ...keys.map((key) => key.split(".").length));
  const counts = Array.from({ length: most }, (_, index) => index + 1);
  return keys.map((key) => ends(key, counts.find((count) => keys.every((other) => other === key || ends(other, count) !== ends(key, count))) ?? most));
}
