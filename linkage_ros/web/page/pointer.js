// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The pointer over the picture: drags joints, finds bars, and zooms, shifts and turns the view, as keys do.

import { clamp } from './control.js';

const PIXELS_A_RADIAN = 200;
const STEP = 40;
const ZOOM = 1.2;
const [MIN_ZOOM, MAX_ZOOM] = [0.05, 200];
const WHOLE = { zoom: 1, shift: [0, 0], yaw: 0, pitch: 0 };
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** How far a pointer may be from a joint, and from a bar [pixels]. */
const GRAB = { mouse: 16, touch: 28 };
const BAR = 9;

/** The mean of some places. */
export const middle = points => [0, 1].map(i => points.reduce((sum, at) => sum + at[i], 0) / points.length);

/** The distance of a point from a line between two others. */
function distance([x, y], [ax, ay], [bx, by]) {
  const along = [bx - ax, by - ay];
  const part = ((x - ax) * along[0] + (y - ay) * along[1]) / (along[0] ** 2 + along[1] ** 2 || 1);
  const nearest = clamp(part, 0, 1);
  return Math.hypot(x - ax - nearest * along[0], y - ay - nearest * along[1]);
}

/** The first candidate with the least distance, if that is in reach. */
const closest = (candidates, reach) => candidates.filter(({ away }) => away <= reach).sort((a, b) => a.away - b.away)[0] ?? null;

export class View {
  /** Begins as `from`; calls `changed()`, `drag(mechanism, want)`, `light(mechanism, dimension)`, `choose(mechanism, dimension)`. */
  constructor(picture, from, calls) {
    const { canvas } = picture;
    /** The pointers that move the view, and the joint that another one has grabbed. */
    Object.assign(this, { picture, canvas, pointers: new Map(), grabbed: null, ...calls, ...WHOLE, ...from });
    canvas.addEventListener('pointerdown', event => this.press(event));
    canvas.addEventListener('pointermove', event => this.move(event));
    canvas.addEventListener('pointerleave', () => this.light(null, ''));
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, ({ pointerId }) => {
        this.pointers.delete(pointerId);
        if (pointerId === this.grabbed?.pointerId) this.grabbed = null;
      });
    }
    canvas.addEventListener('click', event => this.click(event));
    canvas.addEventListener('contextmenu', event => event.preventDefault());
    canvas.addEventListener('dblclick', () => this.reset());
    canvas.addEventListener('keydown', event => this.key(event));
    canvas.addEventListener('wheel', event => {
      event.preventDefault();
      this.magnify(Math.exp(-event.deltaY / (event.deltaMode ? 15 : 500)), [event.offsetX, event.offsetY]);
    }, { passive: false });
  }

  reset() {
    Object.assign(this, WHOLE);
    this.changed();
  }

  get turned() {
    return this.yaw !== 0 || this.pitch !== 0;
  }

  get whole() {
    return !this.turned && this.zoom === 1 && !this.shift.some(Boolean);
  }

  /** Return axes, turned: to the right, up, and out of the picture. */
  axes({ right, up, out }) {
    const mix = (a, part, b, other) => a.map((end, i) => part * end + other * b[i]);
    const [c, s, e, f] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const towards = mix(out, c, right, s);
    return { right: mix(right, c, out, -s), up: mix(up, e, towards, -f), out: mix(towards, e, up, f) };
  }

  /** Zoom by a factor about a place in the canvas, by default its middle. */
  magnify(factor, at) {
    const zoom = clamp(this.zoom * factor, MIN_ZOOM, MAX_ZOOM);
    const real = zoom / this.zoom;
    const centre = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    this.shift = this.shift.map((shift, i) => ((at ?? centre)[i] - centre[i]) * (1 - real) + shift * real);
    this.zoom = zoom;
    this.changed();
  }

  pan(x, y) {
    this.shift = [this.shift[0] + x, this.shift[1] + y];
    this.changed();
  }

  turn(x, y) {
    this.yaw -= x / PIXELS_A_RADIAN;
    this.pitch = clamp(this.pitch + y / PIXELS_A_RADIAN, -Math.PI / 2, Math.PI / 2);
    this.changed();
  }

  /** The joint that is nearest to a pointer, of those that can be moved. */
  joint([x, y], reach) {
    return closest(this.picture.legsSeen().flatMap(
      leg => [...leg.seen].filter(([joint]) => !leg.mechanism.tunable.fixed.includes(joint)).map(
        ([joint, at]) => ({ ...leg, joint, away: Math.hypot(at[0] - x, at[1] - y) }))), reach);
  }

  /** The bar that is nearest to a pointer, with the dimension that determines it. */
  bar(pointer) {
    // Of dimensions that determine the same bar, the one that determines the fewest others.
    return closest(this.picture.legsSeen().flatMap(
      ({ mechanism, seen }) => Object.entries(mechanism.tunable.bars).flatMap(
        ([dimension, pairs]) => pairs.filter(pair => pair.every(joint => seen.has(joint))).map(([a, b]) => (
          { mechanism, dimension, away: distance(pointer, seen.get(a), seen.get(b)) + pairs.length / 100 })))), BAR);
  }

  press({ offsetX, offsetY, button, pointerId, pointerType }) {
    this.pressed = [offsetX, offsetY];
    this.canvas.setPointerCapture(pointerId);
    // Another finger zooms, or holds a joint; another button turns.
    const isFree = !button && !this.grabbed && !this.pointers.size;
    const joint = isFree && this.joint(this.pressed, GRAB[pointerType] ?? GRAB.mouse);
    if (joint) this.grabbed = { ...joint, key: joint.mechanism.key, pointer: this.pressed, pointerId };
    else if (!this.grabbed) this.pointers.set(pointerId, this.pressed);
  }

  move(event) {
    const pointer = [event.offsetX, event.offsetY];
    if (event.pointerId === this.grabbed?.pointerId) this.dragTo(pointer);
    else if (this.pointers.has(event.pointerId)) this.moveView(event, pointer);
    else if (!this.grabbed) this.hover(pointer);
  }

  /** Drag the joint to a pointer. */
  dragTo(pointer) {
    this.grabbed.pointer = pointer;
    const { dragged, grabbed: { joint, leg } } = this;
    const place = dragged && this.picture.inPlane(dragged.map, ...this.picture.from(...pointer));
    if (place?.every(Number.isFinite)) this.drag(dragged.mechanism, { joint, leg, place });
  }

  /** Shift the view with a pointer, turn it, or zoom with two. */
  moveView({ pointerId, shiftKey, buttons }, pointer) {
    const before = [...this.pointers.values()];
    this.pointers.set(pointerId, pointer);
    const now = [...this.pointers.values()];
    const [from, to] = [middle(before), middle(now)];
    const way = to.map((end, i) => end - from[i]);
    if (shiftKey || buttons & 2) return this.turn(...way);
    if (now.length === 2) {
      const [far, near] = [now, before].map(([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]));
      if (near > 0) this.magnify(far / near, from);
    }
    this.pan(...way);
  }

  hover(pointer) {
    const joint = this.joint(pointer, GRAB.mouse);
    const bar = joint ? null : this.bar(pointer);
    this.canvas.classList.toggle('joint', joint !== null);
    this.canvas.classList.toggle('bar', bar !== null);
    this.light(bar?.mechanism ?? null, bar?.dimension ?? '');
  }

  /** Go to the slider of a bar, unless the picture was dragged. */
  click({ offsetX, offsetY }) {
    const [x, y] = this.pressed;
    if (Math.hypot(offsetX - x, offsetY - y) > BAR || this.joint(this.pressed, GRAB.mouse)) return;
    const bar = this.bar(this.pressed);
    if (bar) this.choose(bar.mechanism, bar.dimension);
  }

  /** The leg whose joint is dragged. */
  get dragged() {
    return this.grabbed && this.picture.legsSeen().find(
      ({ mechanism, leg }) => mechanism.key === this.grabbed.key && leg === this.grabbed.leg);
  }

  /** The ends of the line from the dragged joint to the pointer. */
  get dragLine() {
    const from = this.dragged?.seen.get(this.grabbed.joint);
    return from ? [from, this.grabbed.pointer] : null;
  }

  key(event) {
    const way = KEYS[event.key]?.map(sign => sign * STEP);
    const zoom = { '+': ZOOM, '=': ZOOM, '-': 1 / ZOOM }[event.key];
    if (way && event.shiftKey) this.turn(...way);
    else if (way) this.pan(...way);
    else if (zoom) this.magnify(zoom);
    else if (event.key === '0') this.reset();
    else return;
    event.preventDefault();
  }
}
