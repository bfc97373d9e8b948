// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The panel: a slider for each number that can be changed, and the reason where it is refused.

const STOPS = 1000;
const STILL = 2000;
const RIGHT_ANGLE = Math.PI / 2;
const SETTLED = 500;
const NUMBER = /^[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?$/i;
const CRANK = /\.(speed|start)$/;

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

/** A parameter's name without what its place in the panel says. */
function labelled(name) {
  return name.replace(/^dimensions\./, '').replace(/^branches\./, 'branch ')
    .replace(/^crank(\d*)\.(.*)/, '$2 $1').trim();
}

function law({ name, kind, low, high }) {
  if (kind === 'integer' || name.endsWith('.start')) return LINEAR;
  if (low > 0) return BY_FACTOR;
  return low === -high ? FINE_ABOUT_ZERO : LINEAR;
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** The number that a text says, a decimal comma taken as a point; NaN if it says none. */
const read = text => NUMBER.test(text) ? Number(text.replace(',', '.')) : NaN;

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Passes on values one after the other; of those that wait only the newest. */
class Newest {
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

/** The line below a control that says why not all was done that was asked for. */
class Reason {
  constructor(id) {
    this.line = element('p', { className: 'reason', id, hidden: true });
    this.line.setAttribute('role', 'alert');
  }

  say(words) {
    this.line.textContent = words;
    this.line.hidden = !words;
    this.since = performance.now();
  }

  /** Forget it, for what somebody else does; what one did oneself may be heard of late. */
  fade() {
    if (performance.now() - this.since > SETTLED) this.say('');
  }
}

/** A number with a slider; what is refused springs back, with the reason below. */
class Slider {
  constructor({ label, title, unit, low, high, kind, value, scale, step, digits = 6 }, request) {
    Object.assign(this, { low, high, kind, scale, digits, accepted: value, held: false });
    const id = `s${Slider.made = (Slider.made ?? 0) + 1}`;
    this.range = element('input', { type: 'range', id });
    this.range.min = kind === 'integer' ? low : 0;
    this.range.max = kind === 'integer' ? high : STOPS;
    this.range.step = kind === 'integer' ? step || 1 : 1;
    this.number = element('input', { type: 'text', inputMode: 'decimal', autocomplete: 'off', ariaLabel: label });
    this.reason = new Reason(`${id}r`);
    this.answer = element('p', { className: 'answer', hidden: true });
    for (const input of [this.range, this.number]) input.setAttribute('aria-describedby', `${id}r`);
    this.row = element('div', { className: 'row', title },
      element('label', { htmlFor: id, textContent: label }), this.range, this.number,
      element('span', { className: 'unit', textContent: unit }), this.answer, this.reason.line);
    this.asked = new Newest(async wanted => this.settle(wanted, await request(wanted)));
    this.range.oninput = () => {
      this.held = true;
      this.number.value = this.shortened(this.chosen());
      this.offer(this.chosen());
    };
    this.range.onchange = () => this.release();
    this.number.onfocus = () => { this.held = true; };
    this.number.onblur = () => this.release();
    this.number.oninput = () => { this.mistyped = false; this.explain(''); };
    this.number.onchange = () => {
      this.type(this.number.value.trim());
      this.number.blur();
    };
    this.render();
  }

  offer(value) {
    this.mistyped = false;
    this.asked.offer(value);
  }

  type(text) {
    const value = read(text);
    this.mistyped = text !== '' && !Number.isFinite(value);
    if (this.mistyped) this.explain(`Refused: ${text} is not a number that can be set`);
    else if (text) this.offer(value);
  }

  chosen() {
    if (this.kind === 'integer') return Number(this.range.value);
    const value = this.scale.value(this.range.value / STOPS, this.low, this.high);
    return clamp(Number(value.toPrecision(4)), this.low, this.high);
  }

  /** Show what came of it: all that was wanted, another value, or a refusal. */
  settle(wanted, answer) {
    const refused = answer.reason && answer.value === undefined;
    if (!refused) this.accepted = answer.value ?? wanted;
    if (!this.mistyped) this.explain(refused ? `Refused: ${answer.reason}` : answer.reason, refused);
    this.told?.(answer);
    if (!this.held && !this.asked.waiting) this.render();
  }

  explain(words, refused) {
    this.reason.say(words);
    this.row.classList.toggle('refused', !!refused);
  }

  release() {
    this.held = false;
    if (!this.asked.busy) this.render();
  }

  /** Show a value that somebody else has set. */
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
    if (this.accepted === null || this.accepted === undefined) return;
    const place = this.kind === 'integer' ? this.accepted
      : STOPS * clamp(this.scale.place(this.accepted, this.low, this.high), 0, 1);
    this.range.value = place;
    this.number.value = this.shortened(this.accepted);
    this.row.classList.remove('refused');
  }

  shortened(value) {
    return String(Number(value.toPrecision(this.digits)));
  }
}

/** A switch. */
class Switch {
  constructor({ label, title, value }, request) {
    const id = `s${Slider.made = (Slider.made ?? 0) + 1}`;
    this.box = element('input', { type: 'checkbox', id, checked: value });
    this.reason = new Reason(`${id}r`);
    this.row = element('div', { className: 'row', title },
      element('label', { htmlFor: id, textContent: label }), this.box, this.reason.line);
    this.box.onchange = async () => {
      const { reason } = await request(this.box.checked);
      this.reason.say(reason && `Refused: ${reason}`);
      if (reason) this.box.checked = !this.box.checked;
    };
  }

  update(value) {
    if (value !== this.box.checked) this.reason.fade();
    this.box.checked = value;
  }
}

/** The sliders of one mechanism. */
class Section {
  constructor(mechanism, connection, folded) {
    const { key, name, settings, lever } = mechanism;
    this.mechanism = mechanism;
    this.connection = connection;
    this.controls = new Map();
    this.still = element('p', { className: 'still', hidden: true });
    const parts = [this.title(mechanism), this.still];
    const groups = { crank: [], lever: [], dimensions: [], more: [] };
    for (const setting of settings.values()) {
      const control = this.control(setting);
      if (!control) continue;
      this.controls.set(setting.name, control);
      const group = CRANK.test(setting.name) ? 'crank' : setting.name.split('.')[0];
      (groups[group] ?? groups.more).push(control.row);
    }
    if (lever) groups.lever.push(this.leverSlider().row);
    parts.push(...groups.crank, ...groups.lever);
    if (groups.dimensions.length) parts.push(folding('Dimensions', groups.dimensions, !folded));
    if (groups.more.length) parts.push(folding('More', groups.more, false));
    this.element = element('section', { ariaLabel: name }, ...parts);
    this.element.dataset.key = key;
  }

  title({ name, settings }) {
    const type = settings.get('type')?.value ?? '';
    const heading = element('header', {}, element('h2', { textContent: name }),
      element('span', { className: 'about', textContent: type === name ? '' : type }));
    this.speeds = new Map([...settings].filter(([field]) => field.endsWith('.speed'))
      .map(([field, { value }]) => [field, value || 1]));
    if (this.speeds.size) {
      this.button = element('button', { onclick: () => this.stopOrTurn() });
      heading.append(this.button);
      this.renderButton();
    }
    return heading;
  }

  get turns() {
    return [...this.speeds.keys()].some(name => this.mechanism.value(name));
  }

  stopOrTurn() {
    const stop = this.turns;
    for (const [name, speed] of this.speeds) this.controls.get(name).offer(stop ? 0 : speed);
  }

  renderButton() {
    for (const name of this.speeds.keys()) {
      this.speeds.set(name, this.mechanism.value(name) || this.speeds.get(name));
    }
    this.button.textContent = this.turns ? 'Stop' : 'Turn';
  }

  control(setting) {
    const { name, kind, meaning, allowed, fixed, low, high } = setting;
    const described = {
      ...setting, label: labelled(name),
      title: `${meaning}\nMay be: ${allowed}.`, unit: /\[([^\]]+)\]/.exec(meaning)?.[1] ?? '',
      scale: law(setting),
    };
    const request = value => this.connection.ask(
      { op: 'set', mechanism: this.mechanism.key, values: { [name]: value } });
    if (fixed) return null;
    if (kind === 'bool') return new Switch(described, request);
    const ranged = low !== null && high !== null && low < high;
    return ranged && (kind === 'double' || kind === 'integer') ? new Slider(described, request) : null;
  }

  leverSlider() {
    this.lever = new Slider({
      label: 'lever', unit: 'rad', kind: 'double', value: 0, digits: 3, low: -RIGHT_ANGLE, high: RIGHT_ANGLE, scale: LINEAR,
      title: 'Lever angle [rad]. Drag it here or in the picture: the servo_inverse service says\n'
        + 'which crank angle puts the lever there, and the crank is stopped at it.',
    }, angle => this.connection.ask({ op: 'drag', mechanism: this.mechanism.key, angle }));
    this.lever.told = ({ servo, reduction }) => {
      this.lever.answer.hidden = servo === undefined;
      if (servo === undefined) return;
      const ratio = reduction === null ? '' : `, d lever / d servo ${reduction.toFixed(4)}`;
      this.lever.answer.textContent = `servo ${servo.toFixed(4)} rad (${(servo * 180 / Math.PI).toFixed(1)}°)${ratio}`;
    };
    return this.lever;
  }

  update(name, value) {
    this.controls.get(name)?.update(value);
    if (this.speeds.has(name)) this.renderButton();
  }
}

function folding(title, rows, open) {
  return element('details', { open }, element('summary', { textContent: title }), ...rows);
}

/** All sections that are shown. */
export class Panel {
  constructor(place, connection) {
    this.place = place;
    this.connection = connection;
    this.sections = new Map();
    this.built = '';
  }

  /** Show mechanisms; sections that stay as they are keep what is unfolded and typed. */
  show(mechanisms, folded) {
    const built = JSON.stringify([folded, mechanisms.map(({ key, lever, settings }) => [
      key, lever, [...settings.values()].map(({ value, ...rest }) => rest)])]);
    if (built !== this.built) {
      this.built = built;
      this.sections = new Map(mechanisms.map(one => [one.key, new Section(one, this.connection, folded)]));
      this.place.replaceChildren(...[...this.sections.values()].map(section => section.element));
      return;
    }
    for (const { key, settings } of mechanisms) {
      for (const { name, value } of settings.values()) this.update(key, name, value);
    }
  }

  update(key, name, value) {
    this.sections.get(key)?.update(name, value);
  }

  /** Ask for a lever angle; return whether the last one could not be reached. */
  drag(key, angle) {
    const slider = this.sections.get(key)?.lever;
    if (!slider) return false;
    slider.offer(angle);
    return !slider.reason.line.hidden;
  }

  /** Let the lever sliders follow the levers. */
  follow(levers) {
    for (const [key, angle] of levers) this.sections.get(key)?.lever?.follow(angle);
  }

  /** Say which mechanisms send nothing. */
  check(now) {
    for (const { mechanism, still } of this.sections.values()) {
      const silent = now - mechanism.heard;
      still.hidden = silent < STILL;
      still.textContent = `No markers for ${Math.round(silent / 1000)} s`;
    }
  }
}
