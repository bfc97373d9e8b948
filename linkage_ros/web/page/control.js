// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Units, a slider with a number, and a choice; a refused value springs back, with the reason.
// Values are in radians and metres; they are displayed so, or in degrees and millimetres.

import { ask } from './connection.js';

const WORKSHOP = { rad: ['°', 180 / Math.PI], m: ['mm', 1000] };
/** How many characters a field shows. */
const ROOM = 9;

export const units = {
  workshop: false,

  /** The displayed unit for one such as 'rad', 'm/s', 'rad/m', and its factor. */
  of(unit) {
    if (!this.workshop || !unit) return { name: unit, factor: 1 };
    const [over, under = ['', 1]] = unit.split('/').map(part => WORKSHOP[part] ?? [part, 1]);
    return { name: unit.includes('/') ? `${over[0]}/${under[0]}` : over[0], factor: over[1] / under[1] };
  },
};

/** A number of at most so many figures that has room in a field. */
export function figures(value, maxDigits) {
  for (let digits = maxDigits; digits > 1; digits--) {
    const number = Number(value.toPrecision(digits));
    const short = [String(number), number.toExponential().replace('+', '')].find(text => text.length <= ROOM);
    if (short) return short;
  }
  return value.toExponential(0).replace('+', '');
}

/** A value in its displayed unit, or a dash for none. */
export const shown = (value, unit, digits) => value === null || value === undefined ? '—' : figures(value * units.of(unit).factor, digits);

/** Leave a field; pass on the value [rad or m] of its text in a displayed unit, `factor` times smaller, or say why it has none. */
export async function read(field, unit, factor, pass, say) {
  const text = field.value.trim();
  field.blur();
  if (!text) return;
  const { value, turns, reason } = await ask({ op: 'read', text });
  if (reason) say(refusal(reason));
  else pass(turns && unit?.startsWith('rad') ? value : value / factor);
}

const STOPS = 1000;

export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Set only the properties that differ, because each change is drawn anew. */
export function put(node, properties) {
  for (const [name, value] of Object.entries(properties)) if (node[name] !== value) node[name] = value;
}

export const button = (textContent, onclick, properties = {}) => element('button', { type: 'button', textContent, onclick, ...properties });

let made = 0;
const nextId = () => `s${made += 1}`;

/** Passes on values one after another; of the waiting ones only the newest. */
export class Newest {
  constructor(pass) {
    this.pass = pass;
    this.busy = false;
  }

  async offer(value) {
    this.waiting = { value };
    if (this.busy) return;
    this.busy = true;
    while (this.waiting) {
      const { value: next } = this.waiting;
      this.waiting = null;
      await this.pass(next);
    }
    this.busy = false;
  }
}

/** The line below a control with the reason why a request was not fully granted. */
export class Reason {
  constructor(id = nextId()) {
    this.line = element('p', { className: 'reason', id, role: 'alert', hidden: true });
  }

  say(words = '') {
    put(this.line, { textContent: words, hidden: !words });
  }
}

/** Why a request was refused; an empty reason: it was not. */
export const refusal = reason => reason && `Refused: ${reason}`;

/** A number with a slider. A gesture, an object or null, lasts from its first change to its release. */
export class Slider {
  constructor({ label, title, unit, low, high, kind, group, value, digits = 6, times = () => 1 }, request) {
    const isWhole = kind === 'integer';
    const isEven = isWhole || group === 'starts';
    Object.assign(this, { unit, isWhole, isEven, digits, times, accepted: value, gesture: null });
    const id = nextId();
    this.range = element('input', { type: 'range', id, step: 1, max: STOPS });
    this.number = element('input', { type: 'text', autocomplete: 'off', ariaLabel: label });
    this.reason = new Reason(`${id}r`);
    for (const input of [this.range, this.number]) input.setAttribute('aria-describedby', `${id}r`);
    this.unitShown = element('span', { className: 'unit' });
    this.row = element('div', { className: 'row', title },
      element('label', { htmlFor: id, textContent: label }), this.range, this.number, this.unitShown, this.reason.line);
    this.requests = new Newest(async ([requested, gesture]) => this.settle(requested, await request(requested, gesture)));
    this.range.oninput = () => {
      this.gesture ??= {};
      this.number.value = this.shortened(this.chosen);
      this.offer(this.chosen);
    };
    this.range.onchange = () => this.release();
    this.number.onfocus = () => { this.gesture ??= {}; };
    this.number.onblur = () => this.release();
    this.number.oninput = () => this.explain();
    this.number.onchange = () => read(this.number, this.unit, this.factor, typed => this.offer(typed), words => this.explain(words));
    this.bound(low, high);
  }

  offer(value) {
    this.offered = value;
    this.requests.offer([value, this.gesture ?? {}]);
  }

  /** The factor from the value to the displayed number. */
  get factor() {
    return units.of(this.unit).factor * this.times();
  }

  /** The value at the slider's place: even, or fine about zero. */
  get chosen() {
    if (this.isWhole) return Number(this.range.value);
    const value = this.middle + this.half * (2 * this.range.value / STOPS - 1) ** this.power;
    return clamp(Number(value.toPrecision(5)), this.low, this.high);
  }

  /** Show the result of a request: the requested value, another value, or a refusal. */
  settle(requested, { value = requested, reason, inputs }) {
    const refused = reason && !inputs;
    if (!refused) this.accepted = value;
    const [wanted, low, high] = [requested, this.low, this.high].map(number => this.shortened(number));
    const unit = this.unitShown.textContent;
    this.explain(refused ? `Refused: ${wanted} ${unit}; the slider goes from ${low} to ${high} ${unit}. ${reason}` : reason, refused);
    if (!this.gesture && !this.requests.waiting) this.render();
  }

  explain(words, refused) {
    this.reason.say(words);
    this.row.classList.toggle('refused', !!refused);
  }

  release() {
    this.gesture = null;
    if (!this.requests.busy) this.render();
  }

  /** Set the ends of the range; without them nothing can be slid. */
  bound(low, high) {
    const power = low === -high && !this.isEven ? 3 : 1;
    Object.assign(this, { low, high, power, middle: (low + high) / 2, half: (high - low) / 2 });
    if (this.isWhole) put(this.range, { min: low, max: high });
    this.range.disabled = !(low < high);
    if (!this.gesture) this.render();
  }

  /** Show a value that was set, which another client has done if no request is pending. */
  update(value) {
    if (value !== this.accepted && !this.requests.busy) this.reason.say();
    this.follow(value);
  }

  /** Show a value that changes by itself. */
  follow(value) {
    this.accepted = value;
    if (!this.gesture && !this.requests.busy) this.render();
  }

  render() {
    put(this.unitShown, { textContent: units.of(this.unit).name });
    const part = clamp((this.accepted - this.middle) / this.half, -1, 1);
    this.range.value = this.isWhole ? this.accepted : STOPS * (Math.sign(part) * Math.abs(part) ** (1 / this.power) + 1) / 2;
    const text = this.shortened(this.accepted);
    put(this.number, { value: text });
    put(this.range, { ariaValueText: `${text} ${this.unitShown.textContent}` });
    this.row.classList.remove('refused');
  }

  shortened(value) {
    return figures(value * this.factor, this.digits);
  }
}

/** A button for each of some values, with its word; the pressed one has the present value. */
export class Choice {
  constructor({ label, title, value }, words, request) {
    this.reason = new Reason();
    this.buttons = words.map(([choice, word]) => [choice, button(word, async () => {
      const { reason } = await request(choice, {});
      this.reason.say(refusal(reason));
      if (!reason) this.update(choice);
    })]);
    this.group = element('span', { className: 'choice', role: 'group', ariaLabel: label }, ...this.buttons.map(([, node]) => node));
    this.row = element('div', { className: 'row', title }, element('span', { textContent: label }), this.group, this.reason.line);
    this.update(value);
  }

  update(value) {
    if (value !== this.value) this.reason.say();
    this.value = value;
    for (const [choice, node] of this.buttons) put(node, { ariaPressed: String(choice === value) });
  }
}
