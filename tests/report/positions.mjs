// Prints the points of the first design's surfaces as the page has them, of the block in a file.
import { readFileSync } from "node:fs";
import { unpack } from "../../web/src/packed.js";
import { Shapes } from "../../web/src/shapes.js";

const shapes = new Shapes(await unpack(readFileSync(process.argv[2]).toString("base64")));
console.log(JSON.stringify(Array.from(shapes.atRest(0).positions)));
