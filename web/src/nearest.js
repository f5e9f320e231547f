// Pressures by chamber in kPa: which are the same, and which are nearest.

export const keyOf = (pressures) => Object.keys(pressures).sort().map((name) => `${name} ${pressures[name].toFixed(3)}`).join(", ");

const distance = (one, other) => Math.hypot(...Object.keys(one).map((name) => one[name] - (other[name] ?? 0)));

// Of known pressures those nearest to the ones that are wanted; null without any.
export function nearest(known, wanted) {
  return known.reduce((best, each) => (best === null || distance(each, wanted) < distance(best, wanted) ? each : best), null);
}

// Steps of a slider from least to most: about two hundred, each 1, 2 or 5 times a power of ten.
export function stepOf(least, most) {
  const rough = (most - least) / 200;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= rough * (1 - 1e-9));
}
