// Prints the points of the body that the page draws by the fast model of the block in a file, at pressures in kPa.
import { readFileSync } from "node:fs";
import { Driven } from "../../web/src/driven.js";
import { unpack } from "../../web/src/packed.js";
import { Shapes } from "../../web/src/shapes.js";

const shapes = new Shapes(await unpack(readFileSync(process.argv[2]).toString("base64")));
const { shape, tip, inside } = new Driven(shapes.facts, shapes).at(JSON.parse(process.argv[3]));
console.log(JSON.stringify({ rest: Array.from(shape.rest), positions: Array.from(shape.positions), stretch: Array.from(shape.stretch), tip, inside }));
