// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The parameters of a mechanism: a control for each, undo and reset, and its scene as a file.

import { BY_FACTOR, Choice, element, FINE_ABOUT_ZERO, LINEAR, Reason, Slider, Switch } from './control.js';
import { download } from './files.js';

const DIMENSION = 'dimensions.';
const BRANCH = 'branches.';
const SIGNS = { 1: '+1', '-1': '−1' };
const MOVES = /\.(speed|start)$/;
const RESTED = 300;

/** A parameter's name without the part that its group in the panel implies. */
function labelled(name, inputs) {
  const [input, what] = name.split('.');
  if (MOVES.test(name)) return inputs > 1 ? `${what} of ${input}` : what;
  return name.replace(/^(dimensions|branches)\./, '');
}

function law({ name, kind, low, high }) {
  if (kind === 'integer' || name.endsWith('.start')) return LINEAR;
  if (low > 0) return BY_FACTOR;
  return low === -high ? FINE_ABOUT_ZERO : LINEAR;
}

function folding(title, children, open) {
  return element('details', { open, hidden: !children.length }, element('summary', { textContent: title }), ...children);
}

export class Tuning {
  /** Calls `light` with the dimension whose bars light up, or an empty text. */
  constructor(mechanism, connection, open, light) {
    Object.assign(this, { mechanism, connection, light });
    this.controls = new Map();
    this.reason = new Reason();
    this.inputs = [...mechanism.settings.keys()].filter(name => name.endsWith('.speed')).length;
    const groups = { speeds: [], dimensions: [], branches: [], more: [] };
    for (const setting of mechanism.settings.values()) {
      const control = this.control(setting);
      if (!control) continue;
      this.controls.set(setting.name, control);
      const group = setting.name.startsWith(DIMENSION) ? 'dimensions' : setting.name.startsWith(BRANCH) ? 'branches'
        : setting.name.endsWith('.speed') ? 'speeds' : 'more';
      groups[group].push(control.row);
    }
    this.speeds = groups.speeds;
    this.undoing = this.button('Undo', () => this.undo());
    this.resetting = this.button('Reset', () => this.reset());
    const tools = element('div', { className: 'tools' }, this.undoing, this.resetting,
      this.button('Save as scene file', () => this.save()), this.reason.line);
    this.element = element('div', {}, tools, folding('Dimensions', groups.dimensions, open),
      folding('Branches', groups.branches, open), folding('More', groups.more, false));
    this.renderTools();
    this.refresh();
  }

  button(textContent, onclick) {
    return element('button', { type: 'button', textContent, onclick });
  }

  control(setting) {
    const { name, kind, meaning, allowed, fixed, low, high } = setting;
    if (fixed) return null;
    const described = {
      ...setting, label: labelled(name, this.inputs), title: `${meaning}\nAllowed: ${allowed}.`,
      unit: /\[([^\]]+)\]/.exec(meaning)?.[1] ?? '', scale: law(setting),
      // A dimension is displayed with its length in the picture.
      times: () => name.startsWith(DIMENSION) ? this.mechanism.value('scale') ?? 1 : 1,
    };
    const request = (...about) => this.set(name, ...about);
    if (name.startsWith(BRANCH)) return new Choice(described, SIGNS, request);
    if (kind === 'bool') return new Switch(described, request);
    const ranged = low !== null && high !== null && low < high;
    if (!ranged || kind !== 'double' && kind !== 'integer') return null;
    const slider = new Slider(described, request);
    if (name.startsWith(DIMENSION)) this.lights(name, slider);
    return slider;
  }

  lights(name, { row }) {
    for (const event of ['pointerenter', 'focusin']) row.addEventListener(event, () => this.light(name));
    row.addEventListener('pointerleave', () => { if (!row.contains(document.activeElement)) this.light(''); });
    row.addEventListener('focusout', () => this.light(''));
  }

  async set(name, value, gesture, before) {
    const answer = await this.connection.ask({ op: 'set', mechanism: this.mechanism.key, values: { [name]: value } });
    if (!answer.reason && before !== value) this.mechanism.history.remember(name, before, gesture);
    this.renderTools();
    return answer;
  }

  async undo() {
    const { steps } = this.mechanism.history;
    const step = steps.pop();
    if (step && !await this.put(step.values)) steps.push(step);
    this.renderTools();
  }

  async reset() {
    const { history } = this.mechanism;
    const [values, before] = history.changes();
    if (await this.put(values)) history.steps.push({ values: before });
    this.renderTools();
  }

  /** Set several values at once; return whether they were accepted. */
  async put(values) {
    const { reason } = await this.connection.ask({ op: 'set', mechanism: this.mechanism.key, values });
    this.reason.say(reason && `Refused: ${reason}`);
    for (const name of Object.keys(values)) this.controls.get(name)?.reason.say('');
    return !reason;
  }

  async save() {
    const { name, key, playing } = this.mechanism;
    const { reason, text } = await this.connection.ask({ op: 'save', mechanism: key, values: playing });
    this.reason.say(reason && `Not saved: ${reason}`);
    if (text) download(`${name}.yaml`, text);
  }

  /** Update the ranges of dimensions, once no slider is held. */
  refresh() {
    clearTimeout(this.resting);
    this.resting = setTimeout(async () => {
      const tunable = await this.connection.ask({ op: 'tune', mechanism: this.mechanism.key });
      if ([...this.controls.values()].some(({ held }) => held)) return this.refresh();
      if (tunable.reason) return;
      this.mechanism.tunable = tunable;
      for (const [joint, [plus = SIGNS[1], minus = SIGNS[-1]]] of Object.entries(tunable.sides)) {
        this.controls.get(BRANCH + joint)?.name({ 1: plus, '-1': minus });
      }
      for (const [name, ends] of Object.entries(tunable.travel)) {
        if (ends && ends[0] < ends[1]) this.controls.get(name)?.bound(...ends);
      }
    }, RESTED);
  }

  update(name, value) {
    this.controls.get(name)?.update(value);
    if (name === 'scale') this.render();
    if (this.mechanism.history.first.has(name)) this.refresh();
    if (MOVES.test(name)) return;
    this.renderTools();
  }

  renderTools() {
    const { steps, first } = this.mechanism.history;
    this.undoing.disabled = !steps.length;
    this.resetting.disabled = [...first].every(([name, value]) => this.mechanism.value(name) === value);
  }

  /** Light up the slider of a dimension. */
  lit(name) {
    for (const [own, { row }] of this.controls) row.classList.toggle('lit', own === name);
  }

  /** Go to the slider of a dimension. */
  goTo(name) {
    const control = this.controls.get(name);
    if (!control) return;
    control.row.closest('details').open = true;
    control.range.focus({ preventScroll: true });
    control.row.scrollIntoView({ block: 'nearest' });
  }

  render() {
    for (const control of this.controls.values()) control.render();
  }
}
