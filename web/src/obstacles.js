// Rigid obstacles beside the body, each where the state that is shown has moved it.
import * as THREE from "three";

const STILL = new THREE.Matrix4().elements;
const NEAR = 0.25; // how much of obstacles is in the picture around the body, as a part of its length

export class Obstacles {
  constructor(scene, obstacles) {
    const material = new THREE.MeshStandardMaterial({
      color: "#8b8378", side: THREE.DoubleSide, roughness: 0.7, flatShading: true, transparent: true, opacity: 0.45, depthWrite: false,
    });
    this.meshes = obstacles.map(({ name, positions, index }) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(positions), 3));
      geometry.setIndex(new THREE.BufferAttribute(index, 1));
      const mesh = new THREE.Mesh(geometry, material);
      mesh.name = name;
      mesh.matrixAutoUpdate = false;
      mesh.renderOrder = 5;
      return mesh;
    });
    if (this.meshes.length > 0) scene.add(...this.meshes);
  }

  // moved: the matrices of those that are not in their places; null where that is not known.
  show(moved, shown) {
    for (const mesh of this.meshes) {
      const matrix = moved[mesh.name];
      mesh.visible = shown && matrix !== null;
      mesh.matrix.fromArray(matrix ?? STILL);
      mesh.matrixWorldNeedsUpdate = true;
    }
  }
}

// What of obstacles should be in a picture of these points, three numbers each, where these shapes have moved them.
export function besides(obstacles, shapes, points, length) {
  const ends = [0, 1, 2].map((axis) => {
    let [low, high] = [Infinity, -Infinity];
    for (let i = axis; i < points.length; i += 3) [low, high] = [Math.min(low, points[i]), Math.max(high, points[i])];
    return [low - NEAR * length, high + NEAR * length];
  });
  const within = (value, axis) => Math.min(Math.max(value, ends[axis][0]), ends[axis][1]);
  return obstacles.flatMap(({ name, positions }) => {
    const places = [STILL, ...shapes.flatMap((shape) => (shape.obstacles[name] ? [shape.obstacles[name]] : []))];
    return places.flatMap((m) => {
      const [x, y, z] = [0, 1, 2].map((axis) => (i) => positions[i - (i % 3) + axis]);
      return Array.from(positions, (_, i) => within(m[i % 3] * x(i) + m[4 + (i % 3)] * y(i) + m[8 + (i % 3)] * z(i) + m[12 + (i % 3)], i % 3));
    });
  });
}
