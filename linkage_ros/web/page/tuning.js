// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The parameters of a mechanism: a control for each, undo and reset, and files to download.

import { button, Choice, element, Reason, refusal, Slider } from './control.js';

const RESTED = 300;
const SWITCH = [[true, 'yes'], [false, 'no']];

const picture = () => new Promise(done => { document.getElementById('picture').toBlob(done); });

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
      element('div', { className: 'tools' }, this.undoing, this.resetting, this.reason.line),
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
    const description = {
      ...setting, label: labelled(setting, Object.keys(this.mechanism.inputs).length), title: `${meaning}\nAllowed: ${allowed}.`,
      // A dimension is displayed with its length in the picture.
      times: () => group === 'dimensions' ? this.mechanism.value('scale') : 1,
    };
    const request = (value, gesture) => this.set({ [name]: value }, gesture);
    const sides = this.mechanism.sides[name.split('.')[1]];
    if (group === 'branches') return new Choice(description, [[1, sides[0]], [-1, sides[1]]], request);
    if (kind === 'bool') return new Choice(description, SWITCH, request);
    const slider = new Slider(description, request);
    if (group === 'dimensions') this.lights(name, slider);
    return slider;
  }

  lights(name, { row }) {
    for (const event of ['pointerenter', 'focusin']) row.addEventListener(event, () => this.light(name));
    row.addEventListener('pointerleave', () => { if (!row.contains(document.activeElement)) this.light(''); });
    row.addEventListener('focusout', () => this.light(''));
  }

  /** Set values; a gesture, all of whose changes are one step of undo, has those before. */
  async set(values, gesture) {
    const { mechanism, mechanism: { first, steps } } = this;
    const before = Object.fromEntries(Object.keys(values).map(name => [name, mechanism.value(name)]));
    const answer = await mechanism.ask('set', { values });
    const isStep = Object.keys(values).some(name => first.has(name) && before[name] !== values[name]);
    if (gesture && isStep && !answer.reason && steps.at(-1)?.gesture !== gesture) steps.push({ gesture, values: before });
    this.renderTools();
    return answer;
  }

  /** Set several values at once; return whether they were accepted. */
  async put(values, gesture) {
    const { reason } = await this.set(values, gesture);
    this.reason.say(refusal(reason));
    for (const name of Object.keys(values)) this.controls.get(name)?.reason.say();
    return !reason;
  }

  async undo() {
    const step = this.mechanism.steps.pop();
    this.renderTools();
    if (!await this.put(step.values)) this.mechanism.steps.push(step);
    this.renderTools();
  }

  reset() {
    const { changed, first } = this.mechanism;
    return this.put(Object.fromEntries(changed.map(name => [name, first.get(name)])), {});
  }

  /** The buttons that download. */
  files() {
    return element('div', { className: 'tools' }, element('span', { className: 'about', textContent: 'Download' }),
      ...this.mechanism.forms.map(([form, name, title]) => button(name, () => this.download(form), { title })));
  }

  /** Let the browser save a file. */
  async download(form) {
    const { reason, text } = form === 'png' ? { text: await picture() } : await this.mechanism.ask('export', { form });
    this.reason.say(reason && `Not saved: ${reason}`);
    if (!text) return;
    const href = URL.createObjectURL(new Blob([text]));
    element('a', { download: `${this.mechanism.name}.${form}`, href }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  }

  /** Update the ranges of dimensions, once no slider is held. */
  refresh() {
    clearTimeout(this.resting);
    this.resting = setTimeout(async () => {
      const tunable = await this.mechanism.ask('tune');
      if ([...this.controls.values()].some(({ gesture }) => gesture)) return this.refresh();
      if (tunable.reason) return;
      this.mechanism.tunable = tunable;
      for (const [name, ends] of Object.entries(tunable.travel)) {
        if (ends) this.controls.get(name)?.bound?.(...ends);
      }
    }, RESTED);
  }

  update({ name, value }) {
    this.controls.get(name)?.update(value);
    if (name === 'scale') this.render();
    if (!this.mechanism.first.has(name)) return;
    this.refresh();
    this.renderTools();
  }

  renderTools() {
    this.undoing.disabled = !this.mechanism.steps.length;
    this.resetting.disabled = !this.mechanism.changed.length;
  }

  /** Light up the slider of a dimension. */
  lit(name) {
    for (const [key, { row }] of this.controls) row.classList.toggle('lit', key === name);
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
    for (const control of this.controls.values()) control.render?.();
  }
}
