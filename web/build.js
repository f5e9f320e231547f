// Builds the page without a run for the Python package; with --check, says whether the committed one is the same.
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const bundled = async (entry) => {
  const options = { bundle: true, minify: true, write: false, legalComments: "none", target: "es2022", charset: "utf8" };
  const { outputFiles } = await build({ entryPoints: [here(entry)], ...options });
  return outputFiles[0].text.trim();
};
const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

const [script, style] = [await bundled("src/main.js"), await bundled("src/style.css")];
// Only this script and this style, and no network.
const policy = `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data: blob:; base-uri 'none'; form-action 'none'`;
const parts = { policy, style, script };
const page = readFileSync(here("src/page.html"), "utf8").replace(/\{\{(policy|style|script)\}\}/g, (_, name) => parts[name]);
const licence = readFileSync(here("node_modules/three/LICENSE"), "utf8");
const built = { "report.html": page, "three.LICENSE": `three.js is part of report.html.\n\n${licence}` };

const folder = here("../src/pneumorph/output/page");
if (process.argv.includes("--check")) {
  const stale = Object.entries(built).filter(([name, text]) => readFileSync(`${folder}/${name}`, "utf8") !== text);
  if (stale.length > 0) {
    console.error(`src/pneumorph/output/page: ${stale.map(([name]) => name).join(", ")} is not what web/ builds; run npm run build in web/`);
    process.exit(1);
  }
} else {
  mkdirSync(folder, { recursive: true });
  for (const [name, text] of Object.entries(built)) writeFileSync(`${folder}/${name}`, text);
}
console.log(Object.entries(built).map(([name, text]) => `${name} ${(text.length / 1e3).toFixed(0)} kB`).join(", "));
