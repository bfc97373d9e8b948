// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The parameters of a mechanism: a control for each, undo and reset, and its scene as a file.

import { button, Choice, element, Reason, Slider, Switch } from './control.js';
import { download } from './files.js';

const RESTED = 300;

/** A parameter's name without the part that its group in the panel implies. */
function labelled({ name, group }, inputs) {
  const [first, second] = name.split('.');
  // A long name is broken behind a point or an underscore, before it is anywhere else.
  if (group === 'more') return name.replace(/[._]/g, '$&\u200b');
  return inputs > 1 && (group === 'speeds' || group === 'starts') ? `${second} of ${first}` : second;
}

export class Tuning {
  /** Calls `light` with the dimension whose bars light up, or an empty text. */
  constructor(mechanism, open, light) {
    Object.assign(this, { mechanism, light, controls: new Map(), reason: new Reason() });
    this.undoing = button('Undo', () => this.undo());
    this.resetting = button('Reset', () => this.reset());
    this.speeds = this.rows('speeds');
    const folding = (title, groups, unfolded) => {
      const rows = groups.flatMap(group => this.rows(group));
      return element('details', { open: unfolded, hidden: !rows.length }, element('summary', { textContent: title }), ...rows);
    };
    this.element = element('div', {},
      element('div', { className: 'tools' }, this.undoing, this.resetting, button('Save as scene file', () => this.save()), this.reason.line),
      folding('Dimensions', ['dimensions'], open), folding('Branches', ['branches'], open), folding('More', ['starts', 'more'], false));
    this.renderTools();
    this.refresh();
  }

  /** Make the controls of a group; return their rows. */
  rows(group) {
    return this.mechanism.group(group).map(setting => {
      const control = this.control(setting);
      this.controls.set(setting.name, control);
      return control.row;
    });
  }

  control(setting) {
    const { name, kind, group, meaning, allowed } = setting;
    const [, second] = name.split('.');
    const described = {
      ...setting, label: labelled(setting, Object.keys(this.mechanism.inputs).length), title: `${meaning}\nAllowed: ${allowed}.`,
      // A dimension is displayed with its length in the picture.
      times: () => group === 'dimensions' ? this.mechanism.value('scale') ?? 1 : 1,
    };
    const request = (...about) => this.set(name, ...about);
    if (group === 'branches') return new Choice(described, this.mechanism.sides[second], request);
    if (kind === 'bool') return new Switch(described, request);
    const slider = new Slider(described, request);
    if (group === 'dimensions') this.lights(name, slider);
    return slider;
  }

  lights(name, { row }) {
    for (const event of ['pointerenter', 'focusin']) row.addEventListener(event, () => this.light(name));
    row.addEventListener('pointerleave', () => { if (!row.contains(document.activeElement)) this.light(''); });
    row.addEventListener('focusout', () => this.light(''));
  }

  async set(name, value, gesture, before) {
    const answer = await this.mechanism.ask('set', { values: { [name]: value } });
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
    const { reason } = await this.mechanism.ask('set', { values });
    this.reason.say(reason && `Refused: ${reason}`);
    for (const name of Object.keys(values)) this.controls.get(name)?.reason.say('');
    return !reason;
  }

  async save() {
    const { name, playing } = this.mechanism;
    const { reason, text } = await this.mechanism.ask('save', { values: playing });
    this.reason.say(reason && `Not saved: ${reason}`);
    if (text) download(`${name}.yaml`, text);
  }

  /** Update the ranges of dimensions, once no slider is held. */
  refresh() {
    clearTimeout(this.resting);
    this.resting = setTimeout(async () => {
      const tunable = await this.mechanism.ask('tune');
      if ([...this.controls.values()].some(({ held }) => held)) return this.refresh();
      if (tunable.reason) return;
      this.mechanism.tunable = tunable;
      for (const [name, ends] of Object.entries(tunable.travel)) {
        if (ends && ends[0] < ends[1]) this.controls.get(name)?.bound(...ends);
      }
    }, RESTED);
  }

  update(name, value) {
    this.controls.get(name)?.update(value);
    if (name === 'scale') this.render();
    if (!this.mechanism.history.first.has(name)) return;
    this.refresh();
    this.renderTools();
  }

  renderTools() {
    const { steps } = this.mechanism.history;
    this.undoing.disabled = !steps.length;
    this.resetting.disabled = !Object.keys(this.mechanism.history.changes()[0]).length;
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
