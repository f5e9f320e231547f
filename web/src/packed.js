// The block that src/pneumorph/output/packed.py writes: gzip of a JSON head and arrays of whole steps.

import { parsed } from "./named.js";

export class Packed {
  constructor(head, content, begin) {
    this.facts = head.facts;
    this.described = head.arrays;
    this.content = content;
    this.begin = begin;
  }

  has(name) {
    return Object.hasOwn(this.described, name);
  }

  shape(name) {
    return this.described[name].shape;
  }

  // The numbers of an array in one flat Float64Array.
  array(name) {
    const { at, shape, step, width, differences } = this.described[name];
    const count = shape.reduce((product, size) => product * size, 1);
    const whole = joined(this.content, this.begin + at, count, width);
    if (differences) {
      const row = count / shape[0] || 1;
      for (let i = row; i < count; i++) whole[i] += whole[i - row];
    }
    return Float64Array.from(whole, (value) => step * value);
  }
}

export const unpack = (base64) => unpackBytes(Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)));

export async function unpackBytes(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const content = new Uint8Array(await new Response(stream).arrayBuffer());
  const begin = 4 + new DataView(content.buffer).getUint32(0, true);
  const head = parsed(new TextDecoder().decode(content.subarray(4, begin)));
  return new Packed(head, content, begin);
}

// Numbers of 1, 2 or 4 bytes, whose bytes of the same weight stand together.
function joined(content, at, count, width) {
  const numbers = new Int32Array(count);
  const unused = 32 - 8 * width;
  for (let i = 0; i < count; i++) {
    let number = 0;
    for (let byte = 0; byte < width; byte++) number |= content[at + byte * count + i] << (8 * byte);
    numbers[i] = (number << unused) >> unused;
  }
  return numbers;
}
