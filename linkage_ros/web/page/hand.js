// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The pointer over the picture: drags joints, and finds the bar below it.

const GRAB = { mouse: 16, touch: 28 };
const BAR = 9;

/** How far a point is from a line between two others. */
function distance([x, y], [ax, ay], [bx, by]) {
  const along = [bx - ax, by - ay];
  const part = ((x - ax) * along[0] + (y - ay) * along[1]) / (along[0] ** 2 + along[1] ** 2 || 1);
  const near = Math.min(Math.max(part, 0), 1);
  return Math.hypot(x - ax - near * along[0], y - ay - near * along[1]);
}

export class Hand {
  /** Calls `drag(mechanism, want)`, `light(mechanism, dimension)` and `choose(mechanism, dimension)`. */
  constructor(picture, calls) {
    Object.assign(this, calls, { picture, canvas: picture.canvas, grabbed: null });
    this.canvas.addEventListener('pointerdown', event => this.grab(event));
    this.canvas.addEventListener('pointermove', event => this.move(event));
    this.canvas.addEventListener('pointerleave', () => this.light(null, ''));
    this.canvas.addEventListener('click', event => this.click(event));
    for (const end of ['pointerup', 'pointercancel']) {
      this.canvas.addEventListener(end, ({ pointerId }) => { if (pointerId === this.grabbed?.pointerId) this.grabbed = null; });
    }
  }

  /** The joint that is nearest to a pointer, of those that can be moved. */
  joint([x, y], reach) {
    let best = null;
    for (const leg of this.picture.legsSeen()) {
      if (leg.mechanism.space) continue;
      for (const [name, at] of leg.seen) {
        const away = Math.hypot(at[0] - x, at[1] - y);
        if (leg.mechanism.tunable.fixed.includes(name) || away > reach || best?.away < away) continue;
        best = { ...leg, joint: name, away };
      }
    }
    return best;
  }

  /** The bar that is nearest to a pointer, with the dimension that determines it. */
  bar(pointer) {
    let best = null;
    for (const { mechanism, seen } of this.picture.legsSeen()) {
      for (const [dimension, pairs] of Object.entries(mechanism.tunable.bars)) {
        for (const [a, b] of pairs) {
          if (!seen.has(a) || !seen.has(b)) continue;
          const away = distance(pointer, seen.get(a), seen.get(b)) + pairs.length / 100;
          if (away <= BAR && !(best?.away <= away)) best = { mechanism, dimension, away };
        }
      }
    }
    return best;
  }

  grab({ offsetX, offsetY, button, pointerId, pointerType }) {
    const pointer = this.pressed = [offsetX, offsetY];
    // Another finger zooms, or holds a joint; another button turns.
    if (button || this.grabbed || this.picture.view.pointers.size) return;
    const found = this.joint(pointer, GRAB[pointerType] ?? GRAB.mouse);
    if (!found) return;
    this.grabbed = { key: found.mechanism.key, leg: found.leg, joint: found.joint, pointer, pointerId };
    this.canvas.setPointerCapture(pointerId);
  }

  /** Go to the slider of a bar, unless the picture was dragged. */
  click({ offsetX, offsetY }) {
    const [x, y] = this.pressed;
    if (Math.hypot(offsetX - x, offsetY - y) > BAR || this.joint(this.pressed, GRAB.mouse)) return;
    const bar = this.bar(this.pressed);
    if (bar) this.choose(bar.mechanism, bar.dimension);
  }

  move(event) {
    const pointer = [event.offsetX, event.offsetY];
    if (!this.grabbed) {
      const joint = this.joint(pointer, GRAB.mouse);
      const bar = joint ? null : this.bar(pointer);
      this.canvas.classList.toggle('joint', joint !== null);
      this.canvas.classList.toggle('bar', bar !== null);
      this.light(bar?.mechanism ?? null, bar?.dimension ?? '');
      return;
    }
    if (event.pointerId !== this.grabbed.pointerId) return;
    this.grabbed.pointer = pointer;
    const held = this.held();
    if (!held) return;
    const place = this.picture.inPlane(held.map, ...this.picture.from(...pointer));
    const { joint, leg } = this.grabbed;
    if (place.every(Number.isFinite)) this.drag(held.mechanism, { joint, leg, place });
  }

  /** The leg whose joint is dragged. */
  held() {
    return this.grabbed && this.picture.legsSeen().find(
      ({ mechanism, leg }) => mechanism.key === this.grabbed.key && leg === this.grabbed.leg);
  }

  /** The ends of the line from the dragged joint to the pointer. */
  get pull() {
    const from = this.held()?.seen.get(this.grabbed.joint);
    return from ? [from, this.grabbed.pointer] : null;
  }
}
