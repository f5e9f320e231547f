// Numbers as people read them, and scales for them.

export function short(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(digits - 2).replace("-", "−").replace("e−", "e-");
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

// A largest error, with two digits; one of less than a thousandth is no more than that.
export const atMost = (error) => short(Math.max(error, 1e-3), 2);

// Round numbers from low to high, about `count` of them.
export function ticks(low, high, count = 4) {
  const span = high - low || 1;
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((size) => span / size <= count);
  const found = [];
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * span; value += step) {
    found.push(Number(value.toPrecision(12)));
  }
  return found;
}
