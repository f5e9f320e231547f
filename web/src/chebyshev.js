// Products of Chebyshev's polynomials: the row k of an index has the degree of each in its variable.

// T_0 … T_n and their derivatives at x.
function table(x, highest) {
  const [values, slopes] = [[1, x], [0, 1]];
  // T_n' = n U_{n-1}, by U_k = 2x U_{k-1} − U_{k-2}.
  let [before, second] = [1, 2 * x];
  for (let n = 2; n <= highest; n++) {
    values.push(2 * x * values[n - 1] - values[n - 2]);
    slopes.push(n * second);
    [before, second] = [second, 2 * x * second - before];
  }
  return { values, slopes };
}

const tables = (x, index) => x.map((value, c) => table(value, index.reduce((most, row) => Math.max(most, row[c]), 1)));

// The products at x, from -1 to 1.
export function basisOf(x, index) {
  const all = tables(x, index);
  return index.map((row) => row.reduce((product, degree, c) => product * all[c].values[degree], 1));
}

// Their derivatives, one array to a variable.
export function gradientOf(x, index) {
  const all = tables(x, index);
  return x.map((_, by) => index.map((row) => row.reduce((product, degree, c) => product * all[c][c === by ? "slopes" : "values"][degree], 1)));
}
