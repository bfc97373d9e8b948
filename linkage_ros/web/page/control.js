// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A slider with a number, a choice and a switch; a refused value springs back, with the reason.

import { figures, units } from './units.js';

const STOPS = 1000;
const FINE = 0.1;
const SETTLED = 500;
const NUMBER = /^[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?$/i;

/** How a slider's place in [0, 1] becomes a value, and back. */
const LINEAR = {
  value: (place, low, high) => low + (high - low) * place,
  place: (value, low, high) => (value - low) / (high - low),
};
const BY_FACTOR = {
  value: (place, low, high) => low * (high / low) ** place,
  place: (value, low, high) => Math.log(value / low) / Math.log(high / low),
};
const FINE_ABOUT_ZERO = {
  value: (place, low, high) => high * (2 * place - 1) ** 3,
  place: (value, low, high) => (Math.cbrt(value / high) + 1) / 2,
};

function law({ kind, group, low, high }) {
  if (kind === 'integer' || group === 'starts') return LINEAR;
  if (low > 0) return BY_FACTOR;
  return low === -high ? FINE_ABOUT_ZERO : LINEAR;
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Evaluates arithmetic such as pi/2 or 90deg by `ask`, which the page sets. */
export const arithmetic = { ask: null };

/** The number in rad or m of a text in a unit that is `factor` times smaller; NaN if it is invalid. */
export async function typed(text, unit, factor) {
  if (NUMBER.test(text)) return Number(text.replace(',', '.')) / factor;
  const { value = NaN, turns } = await arithmetic.ask(text);
  return turns && unit?.startsWith('rad') ? value : value / factor;
}

/** Why a text is refused that says no number. */
export const noNumber = text => `Refused: ${text} is not a number that can be set`;

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
    this.line = element('p', { className: 'reason', id, hidden: true });
    this.line.setAttribute('role', 'alert');
  }

  say(words) {
    this.line.textContent = words;
    this.line.hidden = !words;
    this.since = performance.now();
  }

  /** Clear it after a change by another client; a late notice of one's own change is ignored. */
  fade() {
    if (performance.now() - this.since > SETTLED) this.say('');
  }
}

/** A number with a slider. A gesture lasts from its first change to its release. */
export class Slider {
  constructor({ label, title, unit, low, high, kind, group, value, digits = 6, times = () => 1 }, request) {
    const scale = law({ kind, group, low, high });
    Object.assign(this, { unit, low, high, kind, scale, digits, times, accepted: value, held: false, gesture: {} });
    const id = nextId();
    this.range = element('input', { type: 'range', id });
    this.range.min = kind === 'integer' ? low : 0;
    this.range.max = kind === 'integer' ? high : STOPS;
    this.range.step = kind === 'integer' ? 1 : FINE;
    this.number = element('input', { type: 'text', autocomplete: 'off', ariaLabel: label });
    this.reason = new Reason(`${id}r`);
    for (const input of [this.range, this.number]) input.setAttribute('aria-describedby', `${id}r`);
    this.unitShown = element('span', { className: 'unit' });
    this.row = element('div', { className: 'row', title },
      element('label', { htmlFor: id, textContent: label }), this.range, this.number, this.unitShown, this.reason.line);
    this.asked = new Newest(async ([requested, gesture]) => this.settle(
      requested, await request(requested, gesture, this.accepted)));
    this.range.oninput = () => this.slid();
    this.range.onchange = () => this.release();
    this.range.onkeydown = event => this.key(event);
    this.number.onfocus = () => { this.held = true; };
    this.number.onblur = () => this.release();
    this.number.oninput = () => { this.mistyped = false; this.explain(''); };
    this.number.onchange = () => {
      this.type(this.number.value.trim());
      this.number.blur();
    };
    this.render();
  }

  slid() {
    this.held = true;
    this.number.value = this.shortened(this.chosen());
    this.offer(this.chosen());
  }

  /** An arrow key moves by one stop, with Shift by a tenth of it. */
  key(event) {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way || this.kind === 'integer') return;
    event.preventDefault();
    this.range.value = Number(this.range.value) + way * (event.shiftKey ? FINE : 1);
    this.slid();
    this.release();
  }

  offer(value) {
    this.mistyped = false;
    this.offered = value;
    this.asked.offer([value, this.gesture]);
  }

  /** The present value, or the requested one while a request is pending. */
  get expected() {
    return this.asked.busy ? this.offered : this.accepted;
  }

  /** The factor from the value to the displayed number. */
  get factor() {
    return units.of(this.unit).factor * this.times();
  }

  async type(text) {
    const value = text ? await typed(text, this.unit, this.factor) : 0;
    this.mistyped = !Number.isFinite(value);
    if (this.mistyped) this.explain(noNumber(text));
    else if (text) this.offer(value);
  }

  chosen() {
    if (this.kind === 'integer') return Number(this.range.value);
    const value = this.scale.value(this.range.value / STOPS, this.low, this.high);
    return clamp(Number(value.toPrecision(5)), this.low, this.high);
  }

  /** Show the result of a request: the requested value, another value, or a refusal. */
  settle(requested, answer) {
    const refused = answer.reason && answer.value === undefined;
    if (!refused) this.accepted = answer.value ?? requested;
    if (!this.mistyped) this.explain(refused ? `Refused: ${answer.reason}` : answer.reason, refused);
    if (!this.held && !this.asked.waiting) this.render();
  }

  explain(words, refused) {
    this.reason.say(words);
    this.row.classList.toggle('refused', !!refused);
  }

  release() {
    this.held = false;
    this.gesture = {};
    if (!this.asked.busy) this.render();
  }

  /** Set the ends of the range. */
  bound(low, high) {
    [this.low, this.high] = [low, high];
    if (!this.held) this.render();
  }

  /** Show a value that another client has set. */
  update(value) {
    if (value !== this.accepted) this.reason.fade();
    this.follow(value);
  }

  /** Show a value that changes by itself. */
  follow(value) {
    this.accepted = value;
    if (!this.held && !this.asked.busy) this.render();
  }

  render() {
    put(this.unitShown, { textContent: units.of(this.unit).name });
    if (this.accepted === null || this.accepted === undefined) return;
    const place = this.kind === 'integer' ? this.accepted
      : STOPS * clamp(this.scale.place(this.accepted, this.low, this.high), 0, 1);
    this.range.value = place;
    const text = this.shortened(this.accepted);
    put(this.number, { value: text });
    put(this.range, { ariaValueText: `${text} ${this.unitShown.textContent}` });
    this.row.classList.remove('refused');
  }

  shortened(value) {
    return figures(value * this.factor, this.digits);
  }
}

/** A button for each of the values 1 and -1; the pressed one has the present value. */
export class Choice {
  constructor({ label, title, value }, words, request) {
    this.reason = new Reason();
    this.buttons = new Map([1, -1].map((sign, i) => [sign, button(words[i], async () => {
      const { reason } = await request(sign, {}, this.value);
      this.reason.say(reason && `Refused: ${reason}`);
      if (!reason) this.update(sign);
    })]));
    this.group = element('span', { className: 'choice', ariaLabel: label }, ...this.buttons.values());
    this.group.setAttribute('role', 'group');
    this.row = element('div', { className: 'row', title }, element('span', { textContent: label }), this.group, this.reason.line);
    this.update(value);
  }

  update(value) {
    if (value !== this.value) this.reason.fade();
    this.value = value;
    for (const [sign, one] of this.buttons) one.setAttribute('aria-pressed', sign === value);
  }

  render() {}
}

/** A switch. */
export class Switch {
  constructor({ label, title, value }, request) {
    const id = nextId();
    this.box = element('input', { type: 'checkbox', id, checked: value });
    this.reason = new Reason(`${id}r`);
    this.row = element('div', { className: 'row', title },
      element('label', { htmlFor: id, textContent: label }), this.box, this.reason.line);
    this.box.onchange = async () => {
      const { reason } = await request(this.box.checked, {}, !this.box.checked);
      this.reason.say(reason && `Refused: ${reason}`);
      if (reason) this.box.checked = !this.box.checked;
    };
  }

  update(value) {
    if (value !== this.box.checked) this.reason.fade();
    this.box.checked = value;
  }

  render() {}
}
