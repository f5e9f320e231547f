// The view: an orthographic camera that turns round the body, lights, and what is drawn over the picture.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { BodyView } from "./body.js";
import { Marks, tipOf } from "./marks.js";
import { Obstacles } from "./obstacles.js";
import { Reach } from "./reach.js";

// Small pictures are drawn in one place and copied: a browser has few places to draw in space.
let shared;

function rendererOf(canvas) {
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true, preserveDrawingBuffer: true });
  renderer.localClippingEnabled = true;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  return renderer;
}

const TURN = Math.PI / 24; // of a key
// Pixels above, below and beside; above is what is shown, below the legend, which are higher where the picture is narrow.
const [FREE, FREE_NARROW, FREE_SMALL, NARROW] = [[50, 96, 40], [70, 112, 40], [10, 30, 10], 500];

export class View {
  drawn; // called after every picture
  // place: the element of the picture; a small one is seen as another view is, and cannot be turned by itself.
  constructor(place, small = false) {
    const canvas = place.querySelector("canvas");
    Object.assign(this, { place, small, canvas });
    this.renderer = small ? (shared ??= rendererOf(document.createElement("canvas"))) : rendererOf(canvas);
    this.paper = small ? canvas.getContext("2d") : null;
    this.camera = new THREE.OrthographicCamera();
    const lamp = new THREE.DirectionalLight("#ffffff", 1.9);
    lamp.position.set(-0.6, 1, 1.4);
    this.camera.add(lamp);
    new ResizeObserver(() => this.#resize()).observe(place);
    if (!small) place.addEventListener("keydown", (event) => this.#key(event));
  }

  // points: everything that should be seen, three numbers each. The same run is looked at as before.
  load({ facts, obstacles }, points, same = false) {
    Object.assign(this, { facts, points });
    if (same) {
      this.marks.facts = facts;
      this.#reaches();
      return this.#resize();
    }
    this.scene?.traverse((each) => (each.geometry?.dispose(), each.material?.dispose?.()));
    this.scene = new THREE.Scene();
    const box = new THREE.Box3().setFromArray(points);
    this.scene.add(new THREE.HemisphereLight("#ffffff", "#9aa5b1", 1.9), this.camera);
    this.extent = box.getSize(new THREE.Vector3()).length();
    this.body = new BodyView(this.scene, this.extent);
    this.marks = new Marks(this.scene, facts, facts.radius);
    this.obstacles = new Obstacles(this.scene, obstacles);
    this.#reaches();
    this.middle = box.getCenter(new THREE.Vector3());
    this.camera.up.copy(upward(facts));
    // What turns the camera holds on to how up was when it was made.
    this.controls?.dispose();
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enabled = !this.small;
    if (this.small) this.canvas.style.touchAction = "auto";
    this.controls.addEventListener("change", () => this.draw());
    this.reset();
  }

  #reaches() {
    this.reach?.remove();
    this.reach = this.small || !this.facts.model ? null : new Reach(this, this.facts.radius);
  }

  // Look from where another view looks, at the same scale.
  like(other) {
    const offset = other.camera.position.clone().sub(other.controls.target);
    this.camera.position.copy(this.middle).add(offset.setLength(2 * this.extent));
    this.controls.target.copy(this.middle);
    this.camera.zoom = other.camera.zoom;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  // Look as the pictures of the run do: against the plane in which most tasks bend.
  reset() {
    const normal = new THREE.Vector3(...this.facts.view.normal);
    const up = this.camera.up;
    const level = normal.clone().negate().projectOnPlane(up).normalize();
    if (level.length() < 0.5) level.set(0, 0, 1).projectOnPlane(up).normalize();
    const direction = level.applyAxisAngle(up, 0.42).multiplyScalar(Math.cos(0.3)).addScaledVector(up, Math.sin(0.3));
    this.camera.position.copy(this.middle).addScaledVector(direction, 2 * this.extent);
    this.camera.near = 0.01 * this.extent;
    this.camera.far = 4 * this.extent;
    this.camera.zoom = 1;
    this.controls.target.copy(this.middle);
    this.controls.update();
    this.#resize();
  }

  show(shape, colours, ghost, task, found, marked) {
    this.body.show(shape, colours);
    this.body.showGhost(ghost);
    this.marks.show(tipOf(shape, this.facts.length), task, found, marked);
    this.obstacles.show(shape.obstacles, marked);
    this.draw();
  }

  // Whether the camera stands on the side that a direction points to.
  isBefore(direction) {
    return this.camera.position.clone().sub(this.controls.target).dot(new THREE.Vector3(...direction)) > 0;
  }

  // The vertex of the body that is seen at a place of the window; null where there is none.
  vertexAt(x, y) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.ray ??= new THREE.Raycaster();
    this.ray.setFromCamera(new THREE.Vector2((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height), this.camera);
    return this.body.hit(this.ray);
  }

  // Where a place is seen, in pixels from the upper left corner of the picture.
  seen(place) {
    const { clientWidth: width, clientHeight: height } = this.place;
    const { x, y } = new THREE.Vector3(...place).project(this.camera);
    return [((x + 1) / 2) * width, ((1 - y) / 2) * height];
  }

  // The place that is seen there, as far away as another one.
  placeAt([x, y], like) {
    const { clientWidth: width, clientHeight: height } = this.place;
    const { z } = new THREE.Vector3(...like).project(this.camera);
    return new THREE.Vector3((2 * x) / width - 1, 1 - (2 * y) / height, z).unproject(this.camera).toArray();
  }

  cut(where) {
    this.body.cut(where);
    this.draw();
  }

  // Once before the next frame, however often it is asked for.
  draw() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.camera.updateMatrixWorld();
      if (this.small) this.renderer.setSize(this.place.clientWidth, this.place.clientHeight, false);
      this.renderer.render(this.scene, this.camera);
      if (this.paper) this.#copy();
      this.#overlay();
      this.drawn?.();
    });
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!width || !height || !this.scene) return;
    if (!this.small) this.renderer.setSize(width, height, false);
    this.camera.updateMatrixWorld();
    const [right, up] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, column));
    let [across, high] = [1e-6, 1e-6];
    const point = new THREE.Vector3();
    for (let i = 0; i < this.points.length; i += 3) {
      point.fromArray(this.points, i).sub(this.middle);
      across = Math.max(across, Math.abs(point.dot(right)));
      high = Math.max(high, Math.abs(point.dot(up)));
    }
    // Millimetres to a pixel, with room for what is drawn over the picture.
    const [above, below, beside] = this.small ? FREE_SMALL : width < NARROW ? FREE_NARROW : FREE;
    const pixel = Math.max((2 * high) / Math.max(height - above - below, 50), (2 * across) / Math.max(width - 2 * beside, 50));
    const [half, shift] = [(pixel * height) / 2, (pixel * (above - below)) / 2];
    const wide = (pixel * width) / 2;
    Object.assign(this.camera, { left: -wide, right: wide, top: half + shift, bottom: shift - half });
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  #copy() {
    const { canvas, paper, renderer } = this;
    const { width, height } = renderer.domElement;
    if (!width || !height) return;
    // A new size clears it.
    Object.assign(canvas, { width, height });
    paper.drawImage(renderer.domElement, 0, 0);
  }

  #key(event) {
    const { camera, controls } = this;
    const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
    const turns = { ArrowLeft: [camera.up, -TURN], ArrowRight: [camera.up, TURN], ArrowUp: [right, -TURN], ArrowDown: [right, TURN] };
    const zooms = { "+": 1.15, "=": 1.15, "-": 1 / 1.15 };
    if (event.key in turns) {
      const offset = camera.position.clone().sub(controls.target).applyAxisAngle(...turns[event.key]);
      // Not over the top, where up has no direction.
      if (offset.angleTo(camera.up) < 0.05 || offset.angleTo(camera.up) > Math.PI - 0.05) return;
      camera.position.copy(controls.target).add(offset);
    } else if (event.key in zooms) {
      camera.zoom *= zooms[event.key];
      camera.updateProjectionMatrix();
    } else if (event.key === "0" || event.key === "Home") {
      this.reset();
    } else return;
    event.preventDefault();
    controls.update();
    this.draw();
  }

  // Words at places in space, the axes, and a length to compare with.
  #overlay() {
    const { clientWidth: width, clientHeight: height } = this.place;
    const layer = this.place.querySelector(".words-in-space");
    const words = this.small ? [] : [...this.marks.words, ...(this.reach?.words ?? [])];
    while (layer.children.length > words.length) layer.lastChild.remove();
    words.forEach(({ at, text, middle }, number) => {
      const label = layer.children[number] ?? layer.appendChild(document.createElement("span"));
      const seen = at.clone().project(this.camera);
      label.textContent = text;
      const aside = middle ? -label.offsetWidth / 2 : 14;
      label.style.transform = `translate(${((seen.x + 1) / 2) * width + aside}px, ${((1 - seen.y) / 2) * height - 8}px)`;
    });
    const into = this.camera.matrixWorldInverse;
    for (const axis of this.place.querySelectorAll(".axes g")) {
      const tip = new THREE.Vector3();
      tip[axis.dataset.axis] = 1;
      tip.transformDirection(into);
      const [x, y] = [26 * tip.x, -26 * tip.y];
      axis.querySelector("line").setAttribute("x2", x);
      axis.querySelector("line").setAttribute("y2", y);
      axis.querySelector("text").setAttribute("x", 1.32 * x);
      axis.querySelector("text").setAttribute("y", 1.32 * y);
    }
    const pixel = (this.camera.top - this.camera.bottom) / this.camera.zoom / height;
    const [scale, most] = [this.place.querySelector(".scale"), Math.min(120, 0.19 * width) * pixel];
    const power = 10 ** Math.floor(Math.log10(most));
    const nice = [5, 2, 1].find((digit) => digit * power <= most) * power;
    scale.style.width = `${nice / pixel}px`;
    scale.textContent = `${Number(nice.toPrecision(1))} mm`;
  }
}

// Against gravity, or along the body where there is none.
function upward({ gravity }) {
  return gravity ? new THREE.Vector3(...gravity).negate().normalize() : new THREE.Vector3(0, 0, 1);
}
