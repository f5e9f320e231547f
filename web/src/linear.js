// Small systems of linear equations, by elimination with pivots, and eigenvalues, by rotations.

export function solved(matrix, right) {
  const rows = matrix.map((row, k) => [...row, right[k]]);
  const count = rows.length;
  for (let k = 0; k < count; k++) {
    let pivot = k;
    for (let i = k + 1; i < count; i++) if (Math.abs(rows[i][k]) > Math.abs(rows[pivot][k])) pivot = i;
    [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
    for (let i = k + 1; i < count; i++) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= count; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  const found = new Array(count).fill(0);
  for (let k = count - 1; k >= 0; k--) {
    let rest = rows[k][count];
    for (let j = k + 1; j < count; j++) rest -= rows[k][j] * found[j];
    found[k] = rest / rows[k][k];
  }
  return found;
}

// The eigenvalues of a symmetric matrix, least first, by Jacobi's method.
export function eigenvalues(matrix) {
  const a = matrix.map((row) => row.slice());
  const count = a.length;
  const size = Math.hypot(...a.flat());
  for (let sweep = 0; sweep < 30; sweep++) {
    for (let p = 0; p < count; p++) {
      for (let q = p + 1; q < count; q++) {
        if (Math.abs(a[p][q]) <= 1e-16 * size) continue;
        const half = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const tangent = Math.sign(half || 1) / (Math.abs(half) + Math.hypot(half, 1));
        const c = 1 / Math.hypot(tangent, 1);
        const s = tangent * c;
        for (let k = 0; k < count; k++) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
        for (let k = 0; k < count; k++) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
      }
    }
  }
  return a.map((row, k) => row[k]).sort((one, other) => one - other);
}
