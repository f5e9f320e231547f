// What stands beside the body: its clamp, the plate, force and gravity, target curves and places, and words to them.
import * as THREE from "three";

const TARGET = "#d1495b";
const FOUND = "#2a6f97";

export class Marks {
  constructor(scene, facts, radius) {
    Object.assign(this, { facts, radius, length: facts.length });
    this.group = new THREE.Group();
    this.words = []; // { at: Vector3, text, middle: whether it is centred there }
    scene.add(this.group);
    const metal = new THREE.MeshStandardMaterial({ color: "#5d6b79", roughness: 0.5, metalness: 0.2 });
    this.clamp = disc(1.3 * radius, 0.025 * this.length, metal);
    this.clamp.position.z = -0.0125 * this.length - 0.02;
    this.plate = disc(1.04 * radius, 0.012 * this.length, metal);
    scene.add(this.clamp, this.plate);
  }

  // tip: { at, axis }; task: name or "" at rest; found: the task's record where the shape is what it tells of.
  show(tip, task, found, shown) {
    this.group.clear();
    this.words = [];
    const size = 0.2 * this.length;
    this.clamp.visible = shown;
    this.plate.visible = shown && this.facts.plate;
    this.plate.position.copy(tip.at).addScaledVector(tip.axis, 0.006 * this.length + 0.02);
    this.plate.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), tip.axis);
    if (!shown) return;
    this.#word(new THREE.Vector3(0, 0, -0.07 * this.length), "clamped", true);
    const own = this.facts.tasks.find((each) => each.name === task);
    const force = new THREE.Vector3(...(own?.force ?? [0, 0, 0]));
    if (force.length() > 0) {
      const text = `${Number(force.length().toPrecision(3))} N`;
      this.#arrow(tip.at, force.normalize(), size, "#c26a1b", text);
    }
    if (own?.gravity) {
      const down = new THREE.Vector3(...own.gravity).normalize();
      // Beside the base, against the direction in which it pulls.
      const from = new THREE.Vector3(0, 0, 0.06 * this.length).addScaledVector(down, -this.radius - 1.5 * size);
      this.#arrow(from, down, size, "#5b8c5a", "gravity");
    }
    const target = own?.target;
    if (target?.line) this.#course(target, found);
    if (target?.place) this.#place(target);
  }

  #course(target, found) {
    const line = new THREE.CatmullRomCurve3(target.line.map((point) => new THREE.Vector3(...point)));
    this.group.add(new THREE.Mesh(new THREE.TubeGeometry(line, 160, 0.0035 * this.length, 8), always(TARGET)));
    for (const place of target.sections) this.#ball(place, 0.009, TARGET);
    for (const place of found?.section_position_mm ?? []) this.#ball(place, 0.012, FOUND);
    this.#word(new THREE.Vector3(...target.line.at(-1)), "target");
  }

  #place({ place, axis }) {
    this.#ball(place, 0.018, TARGET);
    const at = new THREE.Vector3(...place);
    if (axis) this.#arrow(at, new THREE.Vector3(...axis), 0.12 * this.length, TARGET, "target");
    else this.#word(at, "target");
  }

  #ball(place, size, colour) {
    const ball = new THREE.Mesh(new THREE.SphereGeometry(size * this.length, 20, 12), always(colour));
    ball.position.fromArray(place);
    ball.renderOrder = 11;
    this.group.add(ball);
  }

  #arrow(from, direction, size, colour, text) {
    this.group.add(new THREE.ArrowHelper(direction, from, size, colour, 0.3 * size, 0.16 * size));
    this.#word(from.clone().addScaledVector(direction, 0.4 * size), text);
  }

  #word(at, text, middle = false) {
    this.words.push({ at, text, middle });
  }
}

// The centre of the tip's face and the direction that it looks in.
export function tipOf({ positions, index, tip }, length) {
  if (!tip) return { at: new THREE.Vector3(0, 0, length), axis: new THREE.Vector3(0, 0, 1) };
  const [a, b, c] = [0, 0, 0].map(() => new THREE.Vector3());
  const [at, axis] = [new THREE.Vector3(), new THREE.Vector3()];
  let area = 0;
  for (let i = 0; i < index.length; i += 3) {
    if (index[i] < tip[0] || index[i] >= tip[1]) continue;
    [a, b, c].forEach((corner, k) => corner.fromArray(positions, 3 * index[i + k]));
    const middle = a.clone().add(b).add(c).divideScalar(3);
    const normal = b.sub(a).cross(c.sub(a));
    at.addScaledVector(middle, normal.length());
    area += normal.length();
    axis.add(normal);
  }
  return { at: at.divideScalar(area || 1), axis: axis.normalize() };
}

function disc(radius, height, material) {
  const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, height, 64), material);
  mesh.rotation.x = Math.PI / 2;
  return mesh;
}

// Seen through the body, which it is in the middle of.
function always(color) {
  const material = new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true });
  return material;
}
