// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The motion of a mechanism: a slider for each input, play and step, and its present outputs.

import { element, LINEAR, Newest, noNumber, put, Reason, Slider, typed } from './control.js';
import { figures, units } from './units.js';

const STEP = Math.PI / 180;
const STEPS_A_STROKE = 100;
const SECONDS_A_STROKE = 3;
const FIGURES = 5;
const FIGURES_OF_MANY = 3;

function button(textContent, ariaLabel, onclick) {
  return element('button', { type: 'button', textContent, ariaLabel, title: ariaLabel, onclick });
}

function shown(value, unit, digits = FIGURES) {
  if (value === null) return '—';
  return figures(value * units.of(unit).factor, digits);
}

/** What is reached, in the units that are shown. */
function inWords({ name, arcs, unit }) {
  const ends = arcs.map(([low, high]) => `[${shown(low, unit)}, ${shown(high, unit)}]`);
  return `${name} reaches ${ends.join(' or ')} ${units.of(unit).name}`;
}

/** An input: its slider, which follows it, and buttons for a step back and on. */
class InputRow {
  constructor(name, input, want) {
    this.turns = input.unit === 'rad';
    this.slider = new Slider({
      label: name, unit: input.unit, kind: 'double', value: input.value, digits: FIGURES, scale: LINEAR, ...this.ends(input),
      title: `The ${name} [${input.unit}]. Moved by hand it stops there.`,
    }, async value => {
      const answer = await want({ output: name, value });
      return answer.inputs ? { ...answer, value: this.beside(answer.inputs[name].value) } : answer;
    });
    this.slider.range.before(button('−', `Step the ${name} back`, () => this.step(-1)));
    this.slider.range.after(button('+', `Step the ${name} on`, () => this.step(1)));
    this.slider.row.classList.add('input');
  }

  ends({ arcs }) {
    return { low: Math.min(...arcs.map(arc => arc[0])), high: Math.max(...arcs.map(arc => arc[1])) };
  }

  /** An angle plus the whole turns that put it on the slider. */
  beside(value) {
    const { low, high } = this.slider;
    return this.turns ? value - 2 * Math.PI * Math.round((value - (low + high) / 2) / (2 * Math.PI)) : value;
  }

  step(way) {
    const { low, high, expected } = this.slider;
    const requested = expected + way * (this.turns ? STEP : (high - low) / STEPS_A_STROKE);
    this.slider.offer(this.turns ? this.beside(requested) : requested);
  }

  show(input) {
    const { low, high } = this.ends(input);
    if (low !== this.slider.low || high !== this.slider.high) this.slider.bound(low, high);
    this.slider.follow(this.beside(input.value));
  }
}

/** An output: its value, which is editable with a single input, and d output / d input. */
class OutputRow {
  constructor(name, editable, count, want, say) {
    this.editable = editable;
    this.value = editable
      ? element('input', { type: 'text', autocomplete: 'off', ariaLabel: name })
      : element('span');
    this.unit = element('span', { className: 'unit' });
    this.rates = Array.from({ length: count }, () => element('td'));
    this.row = element('tr', {}, element('th', { scope: 'row' }, element('span', { textContent: name })),
      element('td', {}, this.value, ' ', this.unit), ...this.rates);
    this.value.onchange = async () => {
      const { unit } = this.output;
      const text = this.value.value.trim();
      const value = text ? await typed(text, unit, units.of(unit).factor) : NaN;
      this.value.blur();
      if (Number.isFinite(value)) want({ output: name, value });
      else say({ reason: text && noNumber(text) });
      this.render();
    };
    this.value.onblur = () => this.render();
  }

  show(output, inputs) {
    this.output = output;
    this.inputs = inputs;
    this.render();
  }

  render() {
    const { value, unit, rates } = this.output;
    if (document.activeElement !== this.value) put(this.value, { [this.editable ? 'value' : 'textContent']: shown(value, unit) });
    put(this.unit, { textContent: units.of(unit).name });
    this.inputs.forEach((input, i) => {
      const ratio = `${unit}/${input.unit}`;
      const { name } = units.of(ratio);
      const alone = this.inputs.length === 1;
      const textContent = shown(rates[i], ratio, alone ? FIGURES : FIGURES_OF_MANY);
      put(this.rates[i], { title: name, textContent: textContent + (alone && unit !== input.unit ? ` ${name}` : '') });
    });
  }
}

/** The part of the panel that moves one mechanism; calls `onshow` when its pose has been received. */
export class Motion {
  constructor(mechanism, connection, open, refuse) {
    this.mechanism = mechanism;
    this.connection = connection;
    this.speeds = new Map([...mechanism.settings.keys()].filter(name => name.endsWith('.speed')).map(name => [name, 0]));
    this.play = button('', '', () => this.stopOrPlay());
    this.play.hidden = !this.speeds.size;
    this.inputs = new Map();
    this.outputs = new Map();
    this.place = element('div', { className: 'inputs' });
    this.table = element('table');
    this.reason = new Reason();
    this.folding = element('details', { open, hidden: true }, element('summary', { textContent: 'Outputs', title: 'Coordinates count from the origin of its own plane' }), this.table);
    this.element = element('div', {}, this.place, this.reason.line, this.folding);
    this.dragged = new Newest(async want => {
      const answer = await this.want(want);
      this.say(answer);
      if (this.connection.opened) refuse(answer.reason);
    });
    this.renderPlay();
  }

  get moves() {
    return [...this.speeds.keys()].some(name => this.mechanism.value(name));
  }

  stopOrPlay() {
    const values = Object.fromEntries([...this.speeds].map(([name, speed]) => [name, this.moves ? 0 : speed || this.usual(name)]));
    this.connection.ask({ op: 'set', mechanism: this.mechanism.key, values }).then(answer => this.say(answer));
  }

  /** The default speed of an input that has not moved yet. */
  usual(name) {
    const row = this.inputs.get(name.split('.')[0]);
    return !row || row.turns ? 1 : (row.slider.high - row.slider.low) / SECONDS_A_STROKE;
  }

  /** The speeds of the inputs when it plays. */
  get playing() {
    return Object.fromEntries([...this.speeds].filter(([, speed]) => speed));
  }

  /** The speed of the first input when it plays. */
  get speed() {
    const name = `${this.inputs.keys().next().value}.speed`;
    return this.playing[name] ?? this.usual(name);
  }

  /** The present inputs, and whether the first is an angle. */
  get present() {
    return [...this.inputs.values()].map(({ slider }) => slider.accepted);
  }

  get turns() {
    return this.inputs.values().next().value?.turns;
  }

  renderPlay() {
    for (const name of this.speeds.keys()) {
      this.speeds.set(name, this.mechanism.value(name) || this.speeds.get(name));
    }
    this.play.textContent = this.moves ? 'Stop' : 'Play';
  }

  say({ reason }) {
    this.reason.say(reason ?? '');
  }

  /** Request a value of an output, or a place of a joint. */
  async want(want) {
    const answer = await this.connection.ask({ op: 'pose', mechanism: this.mechanism.key, want });
    if (answer.inputs) this.show(answer);
    if (answer.reach) answer.reason = inWords(answer.reach);
    return answer;
  }

  drag(want) {
    this.dragged.offer(want);
  }

  /** The request for arrows, at the inputs' speeds when it plays. */
  get arrows() {
    if (!this.mechanism.arrows.kind) return {};
    const speeds = Object.fromEntries([...this.inputs.keys()].map(name => [name, this.playing[`${name}.speed`] ?? this.usual(`${name}.speed`)]));
    return { arrows: this.mechanism.arrows.kind, speeds };
  }

  /** Request the present pose. */
  async look() {
    if (this.looking || !this.connection.opened) return;
    this.looking = true;
    const answer = await this.connection.ask({ op: 'pose', mechanism: this.mechanism.key, ...this.arrows });
    this.looking = false;
    if (answer.inputs) this.show(answer);
    else if (!this.inputs.size) this.say(answer);
  }

  show({ inputs, outputs, arrows }) {
    if (arrows) this.mechanism.show(arrows);
    const names = [...Object.keys(inputs), ...Object.keys(outputs)].join();
    if (names !== this.built) this.build(names, inputs, outputs);
    for (const [name, input] of Object.entries(inputs)) this.inputs.get(name).show(input);
    this.onshow();
    if (!this.folding.open) return;
    for (const [name, output] of Object.entries(outputs)) this.outputs.get(name).show(output, Object.values(inputs));
  }

  build(names, inputs, outputs) {
    this.built = names;
    this.say({});
    const want = async what => {
      const answer = await this.want(what);
      if (!inputs[what.output]) this.say(answer);
      return answer;
    };
    const [all, one] = [Object.keys(inputs), Object.keys(inputs).length === 1];
    this.inputs = new Map(Object.entries(inputs).map(([name, input]) => [name, new InputRow(name, input, want)]));
    this.outputs = new Map(Object.keys(outputs).map(name => [name, new OutputRow(name, one, all.length, want, answer => this.say(answer))]));
    this.place.replaceChildren(...[...this.inputs.values()].map(({ slider }) => slider.row));
    this.table.replaceChildren(
      element('thead', {}, element('tr', {}, element('th', { scope: 'col', textContent: 'output' }),
        element('th', { scope: 'col', textContent: 'value' }),
        ...all.map(name => element('th', { scope: 'col' }, 'd / d ', element('span', { textContent: name }))))),
      element('tbody', {}, ...[...this.outputs.values()].map(({ row }) => row)));
    this.folding.hidden = !this.outputs.size;
  }

  render() {
    for (const { slider } of this.inputs.values()) slider.render();
    for (const row of this.outputs.values()) if (row.output) row.render();
  }
}
