// The solution of a small system of linear equations, by elimination with pivots.

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
