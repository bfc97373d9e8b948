// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The motion of a mechanism: a slider for each input, play and step, and its present outputs.

import { isOpen } from './connection.js';
import { button, element, Newest, put, read, Reason, shown, Slider, units } from './control.js';

const STEP = Math.PI / 180;
const STEPS_A_STROKE = 100;
const FIGURES = 5;
const FIGURES_OF_MANY = 3;

/** What is reached, in the units that are shown. */
function inWords({ name, arcs, unit }) {
  const ends = arcs.map(([low, high]) => `[${shown(low, unit, FIGURES)}, ${shown(high, unit, FIGURES)}]`);
  return `${name} reaches ${ends.join(' or ')} ${units.of(unit).name}`;
}

/** An angle plus the whole turns that bring it nearest to another. */
export const beside = (value, other, turn) => turn ? value + turn * Math.round((other - value) / turn) : value;

/** The slider of an input, which follows it, with buttons for a step back and on. */
class InputSlider extends Slider {
  constructor(name, input, value, want) {
    const [low, high] = input.ends;
    super({
      label: name, unit: input.unit, kind: 'double', group: 'starts', value, digits: FIGURES, low, high,
      title: `The ${name} [${input.unit}]. Moved by hand it stops there.`,
    }, async requested => {
      const answer = await want({ output: name, value: requested });
      return answer.inputs ? { ...answer, value: this.beside(answer.inputs[name]) } : answer;
    });
    this.input = input;
    this.range.before(this.button('−', `Step the ${name} back`, -1));
    this.range.after(this.button('+', `Step the ${name} on`, 1));
    this.row.classList.add('input');
  }

  button(sign, title, way) {
    return button(sign, () => {
      const step = way * (this.unit === 'rad' ? STEP : (this.high - this.low) / STEPS_A_STROKE);
      this.offer(this.beside((this.requests.busy ? this.offered : this.accepted) + step));
    }, { title, ariaLabel: title });
  }

  /** An angle plus the whole turns that put it on the slider. */
  beside(value) {
    return beside(value, this.middle, this.input.turn);
  }

  show(input, value) {
    const { ends: [low, high] } = this.input = input;
    if (low !== this.low || high !== this.high) this.bound(low, high);
    this.follow(this.beside(value));
  }
}

/** An output: its value, which is editable with a single input, and d output / d input. */
class OutputRow {
  constructor(name, count, want, say) {
    const editable = this.editable = count === 1;
    this.value = editable ? element('input', { type: 'text', autocomplete: 'off', ariaLabel: name }) : element('span');
    this.unit = element('span', { className: 'unit' });
    this.rates = Array.from({ length: count }, () => element('td'));
    this.row = element('tr', {}, element('th', { scope: 'row' }, element('span', { textContent: name })),
      element('td', {}, this.value, ' ', this.unit), ...this.rates);
    this.value.onchange = () => {
      const { unit } = this.output;
      read(this.value, unit, units.of(unit).factor, value => want({ output: name, value }), say);
    };
    this.value.onblur = () => this.render();
  }

  render() {
    const { value, unit, rates } = this.output;
    if (document.activeElement !== this.value) put(this.value, { [this.editable ? 'value' : 'textContent']: shown(value, unit, FIGURES) });
    put(this.unit, { textContent: units.of(unit).name });
    this.inputs.forEach((input, i) => {
      const ratio = `${unit}/${input.unit}`;
      const { name } = units.of(ratio);
      const textContent = shown(rates[i], ratio, this.editable ? FIGURES : FIGURES_OF_MANY);
      put(this.rates[i], { title: name, textContent: textContent + (this.editable && unit !== input.unit ? ` ${name}` : '') });
    });
  }
}

/** The part of the panel that moves one mechanism; calls `onshow` when its pose has been received. */
export class Motion {
  constructor(mechanism, open, refuse) {
    Object.assign(this, { mechanism, inputs: new Map(), outputs: new Map(), reason: new Reason() });
    this.play = button('', () => this.stopOrPlay(), { hidden: !mechanism.group('speeds').length });
    this.place = element('div', { className: 'inputs' });
    this.table = element('table');
    this.folding = element('details', { open, hidden: true, ontoggle: () => this.renderOutputs() }, element('summary', { textContent: 'Outputs', title: 'Coordinates count from the origin of its own plane' }), this.table);
    this.element = element('div', {}, this.place, this.reason.line, this.folding);
    this.target = new Newest(async want => {
      const answer = await this.want(want);
      this.reason.say(answer.reason);
      if (isOpen()) refuse(answer.reason);
    });
    this.renderPlay();
  }

  get moves() {
    return this.mechanism.group('speeds').some(({ value }) => value);
  }

  stopOrPlay() {
    const values = Object.fromEntries(Object.entries(this.mechanism.inputs).map(([name, { speed }]) => [`${name}.speed`, this.moves ? 0 : speed]));
    this.mechanism.ask('set', { values }).then(answer => this.reason.say(answer.reason));
  }

  renderPlay() {
    put(this.play, { textContent: this.moves ? 'Stop' : 'Play' });
  }

  /** Request a value of an output, or a place of a joint. */
  async want(want) {
    const answer = await this.mechanism.ask('pose', { want });
    if (answer.inputs) this.show(answer);
    if (answer.reach) answer.reason = inWords(answer.reach);
    return answer;
  }

  /** Request the present pose, with a kind of arrows or none. */
  async poll(arrows) {
    if (this.polling || !isOpen()) return;
    this.polling = true;
    const answer = await this.mechanism.ask('pose', { arrows });
    this.polling = false;
    if (answer.inputs) this.show(answer);
    else if (!this.inputs.size) this.reason.say(answer.reason);
  }

  show({ inputs, outputs, arrows }) {
    if (arrows) this.mechanism.arrows = arrows;
    const names = [...Object.keys(inputs), ...Object.keys(outputs)].join();
    if (names !== this.built) this.build(names, inputs, outputs);
    for (const [name, value] of Object.entries(inputs)) this.inputs.get(name).show(this.mechanism.inputs[name], value);
    this.onshow();
    for (const [name, output] of Object.entries(outputs)) Object.assign(this.outputs.get(name), { output, inputs: Object.values(this.mechanism.inputs) });
    this.renderOutputs();
  }

  build(names, inputs, outputs) {
    this.built = names;
    this.reason.say();
    const want = async what => {
      const answer = await this.want(what);
      if (!(what.output in inputs)) this.reason.say(answer.reason);
      return answer;
    };
    const all = Object.keys(inputs);
    this.inputs = new Map(all.map(name => [name, new InputSlider(name, this.mechanism.inputs[name], inputs[name], want)]));
    this.outputs = new Map(Object.keys(outputs).map(name => [name, new OutputRow(name, all.length, want, words => this.reason.say(words))]));
    this.place.replaceChildren(...[...this.inputs.values()].map(({ row }) => row));
    const head = (...children) => element('th', { scope: 'col' }, ...children);
    this.table.replaceChildren(
      element('thead', {}, element('tr', {}, head('output'), head('value'), ...all.map(name => head('d / d ', element('span', { textContent: name }))))),
      element('tbody', {}, ...[...this.outputs.values()].map(({ row }) => row)));
    this.folding.hidden = !this.outputs.size;
  }

  render() {
    for (const slider of this.inputs.values()) slider.render();
    this.renderOutputs();
  }

  renderOutputs() {
    if (this.folding.open) for (const row of this.outputs.values()) row.render();
  }
}
