// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The panel: for each mechanism that is shown how it moves, and what it is.

import { element } from './control.js';
import { Files } from './files.js';
import { Motion } from './motion.js';
import { Plot } from './plot.js';
import { Tuning } from './tuning.js';
import { units } from './units.js';

const STILL = 2000;
const LOOKS = 120;

/** The part of one mechanism. A part is an element with render(), to be added to `parts`. */
class Section {
  constructor(mechanism, connection, folded, light) {
    const { key, name } = mechanism;
    const type = mechanism.value('type') ?? '';
    this.mechanism = mechanism;
    this.motion = new Motion(mechanism, connection, !folded);
    this.plot = new Plot(mechanism, connection, this.motion);
    this.motion.place.after(this.plot.element);
    this.motion.onshow = () => this.plot.look();
    this.tuning = new Tuning(mechanism, connection, !folded, own => light(mechanism, own));
    this.parts = [this.motion, this.plot, this.tuning];
    this.still = element('p', { className: 'still', hidden: true });
    this.element = element('section', { ariaLabel: name },
      element('header', {}, element('h2', { textContent: name }),
        element('span', { className: 'about', textContent: type === name ? '' : type }), this.motion.play),
      this.still, this.motion.element, ...this.tuning.speeds, this.tuning.element,
      new Files(mechanism, connection).element);
    this.element.dataset.key = key;
  }

  update(name, value) {
    this.tuning.update(name, value);
    this.motion.renderPlay();
    this.mechanism.playing = this.motion.playing;
    this.plot.update(name);
  }
}

/** All sections that are shown. */
export class Panel {
  constructor(place, connection, light) {
    Object.assign(this, { place, connection, light });
    this.sections = new Map();
    this.built = '';
    units.onchange(() => this.render());
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.render());
    setInterval(() => this.look(), LOOKS);
    document.addEventListener('keydown', event => this.key(event));
  }

  /** Show mechanisms; sections that stay as they are keep what is unfolded and typed. */
  show(mechanisms, folded) {
    const built = JSON.stringify([folded, mechanisms.map(({ key, settings }) => [
      key, [...settings.values()].map(({ value, ...rest }) => rest)])]);
    if (built !== this.built) {
      this.built = built;
      for (const { plot } of this.sections.values()) plot.end();
      this.sections = new Map(mechanisms.map(one => [one.key, new Section(one, this.connection, folded, this.light)]));
      this.place.replaceChildren(...[...this.sections.values()].map(section => section.element));
    }
    for (const { key, settings } of mechanisms) {
      for (const { name, value } of settings.values()) this.sections.get(key).update(name, value);
    }
  }

  update(key, name, value) {
    this.sections.get(key)?.update(name, value);
  }

  look() {
    for (const { motion } of this.sections.values()) motion.look();
  }

  /** Undo by the usual key, where no text is written. */
  key(event) {
    const section = event.target.closest?.('section') ?? this.place.querySelector('section');
    if (event.key !== 'z' || !(event.ctrlKey || event.metaKey) || event.target.type === 'text' || !section) return;
    event.preventDefault();
    this.sections.get(section.dataset.key).tuning.undoing.click();
  }

  drag(key, want) {
    this.sections.get(key)?.motion.drag(want);
  }

  lit(key, name) {
    for (const [own, { tuning }] of this.sections) tuning.lit(own === key ? name : '');
  }

  goTo(key, name) {
    this.sections.get(key)?.tuning.goTo(name);
  }

  render() {
    for (const { parts } of this.sections.values()) for (const part of parts) part.render();
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
