// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The picture: markers seen at a right angle to the plane of the linkage, to scale.

const MARGIN = 44;
const SLACK = 0.06;
const SHRUNK = 10;
const GRAB = 18;
const LINE = 18;
const MOST_LINES = 100;
const FONT = "13px system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif";

/** A colour of the style sheet, which the server fills in. */
const paint = name => getComputedStyle(document.documentElement).getPropertyValue(name);

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
  return [1, 2, 5, 10].find(one => one * power >= value * 0.999) * power;
}

/** The multiples of a step between two ends; few, even so far out that adding one changes nothing. */
function multiples(step, low, high) {
  const first = Math.ceil(low / step);
  const count = Math.max(0, Math.floor(high / step) - first + 1) || 0;
  return Array.from({ length: Math.min(count, MOST_LINES) }, (_, i) => (first + i) * step);
}

/** A colour made lighter; lightness alone tells the pairs of legs apart. */
function colour([r, g, b, a], lighter) {
  const mixed = [r, g, b].map(part => Math.round(255 * (part + (1 - part) * lighter)));
  return `rgba(${mixed.join(',')},${a})`;
}

class Box {
  constructor() {
    this.low = [Infinity, Infinity];
    this.high = [-Infinity, -Infinity];
  }

  add(x, y) {
    if (x < this.low[0]) this.low[0] = x;
    if (y < this.low[1]) this.low[1] = y;
    if (x > this.high[0]) this.high[0] = x;
    if (y > this.high[1]) this.high[1] = y;
  }

  get size() {
    return Math.max(...this.high.map((high, i) => high - this.low[i]));
  }

  holds(other) {
    return [0, 1].every(i => this.low[i] <= other.low[i] && other.high[i] <= this.high[i]);
  }

  /** Return the box around both, with room for more. */
  grown(other) {
    const box = new Box();
    box.add(...this.low.map((low, i) => Math.min(low, other.low[i])));
    box.add(...this.high.map((high, i) => Math.max(high, other.high[i])));
    const slack = SLACK * box.size;
    if (!Number.isFinite(slack)) return box;
    box.low = box.low.map(low => low - slack);
    box.high = box.high.map(high => high + slack);
    return box;
  }
}

export class Picture {
  constructor(canvas, { drag }) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.drag = drag;
    this.named = true;
    this.mechanisms = [];
    this.boxes = new Map();
    this.grabbed = null;
    canvas.addEventListener('pointerdown', event => this.grab(event));
    canvas.addEventListener('pointermove', event => this.move(event));
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, () => { this.grabbed = null; });
    }
  }

  show(mechanisms) {
    this.mechanisms = mechanisms;
    this.boxes.clear();
  }

  /** Find the size of a mechanism anew. */
  refit(key) {
    this.boxes.delete(key);
  }

  draw() {
    const { canvas, context } = this;
    const pixel = window.devicePixelRatio;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * pixel) || canvas.height !== Math.round(height * pixel)) {
      canvas.width = Math.round(width * pixel);
      canvas.height = Math.round(height * pixel);
    }
    context.setTransform(pixel, 0, 0, pixel, 0, 0);
    context.clearRect(0, 0, width, height);
    const shapes = this.shapes();
    if (!shapes.length) return;
    this.fit(shapes, width, height);
    this.grid(width, height);
    const order = ['strip', 'lines', 'joints'];
    shapes.sort((a, b) => order.indexOf(a.look.kind) - order.indexOf(b.look.kind));
    for (const shape of shapes) this[shape.look.kind](shape);
    if (this.grabbed) this.ghost();
    if (this.named && this.mechanisms.length === 1) this.names(shapes);
    if (this.mechanisms.length > 1) this.titles();
  }

  /** Return what is drawn, every point as it is seen [m]. */
  shapes() {
    const shapes = [];
    this.seen = null;
    for (const mechanism of this.mechanisms) {
      for (const { look, points } of mechanism.markers.values()) {
        const [x, y, z] = axes(look.pose);
        this.seen ??= { right: x, up: y };
        const map = [this.seen.right, this.seen.up].map(way => [
          dot(way, x), dot(way, y), dot(way, z), dot(way, look.pose.slice(0, 3))]);
        const places = new Float64Array(points.length / 3 * 2);
        for (let from = 0, to = 0; from < points.length; from += 3) {
          for (const [a, b, c, d] of map) {
            places[to++] = a * points[from] + b * points[from + 1] + c * points[from + 2] + d;
          }
        }
        shapes.push({ mechanism, look, points, places, map });
      }
    }
    return shapes;
  }

  /** Choose scale and place so that everything is seen, and stays where it is while it moves. */
  fit(shapes, width, height) {
    const now = new Map();
    for (const { mechanism: { key }, places } of shapes) {
      if (!now.has(key)) now.set(key, new Box());
      for (let i = 0; i < places.length; i += 2) now.get(key).add(places[i], places[i + 1]);
    }
    const all = new Box();
    for (const [key, box] of now) {
      let known = this.boxes.get(key) ?? new Box();
      // It was never so large: something far off was drawn that is gone.
      if (box.size > 0 && known.size > SHRUNK * box.size) known = new Box();
      if (!known.holds(box)) this.boxes.set(key, known.grown(box));
      const { low, high } = this.boxes.get(key) ?? box;
      all.add(...low);
      all.add(...high);
    }
    const span = [0, 1].map(i => Math.max(all.high[i] - all.low[i], 1e-9));
    this.scale = Math.min((width - 2 * MARGIN) / span[0], (height - 2 * MARGIN) / span[1]);
    this.middle = [0, 1].map(i => (all.high[i] + all.low[i]) / 2);
    this.centre = [width / 2, height / 2];
  }

  at(x, y) {
    return [this.centre[0] + (x - this.middle[0]) * this.scale, this.centre[1] - (y - this.middle[1]) * this.scale];
  }

  from(x, y) {
    return [(x - this.centre[0]) / this.scale + this.middle[0], (this.centre[1] - y) / this.scale + this.middle[1]];
  }

  grid(width, height) {
    const { context } = this;
    const step = round(90 / this.scale);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const [left, bottom] = this.from(0, height);
    const [right, top] = this.from(width, 0);
    context.font = FONT;
    context.lineWidth = 1;
    context.strokeStyle = paint('--grid');
    context.fillStyle = paint('--faint');
    context.textAlign = 'center';
    context.textBaseline = 'bottom';
    for (const value of multiples(step, left, right)) {
      const [x] = this.at(value, 0);
      this.line(x, 0, x, height);
      if (x > 70 && x < width - 30) context.fillText(value.toFixed(digits), x, height - 5);
    }
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    for (const value of multiples(step, bottom, top)) {
      const [, y] = this.at(0, value);
      this.line(0, y, width, y);
      if (y < height - 30 && y > 12) context.fillText(value.toFixed(digits), 6, y);
    }
    context.textBaseline = 'bottom';
    context.fillText('m', 6, height - 5);
  }

  line(...ends) {
    this.context.beginPath();
    this.context.moveTo(ends[0], ends[1]);
    this.context.lineTo(ends[2], ends[3]);
    this.context.stroke();
  }

  strip({ look, places }) {
    const { context } = this;
    context.lineWidth = Math.max(1.5, look.width * this.scale);
    context.strokeStyle = colour(look.colour, 0.35);
    context.lineJoin = context.lineCap = 'round';
    context.beginPath();
    for (let i = 0; i < places.length; i += 2) context.lineTo(...this.at(places[i], places[i + 1]));
    context.stroke();
  }

  /** Call back with each leg's part of what is drawn, the palest pair first. */
  legs({ mechanism, places }, draw) {
    const { pairs, legs } = mechanism;
    const size = places.length / legs;
    if (!Number.isInteger(size)) return draw(places, 0);
    for (let leg = legs - 1; leg >= 0; leg--) {
      const pair = Math.floor(leg * pairs / legs);
      draw(places.subarray(leg * size, (leg + 1) * size), 0.65 * pair / Math.max(pairs - 1, 1));
    }
  }

  lines(shape) {
    const { context } = this;
    context.lineWidth = Math.max(2, shape.look.width * this.scale);
    context.lineCap = 'round';
    this.legs(shape, (places, lighter) => {
      context.strokeStyle = colour(shape.look.colour, lighter);
      context.beginPath();
      for (let i = 0; i < places.length; i += 4) {
        context.moveTo(...this.at(places[i], places[i + 1]));
        context.lineTo(...this.at(places[i + 2], places[i + 3]));
      }
      context.stroke();
    });
  }

  joints(shape) {
    const { context } = this;
    const radius = Math.max(3, shape.look.width * this.scale / 2);
    this.legs(shape, (places, lighter) => {
      context.fillStyle = colour(shape.look.colour, lighter);
      for (let i = 0; i < places.length; i += 2) {
        context.beginPath();
        context.arc(...this.at(places[i], places[i + 1]), radius, 0, 2 * Math.PI);
        context.fill();
      }
    });
  }

  text(words, x, y) {
    const { context } = this;
    context.lineJoin = 'round';
    context.lineWidth = 4;
    context.strokeStyle = 'white';
    context.fillStyle = paint('--ink');
    context.strokeText(words, x, y);
    context.fillText(words, x, y);
  }

  /** Write the names of the joints beside them, on the side away from the middle. */
  names(shapes) {
    const { context } = this;
    context.font = `600 ${FONT}`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    for (const { mechanism, look, places } of shapes) {
      const names = mechanism.value('points') ?? [];
      if (look.kind !== 'joints' || places.length !== 2 * names.length) continue;
      const seen = names.map((name, i) => this.at(places[2 * i], places[2 * i + 1]));
      const middle = [0, 1].map(i => seen.reduce((sum, at) => sum + at[i], 0) / seen.length);
      const away = look.width * this.scale / 2 + 12;
      names.forEach((name, i) => {
        const way = [seen[i][0] - middle[0], seen[i][1] - middle[1]];
        const size = Math.hypot(...way) || 1;
        this.text(name, seen[i][0] + way[0] / size * away, seen[i][1] + way[1] / size * away);
      });
    }
  }

  /** Write the mechanisms' names below them, none over another. */
  titles() {
    const { context } = this;
    context.font = `600 ${FONT}`;
    context.textAlign = 'center';
    context.textBaseline = 'top';
    const written = [];
    for (const { key, name } of this.mechanisms) {
      const box = this.boxes.get(key);
      if (!box) continue;
      const half = context.measureText(name).width / 2 + 4;
      let [x, y] = this.at((box.low[0] + box.high[0]) / 2, box.low[1]);
      const over = () => written.find(other =>
        Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < LINE);
      for (let other = over(); other; other = over()) y = other.y + LINE;
      written.push({ x, y, half });
      this.text(name, x, y);
    }
  }

  /** Return the angle [rad], pivot and tip of each lever that can be dragged, by mechanism. */
  *found() {
    for (const shape of this.shapes()) {
      const { mechanism, look, points } = shape;
      const names = mechanism.value('points') ?? [];
      const [pivot, tip] = ['Q', 'L'].map(name => names.indexOf(name));
      if (!mechanism.lever || look.kind !== 'joints' || pivot < 0 || tip < 0) continue;
      if (points.length !== 3 * names.length) continue;
      yield { ...shape, pivot, tip };
    }
  }

  levers() {
    return [...this.found()].map(({ mechanism, points, pivot, tip }) => [
      mechanism.key, Math.atan2(points[3 * pivot] - points[3 * tip], points[3 * tip + 1] - points[3 * pivot + 1])]);
  }

  /** Return the mechanism whose lever is under the pointer. */
  under([x, y]) {
    for (const { mechanism, places, pivot, tip } of this.found()) {
      const [q, l] = [pivot, tip].map(i => this.at(places[2 * i], places[2 * i + 1]));
      const along = [l[0] - q[0], l[1] - q[1]];
      const part = ((x - q[0]) * along[0] + (y - q[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2);
      const near = Math.min(Math.max(part, 0.2), 1);
      if (Math.hypot(x - q[0] - near * along[0], y - q[1] - near * along[1]) < GRAB) return mechanism;
    }
    return null;
  }

  grab(event) {
    const pointer = [event.offsetX, event.offsetY];
    const mechanism = this.under(pointer);
    if (!mechanism) return;
    this.grabbed = { key: mechanism.key, pointer };
    this.canvas.setPointerCapture(event.pointerId);
  }

  move(event) {
    if (!this.grabbed) {
      this.canvas.classList.toggle('lever', this.under([event.offsetX, event.offsetY]) !== null);
      return;
    }
    this.grabbed.pointer = [event.offsetX, event.offsetY];
    const lever = [...this.found()].find(({ mechanism }) => mechanism.key === this.grabbed.key);
    if (!lever) return;
    const [x, y] = this.inPlane(lever.map, ...this.from(...this.grabbed.pointer));
    const angle = Math.atan2(lever.points[3 * lever.pivot] - x, y - lever.points[3 * lever.pivot + 1]);
    this.grabbed.refused = Number.isFinite(angle) && this.drag(lever.mechanism, angle);
  }

  /** Return the point of a linkage's plane that is seen at a place. */
  inPlane([[a, b, , right], [c, d, , up]], x, y) {
    const area = a * d - b * c;
    return [(d * (x - right) - b * (y - up)) / area, (a * (y - up) - c * (x - right)) / area];
  }

  /** Draw where the lever is wanted. */
  ghost() {
    const lever = [...this.found()].find(({ mechanism }) => mechanism.key === this.grabbed.key);
    if (!lever) return;
    const { context } = this;
    context.setLineDash([6, 6]);
    context.lineWidth = 2;
    context.strokeStyle = this.grabbed.refused ? paint('--refused') : paint('--faint');
    this.line(...this.at(lever.places[2 * lever.pivot], lever.places[2 * lever.pivot + 1]), ...this.grabbed.pointer);
    context.setLineDash([]);
  }
}
