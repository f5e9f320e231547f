// The page where a server has runs for it: it looks every second whether there is more of them.
import * as server from "./client.js";
import { Comparison } from "./compare.js";
import { byId, element } from "./elements.js";
import { Explorer } from "./explore.js";

const EVERY = 1000; // milliseconds

export async function served(page) {
  page.explorable = true;
  const runs = []; // { name, title, stamp, packed }
  let chosen = 0;
  const explorer = new Explorer(page, () => chosen);
  const comparison = new Comparison(page, (number) => choose(number));
  page.shown = () => {
    explorer.follow();
    comparison.follow();
  };
  if (page.view) page.view.drawn = () => comparison.turn();

  function choose(number) {
    chosen = number;
    if (runs[number].packed) page.load(runs[number].packed);
    mark();
  }

  function mark() {
    const { name, title, packed } = runs[chosen];
    const tabs = runs.map((each, number) => {
      const tab = element("button", { type: "button", "aria-pressed": String(number === chosen), title: each.title }, each.name);
      tab.addEventListener("click", () => choose(number));
      return tab;
    });
    byId("runs").hidden = runs.length < 2;
    // Not while one of them has the focus, which it would lose.
    if (!byId("runs").contains(document.activeElement)) byId("runs").replaceChildren(...tabs);
    byId("runs").querySelectorAll("button").forEach((tab, number) => tab.setAttribute("aria-pressed", String(number === chosen)));
    document.title = title;
    document.body.classList.toggle("waiting", !packed);
    if (!packed) byId("title").textContent = title;
    const ended = packed?.facts.result;
    say(!packed ? `${name}: no design is finished yet; it will appear here.` : ended ? "" : "Live: new designs appear here.", !ended);
  }

  // Take in what is new; whether anything is.
  async function look() {
    const found = await server.runs();
    let news = false;
    for (const [number, { name, title, stamp }] of found.entries()) {
      runs[number] ??= { packed: null };
      const before = runs[number];
      if (before.stamp === stamp && before.name) continue;
      news = true;
      const packed = stamp === null ? null : await server.run(number);
      const same = Boolean(before.packed);
      Object.assign(before, { name, title, stamp, packed: packed ?? before.packed });
      if (packed && number === chosen) page.load(packed, same);
    }
    if (news) {
      comparison.load(runs, chosen);
      mark();
    }
  }

  async function watch() {
    try {
      await look();
      if (byId("live").classList.contains("broken")) mark();
    } catch (error) {
      say(error instanceof TypeError ? "The server cannot be reached any more; the page shows its last state." : error.message, false, true);
    }
    setTimeout(watch, EVERY);
  }

  await look();
  setTimeout(watch, EVERY);
}

function say(words, live, broken = false) {
  byId("live").hidden = !words;
  byId("live").textContent = words;
  byId("live").className = broken ? "live broken" : live ? "live going" : "live";
}
