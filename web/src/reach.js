// Where the tip can go and where it is wanted: a cloud of places with their hull, a ball to be dragged, and three knobs on its axes
// by which the target is turned.
import * as THREE from "three";
import { painted } from "./colours.js";
import { ConvexGeometry } from "three/examples/jsm/geometries/ConvexGeometry.js";

const WANTED = "#d1495b";
const PLACES = "#5a7fb0";
const AXES = [["x", "#1f7a8c"], ["y", "#4f772d"], ["z", "#7b4fa3"]];
const SOFT = "#b5651d";
const [ARM, WIDE] = [0.75, 0.9]; // length of the target's axes and of the ellipsoid's half axes, of the radius of the body
const [GRASP, NEAR] = [11, 8]; // pixels from the ball and from a place
const FLAT = 0.02; // of its length, to which a hull has no inside worth drawing

export class Reach {
  moved; // called with a place to which the ball is dragged, and whether it is let go there
  turned; // the same with the rotation vector to which a knob is dragged
  chosen; // called with the number of a place that is clicked

  // One to a scene; what listens to the pointer stays with the view.
  constructor(view, radius) {
    Object.assign(this, { view, places: [], words: [], turn: null, arm: ARM * radius, wide: WIDE * radius });
    this.group = new THREE.Group();
    this.group.visible = false;
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(0.12 * radius, 24, 16), seenThrough(WANTED));
    this.ball.renderOrder = 13;
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: WANTED, depthTest: false, transparent: true }));
    this.line.renderOrder = 12;
    this.axes = AXES.map(([name, color]) => {
      const knob = new THREE.Mesh(new THREE.SphereGeometry(0.08 * radius, 24, 16), seenThrough(color));
      const line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color, depthTest: false, transparent: true }));
      knob.renderOrder = line.renderOrder = 13;
      this.group.add(knob, line);
      return { name, knob, line };
    });
    this.cloud = new THREE.Group();
    this.cloud.visible = false;
    this.ellipsoid = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 10), new THREE.MeshBasicMaterial({ color: SOFT, wireframe: true, depthTest: false, transparent: true, opacity: 0.55 }));
    Object.assign(this.ellipsoid, { matrixAutoUpdate: false, visible: false, frustumCulled: false, renderOrder: 11 });
    this.group.add(this.ball, this.line, this.cloud, this.ellipsoid);
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
    this.points = points;
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

  // Colour the places by values; by none, all have one colour.
  paint(values, range, stops) {
    const { geometry, material } = this.points;
    if (values) geometry.setAttribute("color", new THREE.BufferAttribute(painted(values, range, stops), 3));
    else geometry.deleteAttribute("color");
    Object.assign(material, { vertexColors: values !== null, size: values ? 4 : 2.5, opacity: values ? 0.9 : 0.6, needsUpdate: true });
    material.color.set(values ? "white" : PLACES);
    this.view.draw();
  }

  // tip and wanted: places; wanted is null where only pressures are set. turn: the target's rotation vector, if it has one.
  show(tip, wanted, cloud, turn = null) {
    this.group.visible = tip !== null;
    if (!tip) {
      this.words = [];
      return;
    }
    this.at = wanted ?? tip;
    this.ball.position.fromArray(this.at);
    this.line.geometry.setFromPoints([new THREE.Vector3(...tip), this.ball.position]);
    this.cloud.visible = cloud;
    this.turn = turn;
    this.axes.forEach(({ knob, line }, k) => {
      knob.visible = line.visible = turn !== null;
      if (!turn) return;
      knob.position.copy(this.#axis(k)).multiplyScalar(this.arm).add(this.ball.position);
      line.geometry.setFromPoints([this.ball.position, knob.position]);
    });
    this.words = turn ? this.axes.map(({ name, knob }) => ({ at: knob.position.clone(), text: name }))
      : wanted || cloud ? [] : [{ at: this.ball.position.clone(), text: "drag the tip" }];
    this.view.draw();
  }

  // Where forces of one size move the tip to, in all directions: a ball by its compliance, mm/N, or nothing.
  soften(tip, compliance, force) {
    this.ellipsoid.visible = compliance !== null;
    if (!compliance) return;
    const rows = compliance.map((row, axis) => [...row.map((value) => force * value), tip[axis]]);
    this.ellipsoid.matrix.set(...rows.flat(), 0, 0, 0, 1);
    this.view.draw();
  }

  // Where an axis of the target points.
  #axis(k) {
    return new THREE.Vector3().setComponent(k, 1).applyQuaternion(quaternionOf(this.turn));
  }

  // The rotation vector with which an axis of the target points to a place, turned there by the shortest way.
  turnedTo(k, place) {
    const towards = new THREE.Vector3(...place).sub(this.ball.position).normalize();
    return vectorOf(new THREE.Quaternion().setFromUnitVectors(this.#axis(k), towards).multiply(quaternionOf(this.turn)));
  }

  // What is under the pointer: "ball", the name of an axis whose knob it is, the number of a place, or null.
  under(point) {
    if (!this.group.visible) return null;
    const away = (place) => {
      const [x, y] = this.view.seen(place);
      return Math.hypot(x - point[0], y - point[1]);
    };
    if (away(this.at) < GRASP) return "ball";
    const held = this.turn && this.axes.find(({ knob }) => away(knob.position.toArray()) < GRASP);
    if (held) return held.name;
    if (!this.cloud.visible) return null;
    const best = this.places.reduce((least, place, number) => (away(place) < least.away ? { away: away(place), number } : least), { away: NEAR, number: null });
    return best.number;
  }
}

// Before what turns the picture, which gets only what is meant for it.
function listen(view) {
  if (view.listens) return;
  view.listens = true;
  let [dragged, pressed] = [null, null]; // dragged: where from, and which axis by its knob
  const pointOf = ({ clientX, clientY }) => {
    const { left, top } = view.canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  const on = (name, act) => view.place.addEventListener(name, act, true);
  const drag = (point, { from, axis }, rests) => {
    const place = view.placeAt(point, from);
    if (axis < 0) view.reach.moved(place, rests);
    else view.reach.turned(view.reach.turnedTo(axis, place), rests);
  };
  on("pointerdown", (event) => {
    const point = pointOf(event);
    pressed = point;
    const held = event.button === 0 ? view.reach?.under(point) : null;
    if (typeof held !== "string") return;
    const axis = AXES.findIndex(([name]) => name === held);
    dragged = { axis, from: axis < 0 ? view.reach.at : view.reach.axes[axis].knob.position.toArray() };
    view.place.setPointerCapture(event.pointerId);
    event.stopPropagation();
  });
  on("pointermove", (event) => {
    if (!dragged) {
      if (view.reach && !event.buttons) view.place.style.cursor = view.reach.under(pointOf(event)) === null ? "" : "pointer";
      return;
    }
    event.stopPropagation();
    drag(pointOf(event), dragged, false);
  });
  on("pointercancel", () => (dragged = pressed = null));
  on("pointerup", (event) => {
    const point = pointOf(event);
    if (dragged) {
      const from = dragged;
      dragged = null;
      event.stopPropagation();
      view.place.releasePointerCapture(event.pointerId);
      return drag(point, from, true);
    }
    // A click, which did not turn the picture.
    if (!pressed || Math.hypot(point[0] - pressed[0], point[1] - pressed[1]) > 3) return;
    const number = view.reach?.under(point);
    if (typeof number === "number") view.reach.chosen(number);
  });
}

function quaternionOf(turn) {
  const vector = new THREE.Vector3(...turn);
  return new THREE.Quaternion().setFromAxisAngle(vector.clone().normalize(), vector.length());
}

function vectorOf({ x, y, z, w }) {
  const [length, sign] = [Math.hypot(x, y, z), w < 0 ? -1 : 1];
  const factor = length > 0 ? (2 * sign * Math.atan2(length, Math.abs(w))) / length : 0;
  return [x, y, z].map((part) => factor * part);
}

function seenThrough(color) {
  return new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true, opacity: 0.9 });
}
