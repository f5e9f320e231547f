// Colours of the fields on the surfaces, and the scale beside them.

const STRETCH = ["#cdd8e2", "#f5e6a8", "#f4a24e", "#d6321f", "#7a0403"];
const THICKNESS = ["#b2182b", "#ef8a62", "#f3dcc8", "#a6cbe0", "#2c6da8"];
export const DISPLACEMENT = ["#46327e", "#365c8d", "#277f8e", "#4ac16d", "#fde725"];
// Pale as long as half of a limit is left.
const LIMITS = ["#dfe5ea", "#d5dfe6", "#c7d8e0", "#b7d0d6", "#a8c8c4", "#cfd18c", "#f0c24f", "#ea7f2d", "#a3160f"];
// From less motion to more.
const RUBBER = ["#2166ac", "#92c5de", "#f0f0f0", "#f4a582", "#b2182b"];
export const PLAIN = "#b9c6d2";

const linear = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
const parts = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

// What can be shown: its name, its unit, and its colours from low to high.
export const MODES = {
  thickness: { option: "wall thickness", word: "Wall thickness", unit: "mm", stops: THICKNESS },
  limits: { option: "nearest limit", word: "Share of the nearest limit", unit: "%", stops: LIMITS },
  stretch: { option: "stretch", word: "Largest principal stretch", unit: "", stops: STRETCH },
  displacement: { option: "displacement", word: "Displacement", unit: "mm", stops: DISPLACEMENT },
  rubber: { option: "added rubber", word: "More rubber: not stored for this design", unit: "", stops: RUBBER },
  plain: { option: "none", word: "Plain", unit: "", stops: [PLAIN, PLAIN] },
};

// Vertex colours in linear light, three numbers to each value.
export function painted(values, [low, high], stops) {
  const table = stops.map(parts);
  const colours = new Float32Array(3 * values.length);
  values.forEach((value, place) => {
    const along = Math.min(Math.max((value - low) / (high - low || 1), 0), 1) * (table.length - 1);
    const stop = Math.min(Math.floor(along), table.length - 2);
    for (let k = 0; k < 3; k++) {
      const mixed = table[stop][k] + (along - stop) * (table[stop + 1][k] - table[stop][k]);
      colours[3 * place + k] = linear(mixed);
    }
  });
  return colours;
}

// The value below which this part of all values lies, so that a single corner does not pale all the rest.
export function quantile(values, part) {
  const sorted = Float32Array.from(values).sort();
  return sorted[Math.min(Math.floor(part * sorted.length), sorted.length - 1)];
}

export function showLegend(place, mode, [low, high], words) {
  const { unit, stops } = MODES[mode];
  place.hidden = mode === "plain";
  place.querySelector(".bar").style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  place.querySelector(".words").textContent = unit ? `${words}, ${unit}` : words;
  const digits = high - low < 1 ? 3 : high - low < 20 ? 2 : high - low < 100 ? 1 : 0;
  const ticks = [low, (low + high) / 2, high].map((value) => value.toFixed(digits));
  place.querySelectorAll(".ticks span").forEach((tick, number) => (tick.textContent = ticks[number]));
}
