// Where the tip can go and where it is wanted: a cloud of places with their hull, and a ball to be dragged.
import * as THREE from "three";
import { ConvexGeometry } from "three/examples/jsm/geometries/ConvexGeometry.js";

const WANTED = "#d1495b";
const PLACES = "#5a7fb0";
const [GRASP, NEAR] = [11, 8]; // pixels from the ball and from a place
const FLAT = 0.02; // of its length, to which a hull has no inside worth drawing

export class Reach {
  moved; // called with a place to which the ball is dragged, and whether it is let go there
  chosen; // called with the number of a place that is clicked

  // One to a scene; what listens to the pointer stays with the view.
  constructor(view, radius) {
    Object.assign(this, { view, places: [], words: [] });
    this.group = new THREE.Group();
    this.group.visible = false;
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(0.12 * radius, 24, 16), seenThrough(WANTED));
    this.ball.renderOrder = 13;
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: WANTED, depthTest: false, transparent: true }));
    this.line.renderOrder = 12;
    this.cloud = new THREE.Group();
    this.cloud.visible = false;
    this.group.add(this.ball, this.line, this.cloud);
    view.scene.add(this.group);
    listen(view);
  }

  remove() {
    this.group.removeFromParent();
  }

  // Places three numbers each; whether they fill a space.
  load(places, spatial) {
    this.places = places;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(places.flat(), 3));
    const points = new THREE.Points(geometry, new THREE.PointsMaterial({ color: PLACES, size: 2.5, sizeAttenuation: false, depthTest: false, transparent: true, opacity: 0.6 }));
    points.renderOrder = 9;
    points.frustumCulled = false;
    this.cloud.add(points);
    const size = new THREE.Box3().setFromArray(places.flat()).getSize(new THREE.Vector3()).toArray().sort((a, b) => a - b);
    if (!spatial || size[0] < FLAT * size[2]) return;
    const hull = new THREE.Mesh(
      new ConvexGeometry(places.map((place) => new THREE.Vector3(...place))),
      new THREE.MeshBasicMaterial({ color: PLACES, transparent: true, opacity: 0.1, depthWrite: false, side: THREE.DoubleSide }),
    );
    hull.renderOrder = 8;
    this.cloud.add(hull);
  }

  // tip and wanted: places; wanted is null where only pressures are set.
  show(tip, wanted, cloud) {
    this.group.visible = tip !== null;
    if (!tip) {
      this.words = [];
      return;
    }
    this.at = wanted ?? tip;
    this.ball.position.fromArray(this.at);
    this.line.geometry.setFromPoints([new THREE.Vector3(...tip), this.ball.position]);
    this.cloud.visible = cloud;
    this.words = wanted || cloud ? [] : [{ at: this.ball.position.clone(), text: "drag the tip" }];
    this.view.draw();
  }

  // What is under the pointer: "ball", the number of a place, or null.
  under(point) {
    if (!this.group.visible) return null;
    const away = (place) => {
      const [x, y] = this.view.seen(place);
      return Math.hypot(x - point[0], y - point[1]);
    };
    if (away(this.at) < GRASP) return "ball";
    if (!this.cloud.visible) return null;
    const best = this.places.reduce((least, place, number) => (away(place) < least.away ? { away: away(place), number } : least), { away: NEAR, number: null });
    return best.number;
  }
}

// Before what turns the picture, which gets only what is meant for it.
function listen(view) {
  if (view.listens) return;
  view.listens = true;
  let [dragged, pressed] = [null, null];
  const pointOf = ({ clientX, clientY }) => {
    const { left, top } = view.canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  const on = (name, act) => view.place.addEventListener(name, act, true);
  on("pointerdown", (event) => {
    const point = pointOf(event);
    pressed = point;
    if (event.button !== 0 || view.reach?.under(point) !== "ball") return;
    dragged = view.reach.at;
    view.place.setPointerCapture(event.pointerId);
    event.stopPropagation();
  });
  on("pointermove", (event) => {
    if (!dragged) {
      if (view.reach && !event.buttons) view.place.style.cursor = view.reach.under(pointOf(event)) === null ? "" : "pointer";
      return;
    }
    event.stopPropagation();
    view.reach.moved(view.placeAt(pointOf(event), dragged), false);
  });
  on("pointercancel", () => (dragged = pressed = null));
  on("pointerup", (event) => {
    const point = pointOf(event);
    if (dragged) {
      const from = dragged;
      dragged = null;
      event.stopPropagation();
      view.place.releasePointerCapture(event.pointerId);
      return view.reach.moved(view.placeAt(point, from), true);
    }
    // A click, which did not turn the picture.
    if (!pressed || Math.hypot(point[0] - pressed[0], point[1] - pressed[1]) > 3) return;
    const number = view.reach?.under(point);
    if (typeof number === "number") view.reach.chosen(number);
  });
}

function seenThrough(color) {
  return new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true, opacity: 0.9 });
}
