// The body as the screen sees it: coloured surfaces, a plane that cuts them, and the cut face, which looks solid.
import * as THREE from "three";

const EVERY = 2.2; // mm between the lines of the hatching

export class BodyView {
  constructor(scene, extent) {
    this.plane = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
    this.geometry = new THREE.BufferGeometry();
    const surface = new THREE.MeshStandardMaterial({ vertexColors: true, side: THREE.DoubleSide, roughness: 0.62 });
    this.surface = new THREE.Mesh(this.geometry, surface);
    this.surface.renderOrder = 3;
    // Back faces count up, front faces down: what is left above zero on the plane is rubber.
    this.counters = [
      counter(this.geometry, THREE.BackSide, THREE.IncrementWrapStencilOp),
      counter(this.geometry, THREE.FrontSide, THREE.DecrementWrapStencilOp),
    ];
    this.face = new THREE.Mesh(new THREE.PlaneGeometry(4 * extent, 4 * extent), faceMaterial(4 * extent));
    this.face.renderOrder = 2;
    this.face.onAfterRender = (renderer) => renderer.clearStencil();
    this.ghost = new THREE.Mesh(
      new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ color: "#6f8296", transparent: true, opacity: 0.22, depthWrite: false }),
    );
    this.ghost.renderOrder = 4;
    this.ghost.visible = false;
    for (const mesh of [this.surface, this.face, this.ghost, ...this.counters]) mesh.frustumCulled = false;
    scene.add(this.surface, this.face, this.ghost, ...this.counters);
    this.cut(null);
  }

  show(shape, colours) {
    fill(this.geometry, shape);
    this.geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  }

  showGhost(shape) {
    this.ghost.visible = shape !== null;
    if (shape) fill(this.ghost.geometry, shape);
  }

  // A vertex of what a ray meets first; null beside the body and on the cut face.
  hit(ray) {
    const [plane] = this.surface.material.clippingPlanes ?? [];
    const first = ray.intersectObject(this.surface).find(({ point }) => !plane || plane.distanceToPoint(point) >= 0);
    // From within the rubber one looks through the cut face.
    return first && first.face.normal.dot(ray.ray.direction) < 0 ? first.face.a : null;
  }

  // Cut away what lies against a normal from a plane; with nothing, the body is whole.
  cut(where) {
    const planes = where ? [this.plane] : [];
    for (const mesh of [this.surface, this.ghost, ...this.counters]) mesh.material.clippingPlanes = planes;
    for (const mesh of [this.face, ...this.counters]) mesh.visible = where !== null;
    if (!where) return;
    this.plane.normal.fromArray(where.normal);
    this.plane.constant = -where.offset;
    this.plane.coplanarPoint(this.face.position);
    this.face.lookAt(this.face.position.clone().sub(this.plane.normal));
  }
}

function counter(geometry, side, operation) {
  const material = new THREE.MeshBasicMaterial({
    side,
    depthWrite: false,
    depthTest: false,
    colorWrite: false,
    stencilWrite: true,
    stencilFunc: THREE.AlwaysStencilFunc,
    stencilFail: operation,
    stencilZFail: operation,
    stencilZPass: operation,
  });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.renderOrder = 1;
  return mesh;
}

function faceMaterial(extent) {
  const picture = document.createElement("canvas");
  picture.width = picture.height = 64;
  const pen = picture.getContext("2d");
  pen.fillStyle = "#aebccb";
  pen.fillRect(0, 0, 64, 64);
  pen.strokeStyle = "#74869a";
  pen.lineWidth = 6;
  for (const shift of [-64, 0, 64]) {
    pen.beginPath();
    pen.moveTo(shift - 8, 72);
    pen.lineTo(shift + 72, -8);
    pen.stroke();
  }
  const map = new THREE.CanvasTexture(picture);
  map.colorSpace = THREE.SRGBColorSpace;
  map.wrapS = map.wrapT = THREE.RepeatWrapping;
  map.repeat.set(extent / EVERY, extent / EVERY);
  map.anisotropy = 8;
  return new THREE.MeshBasicMaterial({
    map,
    side: THREE.DoubleSide,
    stencilWrite: true,
    stencilRef: 0,
    stencilFunc: THREE.NotEqualStencilFunc,
    stencilFail: THREE.ReplaceStencilOp,
    stencilZFail: THREE.ReplaceStencilOp,
    stencilZPass: THREE.ReplaceStencilOp,
  });
}

function fill(geometry, shape) {
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(shape.positions), 3));
  geometry.setIndex(new THREE.BufferAttribute(shape.index, 1));
  geometry.deleteAttribute("normal");
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
}
