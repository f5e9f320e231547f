// Begins the page: a run in its block, or the members of a study, or, where it is served, the runs that the server has.
import { byId } from "./elements.js";
import { Explorer } from "./explore.js";
import { unpack } from "./packed.js";
import { RunPage } from "./page.js";
import { served } from "./served.js";
import { study } from "./study.js";

async function begin() {
  // One to each run; a page of a study has several.
  const blocks = byId("block").textContent.trim().split(/\s+/).filter(Boolean);
  const packed = await Promise.all(blocks.map(unpack));
  const page = new RunPage();
  if (packed.length === 0) await served(page);
  else if (packed[0].facts.member) study(page, packed);
  else {
    const explorer = new Explorer(page);
    page.shown = () => explorer.follow();
    page.load(packed[0]);
  }
  document.body.dataset.ready = "yes";
}

begin().catch((error) => {
  byId("no-view").hidden = false;
  byId("no-view").textContent = `This page could not be read (${error.message}); a browser of 2023 or later is needed.`;
  throw error;
});
