// A surface of any kind as it is stored: the same triangles in every design, and the places of their vertices.
export class Triangles {
  constructor({ count, index }) {
    Object.assign(this, { count, index });
  }

  // Write the vertices from a place on.
  put(vertices, points, place) {
    points.set(vertices, place);
  }

  // Values are stored for the vertices themselves.
  spread({ values }, nearest, into, first) {
    into.set(values, first);
  }
}
