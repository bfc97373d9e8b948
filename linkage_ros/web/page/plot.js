// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A plot of an output over a turn or a stroke of the first input; the other inputs are fixed.

import { button, element, figures, Newest, put, Reason, shown, units } from './control.js';
import { isTuned } from './mechanism.js';
import { beside } from './motion.js';
import { multiples, paint } from './picture.js';

const FONT = "12px system-ui, 'Noto Sans', 'DejaVu Sans', sans-serif";
const DIGIT = 7.5;
const DEGREES = [1, 2, 5, 10, 15, 30, 45, 90, 180, 360];
const FIGURES = 4;
/** Values beyond the middle eight tenths by more than this many times their range grow without bound. */
const MAX_BEYOND = 8;
/** The least range of what is drawn, as a part of its values. */
const MIN_RANGE = 1e-9;

const figure = value => shown(value, '', FIGURES);

const options = names => names.map(textContent => element('option', { textContent }));

/** The range of the drawn values: all, except those that grow without bound. */
function bounds(values) {
  const sorted = values.filter(value => value !== null).sort((a, b) => a - b);
  if (!sorted.length) return [-1, 1];
  const [least, low, high, most] = [0, 0.1, 0.9, 1].map(part => sorted[Math.round(part * (sorted.length - 1))]);
  const way = high - low;
  const ends = [low - least > MAX_BEYOND * way ? low - way : least, most - high > MAX_BEYOND * way ? high + way : most];
  const size = Math.max(...ends.map(Math.abs), 1e-3);
  const room = ends[1] - ends[0] > MIN_RANGE * size ? 0.06 * (ends[1] - ends[0]) : 0.5 * size;
  return [ends[0] - room, ends[1] + room];
}

/** The curve, which ends where it has no value: a gap of the library's own is joined where it is narrow. */
function path(plot) {
  const stroke = new Path2D();
  const [xs, ys] = plot.data;
  let drawn = false;
  for (let i = 0; i < xs.length; i++) {
    if (ys[i] !== null) stroke[drawn ? 'lineTo' : 'moveTo'](plot.valToPos(xs[i], 'x', true), plot.valToPos(ys[i], 'y', true));
    drawn = ys[i] !== null;
  }
  return { stroke };
}

export class Plot {
  constructor(mechanism, motion) {
    /** The output of each kind that is plotted about outputs or about joints. */
    this.chosen = {};
    Object.assign(this, { mechanism, motion, fixed: '' });
    const choose = output => {
      this.chosen[this.about] = output;
      this.refresh();
    };
    this.kind = element('select', { ariaLabel: 'Quantity', onchange: () => this.refresh() }, ...options(Object.keys(mechanism.curves)));
    this.output = element('select', { ariaLabel: 'Output', onchange: () => choose(this.output.value) });
    this.other = element('input', { type: 'text', placeholder: 'distance(A,C)', ariaLabel: 'Another output', onchange: () => choose(this.other.value.trim() || undefined) });
    const enlarging = button('Enlarge', () => this.element.requestFullscreen(), { hidden: !document.fullscreenEnabled });
    this.now = element('div', { className: 'now' });
    this.place = element('div', { className: 'plot', role: 'img', tabIndex: 0, ariaLabel: 'No curve yet' });
    this.read = element('p', { className: 'answer' });
    this.marks = element('p', { className: 'answer' });
    this.reason = new Reason();
    this.element = element('details', { hidden: !this.kind.options.length }, element('summary', { textContent: 'Plot' }),
      element('div', { className: 'tools' }, this.kind, this.output, this.other, enlarging), this.reason.line, this.place, this.read, this.marks);
    this.element.ontoggle = () => this.refresh();
    this.requests = new Newest(() => this.request());
    new ResizeObserver(() => {
      if (this.element.open) this.plot?.setSize(this.size);
    }).observe(this.place);
  }

  get size() {
    return { width: this.place.clientWidth, height: this.place.clientHeight };
  }

  /** Whether a joint or an output is plotted; each of them keeps its own selection. */
  get about() {
    return this.mechanism.curves[this.kind.value];
  }

  /** Request the curve again. */
  refresh() {
    if (this.element.open && this.about) this.requests.offer();
  }

  /** Update the plot after a change of a parameter. */
  update(setting) {
    if (isTuned(setting)) this.refresh();
    else if (setting.group === 'speeds') this.render();
  }

  async request() {
    const { kind: { value: kind }, about } = this;
    const answer = await this.mechanism.ask('curve', { kind, output: this.chosen[about] });
    this.reason.say(answer.reason);
    if (answer.reason) this.chosen[about] = this.curve?.about === about ? this.curve.output : undefined;
    if (answer.reason || about !== this.about || !this.element.open) return;
    this.curve = { ...answer, about, kind };
    this.output.replaceChildren(...options([...new Set([...answer.names, answer.output])]));
    this.output.value = answer.output;
    this.other.hidden = about === 'joint';
    this.draw();
  }

  /** Draw the curve in the displayed units. */
  draw() {
    const { kind, input, output, units: [across, up], power, x, y, ends, dead } = this.curve;
    const [{ name: acrossName, factor: wide }, { name: upName, factor: high }] = this.units = [across, up].map(unit => units.of(unit));
    const { speed } = this.mechanism.inputs[input];
    const title = `${kind} of ${output}${power ? ` with the ${input} at ${figure(speed * wide)} ${acrossName}/s` : ''}`;
    this.data = [x.map(value => value * wide), y.map(value => value === null ? null : value * high * speed ** power)];
    this.bounds = bounds(this.data[1]);
    [this.dead, this.ends] = [dead, ends].map(values => values.map(value => value * wide));
    const labels = [`${input} [${acrossName}]`, upName];
    if (this.built !== labels.join() || !this.plot) {
      this.built = labels.join();
      this.plot?.destroy();
      this.plot = new window.uPlot(this.options(...labels), this.data, this.place);
      this.plot.over.append(this.now);
      this.hold(this.plot.over);
    } else {
      this.plot.setData(this.data);
    }
    this.describe(title, upName, labels[0]);
    this.follow();
  }

  /** Describe the plot in words. */
  describe(title, unit, across) {
    const known = this.data[1].filter(value => value !== null);
    const [from, to] = [this.data[0][0], this.data[0].at(-1)].map(figure);
    const ends = [Math.min(...known), Math.max(...known)];
    const isCut = this.bounds[0] > ends[0] || this.bounds[1] < ends[1];
    const [low, high] = isCut ? this.bounds : ends;
    const range = known.length ? `from ${figure(low)} to ${figure(high)}${unit && ` ${unit}`}${isCut ? ' and beyond' : ''}` : 'no value anywhere';
    const places = [['Dead points', this.dead], ['Ends of the reach', this.ends]].filter(([, { length }]) => length)
      .map(([what, values]) => ` ${what} at ${values.map(figure).join(', ')} ${this.units[0].name}.`);
    this.marks.textContent = `${title[0].toUpperCase()}${title.slice(1)}: ${range}.${places.join('') || ' No dead points.'}`;
    this.place.ariaLabel = `${this.marks.textContent} Over the ${across} from ${from} to ${to}.`;
  }

  options(across, up) {
    const axis = label => ({
      label, font: FONT, labelFont: FONT, stroke: () => paint('--ink'), labelSize: 20, labelGap: 0,
      grid: { stroke: () => paint('--grid'), width: 1 }, ticks: { show: false },
      // The library's own function adds steps up to the end, which may never be reached.
      splits: (_, side, low, high, step) => multiples(step, low, high),
      values: (_, splits) => splits.map(value => figures(value, 6)),
    });
    return {
      ...this.size, pxAlign: 0, legend: { show: false },
      cursor: { y: false, drag: { x: false, y: false } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: () => this.bounds } },
      series: [{}, { stroke: () => paint('--accent'), width: 2, points: { show: false }, paths: path }],
      axes: [
        { ...axis(across), size: 24, ...(this.units[0].name === '°' && { incrs: DEGREES }) },
        { ...axis(up), size: (_, values) => 10 + DIGIT * Math.max(2, ...(values ?? []).map(text => text.length)) },
      ],
      hooks: { drawAxes: [plot => this.mark(plot)], setCursor: [() => this.follow()] },
    };
  }

  /** Mark the dead points and the ends of the reach. */
  mark(plot) {
    const { ctx, bbox: { top, height } } = plot;
    const pixel = window.devicePixelRatio;
    ctx.save();
    ctx.lineWidth = 1.5 * pixel;
    for (const [places, colour, dash] of [[this.ends, '--faint', []], [this.dead, '--refused', [5, 4]]]) {
      ctx.strokeStyle = paint(colour);
      ctx.setLineDash(dash.map(length => length * pixel));
      for (const place of places) {
        const line = new Path2D();
        line.rect(plot.valToPos(this.inside(place), 'x', true), top, 0, height);
        ctx.stroke(line);
      }
    }
    ctx.restore();
  }

  /** A value of the input plus the whole turns that bring it into the plot. */
  inside(value) {
    const { turn } = this.mechanism.inputs[this.curve.input];
    return beside(value, (this.data[0][0] + this.data[0].at(-1)) / 2, turn * this.units[0].factor);
  }

  /** Move the input to the place where the pointer is pressed or dragged. */
  hold(over) {
    const move = ({ offsetX }) => this.motion.target.offer({
      output: this.curve.input, value: this.plot.posToVal(offsetX, 'x') / this.units[0].factor,
    });
    over.onpointerdown = event => {
      over.setPointerCapture(event.pointerId);
      move(event);
    };
    over.onpointermove = event => { if (event.buttons) move(event); };
  }

  /** Mark the present input, and print the value there or at the pointer. */
  follow() {
    if (!this.element.open || !this.curve) return;
    const [present, ...others] = [...this.motion.inputs.values()].map(({ accepted }) => accepted);
    if (present === undefined) return;
    // The curve is that of the other inputs' values.
    const fixed = others.map(value => value.toPrecision(6)).join();
    if (fixed !== this.fixed) this.refresh();
    this.fixed = fixed;
    const here = this.inside(present * this.units[0].factor);
    const left = this.plot.valToPos(here, 'x');
    this.now.style.transform = `translateX(${left}px)`;
    const idx = this.plot.cursor.idx ?? this.plot.valToIdx(here);
    const [x, y] = this.data.map(values => values[idx]);
    const { kind, input, output, units: [, unit] } = this.curve;
    // An angle is drawn without jumps, but printed within half a turn.
    const value = kind === 'position' && unit === 'rad' && y ? beside(y, 0, 2 * Math.PI * this.units[1].factor) : y;
    put(this.read, { textContent: `${input} ${figure(x)} ${this.units[0].name}: ${output} ${figure(value)} ${this.units[1].name}` });
  }

  render() {
    if (this.element.open && this.curve) this.draw();
  }

  /** Remove the plot with its listeners. */
  end() {
    this.plot?.destroy();
  }
}
