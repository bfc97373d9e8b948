// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The pointer over the picture: drags joints, and finds the bar below it.

const GRAB = { mouse: 16, touch: 28 };
const BAR = 9;

/** The distance of a point from a line between two others. */
function distance([x, y], [ax, ay], [bx, by]) {
  const along = [bx - ax, by - ay];
  const part = ((x - ax) * along[0] + (y - ay) * along[1]) / (along[0] ** 2 + along[1] ** 2 || 1);
  const nearest = Math.min(Math.max(part, 0), 1);
  return Math.hypot(x - ax - nearest * along[0], y - ay - nearest * along[1]);
}

/** The first candidate with the least distance, if that is in reach. */
const closest = (candidates, reach) => candidates.filter(({ away }) => away <= reach).sort((a, b) => a.away - b.away)[0] ?? null;

export class PointerDrag {
  /** Calls `drag(mechanism, want)`, `light(mechanism, dimension)` and `choose(mechanism, dimension)`. */
  constructor(picture, calls) {
    Object.assign(this, calls, { picture, canvas: picture.canvas, grabbed: null });
    this.canvas.addEventListener('pointerdown', event => this.press(event));
    this.canvas.addEventListener('pointermove', event => this.move(event));
    this.canvas.addEventListener('pointerleave', () => this.light(null, ''));
    this.canvas.addEventListener('click', event => this.click(event));
    for (const end of ['pointerup', 'pointercancel']) {
      this.canvas.addEventListener(end, ({ pointerId }) => { if (pointerId === this.grabbed?.pointerId) this.grabbed = null; });
    }
  }

  /** The joint that is nearest to a pointer, of those that can be moved. */
  joint([x, y], reach) {
    return closest(this.picture.legsSeen().filter(({ mechanism }) => !mechanism.space).flatMap(
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

  press(event) {
    const { offsetX, offsetY, button, pointerId, pointerType } = event;
    this.pressed = [offsetX, offsetY];
    // Another finger zooms, or holds a joint; another button turns.
    if (!button && !this.grabbed && !this.picture.view.pointers.size) {
      const joint = this.joint(this.pressed, GRAB[pointerType] ?? GRAB.mouse);
      if (joint) this.grabbed = { key: joint.mechanism.key, leg: joint.leg, joint: joint.joint, pointer: this.pressed, pointerId };
    }
    if (!this.grabbed) return;
    // The view leaves it alone.
    event.isTaken = true;
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
    const dragged = this.dragged;
    if (!dragged) return;
    const place = this.picture.inPlane(dragged.map, ...this.picture.from(...pointer));
    const { joint, leg } = this.grabbed;
    if (place.every(Number.isFinite)) this.drag(dragged.mechanism, { joint, leg, place });
  }

  /** The leg whose joint is dragged. */
  get dragged() {
    return this.grabbed && this.picture.legsSeen().find(
      ({ mechanism, leg }) => mechanism.key === this.grabbed.key && leg === this.grabbed.leg);
  }

  /** The ends of the line from the dragged joint to the pointer. */
  get line() {
    const from = this.dragged?.seen.get(this.grabbed.joint);
    return from ? [from, this.grabbed.pointer] : null;
  }
}
