// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The view of the picture: zoom, shift and rotation by mouse, fingers and keys.

const PIXELS_A_RADIAN = 200;
const STEP = 40;
const ZOOM = 1.2;
const [MIN_ZOOM, MAX_ZOOM] = [0.05, 200];
const WHOLE = { zoom: 1, shift: [0, 0], yaw: 0, pitch: 0 };
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** The mean of some places. */
export const middle = points => [0, 1].map(i => points.reduce((sum, at) => sum + at[i], 0) / points.length);

export class View {
  /** Begins as `from`, and calls `changed()`. */
  constructor(canvas, from, changed) {
    Object.assign(this, { canvas, changed, pointers: new Map(), ...WHOLE, ...from });
    canvas.addEventListener('pointerdown', event => this.press(event));
    canvas.addEventListener('pointermove', event => this.move(event));
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, event => this.pointers.delete(event.pointerId));
    }
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

  /** From where it is seen. */
  get from() {
    const { zoom, shift, yaw, pitch } = this;
    return { zoom, shift, yaw, pitch };
  }

  get turned() {
    return this.yaw !== 0 || this.pitch !== 0;
  }

  get whole() {
    return !this.turned && this.zoom === 1 && !this.shift.some(Boolean);
  }

  /** Return axes, turned: to the right, up, and out of the picture. */
  axes({ right, up, out }) {
    const mix = (a, part, b, other) => a.map((one, i) => part * one + other * b[i]);
    const [c, s, e, f] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const towards = mix(out, c, right, s);
    return { right: mix(right, c, out, -s), up: mix(up, e, towards, -f), out: mix(towards, e, up, f) };
  }

  /** Zoom by a factor about a place in the canvas, by default its middle. */
  magnify(factor, at) {
    const zoom = Math.min(Math.max(this.zoom * factor, MIN_ZOOM), MAX_ZOOM);
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
    this.pitch = Math.min(Math.max(this.pitch + y / PIXELS_A_RADIAN, -Math.PI / 2), Math.PI / 2);
    this.changed();
  }

  press(event) {
    if (event.isTaken) return;
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.canvas.setPointerCapture(event.pointerId);
  }

  move(event) {
    const before = [...this.pointers.values()];
    if (!this.pointers.has(event.pointerId)) return;
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    const now = [...this.pointers.values()];
    const [from, to] = [middle(before), middle(now)];
    const way = to.map((one, i) => one - from[i]);
    if (event.shiftKey || event.buttons & 2) {
      this.turn(...way);
      return;
    }
    if (now.length === 2) {
      const [far, near] = [now, before].map(([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]));
      if (near > 0) this.magnify(far / near, from);
    }
    this.pan(...way);
  }

  key(event) {
    const way = KEYS[event.key]?.map(one => one * STEP);
    const zoom = { '+': ZOOM, '=': ZOOM, '-': 1 / ZOOM }[event.key];
    if (way && event.shiftKey) this.turn(...way);
    else if (way) this.pan(...way);
    else if (zoom) this.magnify(zoom);
    else if (event.key === '0') this.reset();
    else return;
    event.preventDefault();
  }
}
