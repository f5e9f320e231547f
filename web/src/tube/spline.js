// Cubic B-splines as in src/pneumorph/geometry/bspline.py: periodic around a tube (q), clamped along it (r).

// The four functions that are not zero at each parameter: their numbers and values, four to a parameter.
export function periodicRows(count, parameters) {
  const numbers = new Int32Array(4 * parameters.length);
  const values = new Float64Array(4 * parameters.length);
  parameters.forEach((t, place) => {
    const along = (t - Math.floor(t)) * count;
    const span = Math.min(Math.floor(along), count - 1);
    const x = along - span;
    const y = 1 - x;
    values.set([y ** 3, 3 * x ** 3 - 6 * x ** 2 + 4, 3 * y ** 3 - 6 * y ** 2 + 4, x ** 3].map((v) => v / 6), 4 * place);
    for (let k = 0; k < 4; k++) numbers[4 * place + k] = (span - 1 + k + count) % count;
  });
  return { numbers, values };
}

export function clampedRows(count, parameters) {
  const spans = count - 3;
  const knot = (i) => Math.min(Math.max(i - 3, 0), spans);
  const numbers = new Int32Array(4 * parameters.length);
  const values = new Float64Array(4 * parameters.length);
  parameters.forEach((t, place) => {
    const along = Math.min(Math.max(t, 0), 1) * spans;
    const span = Math.min(Math.floor(along), spans - 1) + 3;
    // Cox and de Boor's recurrence, degree by degree.
    const found = [1, 0, 0, 0];
    for (let degree = 1; degree <= 3; degree++) {
      let kept = 0;
      for (let k = 0; k < degree; k++) {
        const right = knot(span + k + 1);
        const part = found[k] / (right - knot(span + k + 1 - degree));
        found[k] = kept + (right - along) * part;
        kept = (along - knot(span + k + 1 - degree)) * part;
      }
      found[degree] = kept;
    }
    values.set(found, 4 * place);
    for (let k = 0; k < 4; k++) numbers[4 * place + k] = span - 3 + k;
  });
  return { numbers, values };
}

// Points on the tensor grid of r and q, row by row (r, then q), three numbers to each.
export function sampled(net, columns, rowsR, rowsQ) {
  const across = rowsQ.values.length / 4;
  const along = rowsR.values.length / 4;
  const rows = net.length / (3 * columns);
  const lines = combined(net, rows, 3 * columns, across, rowsQ);
  const points = new Float64Array(3 * along * across);
  for (let r = 0; r < along; r++) {
    for (let k = 0; k < 4; k++) {
      const value = rowsR.values[4 * r + k];
      const from = 3 * across * rowsR.numbers[4 * r + k];
      for (let i = 0; i < 3 * across; i++) points[3 * across * r + i] += value * lines[from + i];
    }
  }
  return points;
}

// Every row of control points combined to points at the parameters q.
function combined(net, rows, stride, across, rowsQ) {
  const lines = new Float64Array(3 * rows * across);
  for (let row = 0; row < rows; row++) {
    for (let q = 0; q < across; q++) {
      const to = 3 * (row * across + q);
      for (let k = 0; k < 4; k++) {
        const value = rowsQ.values[4 * q + k];
        const from = row * stride + 3 * rowsQ.numbers[4 * q + k];
        for (let axis = 0; axis < 3; axis++) lines[to + axis] += value * net[from + axis];
      }
    }
  }
  return lines;
}
