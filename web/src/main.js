// Begins the page: a run in its block, or, where it is served, the runs that the server has.
import { byId } from "./elements.js";
import { unpack } from "./packed.js";
import { RunPage } from "./page.js";
import { served } from "./served.js";

async function begin() {
  const block = byId("block").textContent.trim();
  const packed = block ? await unpack(block) : null;
  const page = new RunPage();
  if (packed) page.load(packed);
  else await served(page);
  document.body.dataset.ready = "yes";
}

begin().catch((error) => {
  byId("no-view").hidden = false;
  byId("no-view").textContent = `This page could not be read (${error.message}); a browser of 2023 or later is needed.`;
  throw error;
});
