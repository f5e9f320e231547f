// Files made of what is in the page.
import { element } from "./elements.js";

export function netsAsCsv(shapes, designs) {
  const lines = ["design,surface,row,column,x_mm,y_mm,z_mm"];
  for (const design of designs) {
    const { iteration } = shapes.facts.history[design];
    for (const surface of shapes.surfaces) {
      const net = shapes.points(surface, design);
      const name = quoted(surface.cavity ? `chamber_${surface.name}` : "exterior");
      for (let point = 0; point < net.length / 3; point++) {
        const place = Array.from(net.subarray(3 * point, 3 * point + 3), (value) => value.toFixed(4));
        const columns = surface.columns ?? 1;
        lines.push([iteration, name, Math.floor(point / columns), point % columns, ...place].join());
      }
    }
  }
  return `${lines.join("\n")}\n`;
}

const quoted = (name) => (/[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name);

export function save(name, content, type = "text/plain") {
  const link = element("a", { href: URL.createObjectURL(new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

export const bytesOf = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
