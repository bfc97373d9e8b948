// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The picture: markers to scale, seen at a right angle to the plane of the linkage.

import { clamp, figures, put, units } from './control.js';
import { middle } from './pointer.js';

const MARGIN = 44;
/** What is seen is not smaller [m]. */
const MIN_SIZE = 1e-33;
const SLACK = 0.06;
const SHRUNK = 10;
const LINE = 18;
const FIGURES = 6;
const MARK = 13;
const ARROW = 90;
const HEAD = 9;
/** Where a name is tried: beside its joint from the side away from the middle on, then farther out. */
const TURNS = [1, 1.9].flatMap(ring => [0, 1, -1, 2, -2, 3, -3, 4].map(eighth => [ring, eighth * Math.PI / 4]));
const MAX_LINES = 100;
/** A linkage in space is seen from the front, from the right and above. */
const OBLIQUE = { right: [0.8, 0.6, 0], up: [-0.168, 0.224, 0.96], out: [0.576, -0.768, 0.28] };
const FONT = "13px system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif";

/** A colour of the style sheet. */
export const paint = name => getComputedStyle(document.documentElement).getPropertyValue(name);

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** The directions of a pose's x and y axes. */
function axes([, , , x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** A number of 1, 2 or 5 times a power of ten that is not below this one. */
function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].find(digit => digit * power >= value * 0.999) * power;
}

/** The multiples of a step between two ends; few even where adding a step is lost to rounding. */
export function multiples(step, low, high) {
  const first = Math.ceil(low / step);
  const count = Math.max(0, Math.floor(high / step) - first + 1) || 0;
  return Array.from({ length: Math.min(count, MAX_LINES) }, (_, i) => (first + i) * step);
}

/** Whether a text or a box is clear of others; `half` and `high` are half of its width and height. */
const isClear = ({ x, y, half, high }, others) => others.every(other => Math.abs(other.x - x) >= other.half + half || Math.abs(other.y - y) >= other.high + high);

/** How far a text is from a place. */
const apart = ({ x, y, half, high }, [left, top]) => Math.hypot(
  Math.max(Math.abs(x - left) - half, 0), Math.max(Math.abs(y - top) - high, 0));

const dark = matchMedia('(prefers-color-scheme: dark)');

/** A colour mixed with that of the paper, or of the ink. */
function mixed([r, g, b, a], part, towards) {
  const other = dark.matches === (towards === 'ink') ? 0.92 : 0.1;
  return `rgba(${[r, g, b].map(share => Math.round(255 * (share + (other - share) * part))).join(',')},${a})`;
}

/** A colour, stronger for the legs in front; all are visible against the paper. */
const colour = (rgba, front = 0) => mixed(rgba, 0.55 * front, 'ink');

/** A box along the axes. */
class Box {
  constructor() {
    this.low = [Infinity, Infinity];
    this.high = [-Infinity, -Infinity];
  }

  add(...at) {
    for (let i = 0; i < 2; i++) {
      this.low[i] = Math.min(this.low[i], at[i]);
      this.high[i] = Math.max(this.high[i], at[i]);
    }
  }

  get size() {
    return Math.max(...this.high.map((high, i) => high - this.low[i]));
  }

  join({ low, high }) {
    this.add(...low);
    this.add(...high);
    return this;
  }

  /** Grow around another box, with a margin, unless that is inside; return this one. */
  hold(box) {
    if (this.low.every((end, i) => end <= box.low[i] && box.high[i] <= this.high[i])) return this;
    const { low, high, size } = this.join(box);
    return this.join({ low: low.map(end => end - SLACK * size), high: high.map(end => end + SLACK * size) });
  }
}

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.named = true;
    /** The kind of arrows, or none. */
    this.kind = '';
    /** The view; see pointer.js. */
    this.view = null;
    this.mechanisms = [];
    /** The boxes of mechanisms, seen from a direction, and how far each frame is drawn aside. */
    this.boxes = new Map();
    this.asides = new Map();
    /** The mechanism and the dimension whose bars are lit. */
    this.lit = { mechanism: null, dimension: '' };
    this.legend = document.getElementById('legend');
  }

  show(mechanisms) {
    this.mechanisms = mechanisms;
    this.boxes.clear();
    this.asides.clear();
  }

  /** Forget the size of a mechanism. */
  refit(key) {
    this.boxes.delete(key);
  }

  draw() {
    const { canvas, context } = this;
    const pixel = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    put(canvas, { width: Math.round(width * pixel), height: Math.round(height * pixel) });
    context.setTransform(pixel, 0, 0, pixel, 0, 0);
    context.fillStyle = paint('--paper');
    context.fillRect(0, 0, width, height);
    const shapes = this.shapes();
    if (!shapes.length) return;
    // The picture is not refitted while a joint is dragged.
    if (!this.scale || !this.view.dragLine) this.fit(shapes, width, height);
    if (!this.view.turned && !this.mechanisms[0].space) this.grid(width, height, shapes[0].map);
    // Slots are drawn first, so that they do not hide bars.
    const isSlot = ({ kind }) => kind === 'slots';
    shapes.sort((a, b) => isSlot(b) - isSlot(a) || a.depth - b.depth);
    const legs = this.legsSeen(shapes);
    for (const shape of shapes) if (shape.kind !== 'joints') this[shape.kind](shape);
    this.light(legs);
    for (const shape of shapes) if (shape.kind === 'joints') this.joints(shape);
    this.arrows(legs);
    this.dragLine();
    if (this.named && legs.length === 1) this.names(legs[0]);
    if (this.mechanisms.length > 1) this.titles();
  }

  /** Return what is drawn, every point as it is seen [m]. */
  shapes() {
    const shapes = [];
    this.seen = null;
    for (const mechanism of this.mechanisms) {
      for (const marker of [...mechanism.markers.values()].flat()) {
        const { points, pose } = marker;
        const [x, y, z] = axes(pose);
        this.seen ??= this.view.axes(mechanism.space ? OBLIQUE : { right: x, up: y, out: z });
        if (this.direction !== String(this.seen.out)) this.boxes.clear();
        this.direction = String(this.seen.out);
        const depth = dot(this.seen.out, pose.slice(0, 3));
        const map = [this.seen.right, this.seen.up].map(way => [
          dot(way, x), dot(way, y), dot(way, z), dot(way, pose.slice(0, 3))]);
        map[0][3] += this.aside(mechanism);
        const places = new Float64Array(points.length / 3 * 2);
        for (let from = 0, to = 0; from < points.length; from += 3) {
          for (const [a, b, c, d] of map) {
            places[to++] = a * points[from] + b * points[from + 1] + c * points[from + 2] + d;
          }
        }
        shapes.push({ mechanism, ...marker, places, map, depth });
      }
    }
    return shapes;
  }

  /** Choose scale and place so that everything is visible, and steady during the motion. */
  fit(shapes, width, height) {
    const now = new Map();
    for (const { mechanism, places } of shapes) {
      if (!now.has(mechanism)) now.set(mechanism, new Box());
      for (let i = 0; i < places.length; i += 2) now.get(mechanism).add(places[i] - this.aside(mechanism), places[i + 1]);
    }
    const boxes = new Map();
    for (const [{ key, joints }, box] of now) {
      // It was never so large if something far off was drawn that is gone.
      const isGone = box.size > 0 && this.boxes.get(key)?.size > SHRUNK * box.size;
      if (isGone || !this.boxes.has(key)) this.boxes.set(key, new Box());
      boxes.set(joints?.frame, (boxes.get(joints?.frame) ?? new Box()).join(this.boxes.get(key).hold(box)));
    }
    const all = new Box();
    for (const [frame, { low, high, size }] of boxes) {
      // To the right of the frames before it, from the next picture on.
      const aside = all.high[0] + SLACK * size - low[0];
      this.asides.set(frame, Number.isFinite(aside) ? aside : 0);
      for (const [x, y] of [low, high]) all.add(x + this.asides.get(frame), y);
    }
    const span = [0, 1].map(i => Math.max(all.high[i] - all.low[i], MIN_SIZE));
    this.scale = this.view.zoom * Math.min((width - 2 * MARGIN) / span[0], (height - 2 * MARGIN) / span[1]);
    this.middle = [0, 1].map(i => (all.high[i] + all.low[i]) / 2);
    this.centre = [width / 2 + this.view.shift[0], height / 2 + this.view.shift[1]];
  }

  /** How far a mechanism is drawn aside. */
  aside({ joints }) {
    return this.asides.get(joints?.frame) ?? 0;
  }

  at(x, y) {
    return [this.centre[0] + (x - this.middle[0]) * this.scale, this.centre[1] - (y - this.middle[1]) * this.scale];
  }

  from(x, y) {
    return [(x - this.centre[0]) / this.scale + this.middle[0], (this.centre[1] - y) / this.scale + this.middle[1]];
  }

  grid(width, height, map) {
    const { context } = this;
    const { name, factor } = units.of('m');
    const step = round(90 / this.scale * factor) / factor;
    const said = value => figures(value * factor, FIGURES);
    // One mechanism is seen in its own plane, in which its outputs count; several in the scene's frame.
    const isOne = this.mechanisms.length === 1;
    const [across, up] = isOne ? map.map(([, , , from]) => from) : [0, 0];
    const [left, bottom] = this.from(0, height);
    const [right, top] = this.from(width, 0);
    const unit = `${name} ${isOne ? 'from its origin' : 'in the scene'}`;
    Object.assign(context, {
      font: FONT, lineWidth: 1, strokeStyle: paint('--grid'), fillStyle: paint('--faint'), textAlign: 'center', textBaseline: 'bottom',
    });
    const room = 12 + context.measureText(unit).width + 20;
    for (const value of multiples(step, left - across, right - across)) {
      const [x] = this.at(value + across, 0);
      this.line(x, 0, x, height);
      if (x > room && x < width - 30) context.fillText(said(value), x, height - 5);
    }
    Object.assign(context, { textAlign: 'left', textBaseline: 'middle' });
    for (const value of multiples(step, bottom - up, top - up)) {
      const [, y] = this.at(0, value + up);
      this.line(0, y, width, y);
      if (y < height - 30 && y > 12) context.fillText(said(value), 6, y);
    }
    context.textBaseline = 'bottom';
    context.fillText(unit, 6, height - 5);
  }

  line(...ends) {
    this.context.beginPath();
    this.context.moveTo(ends[0], ends[1]);
    this.context.lineTo(ends[2], ends[3]);
    this.context.stroke();
  }

  locus(shape) {
    this.stroke(shape, shape.places, colour(shape.colour), 1.5);
  }

  /** Draw the lines of a shape through places. */
  stroke({ width, piece }, places, style, least = 2) {
    const { context } = this;
    context.lineWidth = Math.max(least, width * this.scale);
    context.strokeStyle = style;
    context.lineJoin = context.lineCap = 'round';
    context.beginPath();
    for (let i = 0; i < places.length; i += 2) context[i % (2 * piece) ? 'lineTo' : 'moveTo'](...this.at(places[i], places[i + 1]));
    context.stroke();
  }

  /** Call back with each leg's part of a shape, the last pair first, and its closeness to the front. */
  legs({ mechanism: { legs }, piece, places }, draw) {
    const [size, last] = [places.length / legs.length, legs.at(-1)];
    if (size % (2 * piece)) return draw(places, 0);
    for (let leg = legs.length - 1; leg >= 0; leg--) draw(places.subarray(leg * size, (leg + 1) * size), last && 1 - legs[leg] / last);
  }

  lines(shape) {
    this.legs(shape, (places, front) => this.stroke(shape, places, colour(shape.colour, front)));
  }

  /** Draw slots pale, beside what moves in them. */
  slots(shape) {
    this.legs(shape, places => this.stroke(shape, places, mixed(shape.colour, 0.6, 'paper')));
  }

  /** Draw plates pale between their bars. */
  plates(shape) {
    const { context } = this;
    context.fillStyle = mixed(shape.colour, 0.8, 'paper');
    this.legs(shape, (places, front) => {
      this.fill(places, () => 1);
      context.lineWidth = Math.max(2, shape.mechanism.joints?.width / 2 * this.scale);
      context.lineJoin = 'round';
      context.strokeStyle = colour(shape.colour, front);
      context.stroke();
    });
  }

  /** Draw the marks of ground joints, which stay visible below them at any scale. */
  triangles(shape) {
    this.context.fillStyle = colour(shape.colour);
    this.legs(shape, places => this.fill(places, size => Math.max(1, MARK / size)));
  }

  /** Fill triangles, magnified about their first corner by a function of their size. */
  fill(places, magnified) {
    const { context } = this;
    context.beginPath();
    for (let i = 0; i < places.length; i += 6) {
      const [[x, y], ...others] = [0, 2, 4].map(k => this.at(places[i + k], places[i + k + 1]));
      const factor = magnified(Math.max(...others.map(([a, b]) => Math.hypot(a - x, b - y))));
      context.moveTo(x, y);
      for (const [a, b] of others) context.lineTo(x + factor * (a - x), y + factor * (b - y));
      context.closePath();
    }
    context.fill();
  }

  joints(shape) {
    const { context } = this;
    const radius = Math.max(3, shape.width * this.scale / 2);
    context.lineWidth = Math.max(1.5, radius / 2.5);
    context.fillStyle = paint('--paper');
    this.legs(shape, (places, front) => {
      context.strokeStyle = colour(shape.colour, front);
      for (let i = 0; i < places.length; i += 2) {
        context.beginPath();
        context.arc(...this.at(places[i], places[i + 1]), radius - context.lineWidth / 2, 0, 2 * Math.PI);
        context.fill();
        context.stroke();
      }
    });
  }

  text(words, x, y) {
    const { context } = this;
    const width = this.width(words);
    Object.assign(context, {
      textAlign: 'center', textBaseline: 'middle', lineJoin: 'round', lineWidth: 4, strokeStyle: paint('--paper'), fillStyle: paint('--ink'),
    });
    context.strokeText(words, x, y, width);
    context.fillText(words, x, y, width);
  }

  /** Write a text at the first of some places that is clear of what is written, if any is good at one that is. */
  label(words, places, written, isGood = () => true) {
    const free = places.filter(place => isClear(place, written));
    const place = free.find(isGood) ?? free[0];
    if (!place) return;
    written.push(place);
    this.text(words, place.x, place.y);
  }

  /** Write the names of the joints beside them, on the side away from the middle. */
  names({ mechanism, seen }) {
    const joints = [...seen.values()];
    const centre = middle(joints);
    const away = mechanism.joints.width / 2 * this.scale + 12;
    const written = joints.map(([x, y]) => ({ x, y, half: 5, high: 5 }));
    for (const [name, joint] of seen) {
      if (!this.isSeen(...joint)) continue;
      const half = this.width(name) / 2;
      const start = Math.atan2(joint[1] - centre[1], joint[0] - centre[0]);
      const places = TURNS.map(([ring, turn]) => this.inside({
        x: joint[0] + Math.cos(start + turn) * (ring * away + half - 5), y: joint[1] + Math.sin(start + turn) * ring * away, half, high: 8,
      }));
      // A name beside another's joint would be read as that joint's.
      this.label(name, places, written, place => joints.every(other => apart(place, other) >= apart(place, joint)));
    }
  }

  /** Whether a place is in the picture. */
  isSeen(x, y) {
    return x >= 0 && y >= 0 && x <= this.canvas.clientWidth && y <= this.canvas.clientHeight;
  }

  /** Shift a text so that it is not cut. */
  inside({ x, y, half, high }) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return { x: clamp(x, half + 2, width - half - 2), y: clamp(y, high + 2, height - high - 2), half, high };
  }

  /** The width of a text, which is drawn as wide as the picture at most. */
  width(words) {
    this.context.font = `600 ${FONT}`;
    return Math.min(this.context.measureText(words).width, this.canvas.clientWidth - 8);
  }

  /** Write the mechanisms' names below or above them where there is room; the list of mechanisms has all of them. */
  titles() {
    const boxes = this.mechanisms.filter(({ key }) => this.boxes.has(key)).map(mechanism => {
      const { low, high } = this.boxes.get(mechanism.key);
      const [[left, bottom], [right, top]] = [low, high].map(([x, y]) => this.at(x + this.aside(mechanism), y));
      return { title: mechanism.title, x: (left + right) / 2, y: (top + bottom) / 2, half: (right - left) / 2, high: (bottom - top) / 2 };
    });
    const gap = (place, box) => apart({ half: place.half + box.half, high: place.high + box.high, x: place.x, y: place.y }, [box.x, box.y]);
    const written = [];
    for (const box of boxes) {
      const half = this.width(box.title) / 2 + 4;
      const x = this.isSeen(box.x, 0) ? this.inside({ x: box.x, y: 0, half, high: 0 }).x : box.x;
      const others = boxes.filter(other => other !== box);
      // A title on another mechanism, or nearer to it, would be read as that mechanism's.
      const places = [1, -1, 2, -2].map(line => ({ x, y: box.y + Math.sign(line) * box.high + (line - Math.sign(line) / 2) * LINE, half, high: LINE / 2 }))
        .filter(place => place.y > LINE / 2 && place.y + LINE / 2 < this.canvas.clientHeight
          && isClear(place, others) && others.every(other => gap(place, other) >= gap(place, box)));
      this.label(box.title, places, written);
    }
  }

  /** Return the joints of each leg by name, in pixels of the view. */
  legsSeen(shapes = this.shapes()) {
    return shapes.filter(({ kind }) => kind === 'joints').flatMap(({ mechanism, places, map }) => {
      const { points, legs: { length: legs } } = mechanism;
      if (!this.scale || places.length !== 2 * points.length * legs) return [];
      return Array.from({ length: legs }, (_, leg) => ({
        mechanism, leg, map, seen: new Map(points.map((name, i) => {
          const at = 2 * (leg * points.length + i);
          return [name, this.at(places[at], places[at + 1])];
        })),
      }));
    });
  }

  /** Return the point of a linkage's plane at a place in the view. */
  inPlane([[a, b, , right], [c, d, , up]], x, y) {
    const area = a * d - b * c;
    return [(d * (x - right) - b * (y - up)) / area, (a * (y - up) - c * (x - right)) / area];
  }

  /** Light up the bars of the selected dimension. */
  light(legs) {
    const { mechanism, dimension } = this.lit;
    Object.assign(this.context, { lineCap: 'round', lineWidth: 7, strokeStyle: paint('--lit') });
    for (const { seen } of legs.filter(leg => leg.mechanism === mechanism)) {
      for (const [a, b] of mechanism.tunable.bars[dimension] ?? []) {
        if (seen.has(a) && seen.has(b)) this.line(...seen.get(a), ...seen.get(b));
      }
    }
  }

  /** Draw the requested arrows at the joints of the first legs; the longest one has a fixed length. */
  arrows(legs) {
    const length = Math.min(ARROW, this.canvas.clientHeight / 6);
    Object.assign(this.context, { lineWidth: 2, strokeStyle: paint('--ink'), fillStyle: paint('--ink') });
    let legend = '';
    for (const { mechanism: { arrows }, leg, map, seen } of legs) {
      if (!this.kind || leg) continue;
      const at = Object.entries(arrows.at).filter(([joint, [x]]) => x !== null && seen.has(joint));
      const max = Math.max(0, ...at.map(([, way]) => Math.hypot(...way)));
      const [longest] = at.find(([, way]) => Math.hypot(...way) === max) ?? [];
      for (const [joint, [x, y]] of max ? at : []) {
        const [right, up] = map.map(([a, b]) => (a * x + b * y) * length / max);
        this.arrow(seen.get(joint), [right, -up]);
      }
      if (this.mechanisms.length === 1 && arrows.unit) legend = this.explained(arrows, longest, max);
    }
    put(this.legend, { textContent: legend });
  }

  arrow([x, y], way) {
    const size = Math.hypot(...way);
    if (size < 1) return;
    const { context } = this;
    const [along, across] = way.map(part => part / size * Math.min(HEAD, size));
    const [tipX, tipY] = [x + way[0], y + way[1]];
    this.line(x, y, tipX - along / 2, tipY - across / 2);
    context.beginPath();
    context.moveTo(tipX, tipY);
    for (const side of [0.45, -0.45]) context.lineTo(tipX - along + side * across, tipY - across - side * along);
    context.fill();
  }

  /** The value of the longest arrow, and the efforts that balance the loads, in words. */
  explained({ unit, efforts = {} }, joint, max) {
    const { name, factor } = units.of(unit);
    const figure = value => value === null ? 'without bound' : figures(value, 3);
    const holds = Object.entries(efforts).map(([input, [value, of]]) => `, the ${input} holds ${figure(value)} ${of}`);
    return joint ? `longest ${this.kind}: ${figure(max * factor)} ${name} at ${joint}${holds.join('')}`
      : this.kind === 'force' ? `no loads on its joints${holds.join('')}` : `no ${this.kind}`;
  }

  /** Draw a line from the dragged joint to the pointer. */
  dragLine() {
    const ends = this.view.dragLine;
    if (!ends) return;
    const { context } = this;
    context.setLineDash([6, 6]);
    Object.assign(context, { lineWidth: 2, strokeStyle: paint('--faint') });
    this.line(...ends.flat());
    context.setLineDash([]);
  }
}
