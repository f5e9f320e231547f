// A tube in a tube, as the page has bodies.

export function ring(radius, rows, columns, low, high, sense) {
  const net = [];
  // So that the spline, not its control polygon, has the radius.
  const out = radius / ((2 + Math.cos((2 * Math.PI) / columns)) / 3);
  for (let row = 0; row < rows; row++) {
    const along = greville(row, rows);
    for (let column = 0; column < columns; column++) {
      const angle = (sense * 2 * Math.PI * column) / columns;
      net.push(out * Math.cos(angle), out * Math.sin(angle), low + along * (high - low));
    }
  }
  return Float64Array.from(net);
}

export const surfaces = [
  { kind: "tube", rows: 9, columns: 32, ends: ["flat", "flat"] },
  { kind: "tube", rows: 8, columns: 24, ends: ["flat", "flat"] },
];
export const nets = [ring(10, 9, 32, 0, 40, 1), ring(6, 8, 24, 5, 35, -1)];

function greville(row, rows) {
  const knot = (i) => Math.min(Math.max(i - 3, 0), rows - 3) / (rows - 3);
  return (knot(row + 1) + knot(row + 2) + knot(row + 3)) / 3;
}
