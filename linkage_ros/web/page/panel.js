// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The panel: motion, plot and parameters of each displayed mechanism.

import { element } from './control.js';
import { Files } from './files.js';
import { Motion } from './motion.js';
import { Plot } from './plot.js';
import { Tuning } from './tuning.js';
import { units } from './units.js';

const STILL = 2000;
const LOOKS = 120;

/** The section of one mechanism. Its `parts` have a method render(). */
class Section {
  constructor(mechanism, { light, refuse }, folded) {
    const { key, name, title } = mechanism;
    const type = mechanism.value('type') ?? '';
    this.mechanism = mechanism;
    this.motion = new Motion(mechanism, !folded, refuse);
    this.plot = new Plot(mechanism, this.motion);
    this.motion.place.after(this.plot.element);
    this.motion.onshow = () => this.plot.look();
    this.tuning = new Tuning(mechanism, !folded, own => light(mechanism, own));
    this.parts = [this.motion, this.plot, this.tuning];
    this.still = element('p', { className: 'still', hidden: true });
    this.loading = element('p', { className: 'about', textContent: 'Waiting for its parameters …', hidden: mechanism.settings.size > 0 });
    this.element = element('section', { ariaLabel: title },
      element('header', {}, element('h2', { textContent: title }),
        element('span', { className: 'about', textContent: type === name ? '' : type }), this.motion.play),
      this.still, this.loading, this.motion.element, ...this.tuning.speeds, this.tuning.element,
      new Files(mechanism).element);
    this.element.dataset.key = key;
  }

  /** Open the foldings that are open in the section that this one replaces. */
  after(old, built) {
    this.built = built;
    const title = folding => folding.firstElementChild.textContent;
    const open = new Set([...old?.element.querySelectorAll('details[open]') ?? []].map(title));
    for (const folding of this.element.querySelectorAll('details')) folding.open ||= open.has(title(folding));
    return this;
  }

  get inSight() {
    const { top, bottom } = this.element.getBoundingClientRect();
    return bottom > 0 && top < window.innerHeight;
  }

  update(name, value) {
    this.tuning.update(name, value);
    this.motion.renderPlay();
    this.mechanism.playing = this.motion.playing;
    this.plot.update(name);
  }
}

/** All displayed sections. */
export class Panel {
  /** Calls `light`, and `refuse` with the reason why a joint is not dragged. */
  constructor(place, light, refuse) {
    Object.assign(this, { place, light, refuse });
    this.sections = new Map();
    units.onchange(() => this.render());
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.render());
    setInterval(() => this.look(), LOOKS);
    document.addEventListener('keydown', event => this.key(event));
  }

  /** Show mechanisms; a section with unchanged settings is reused. */
  show(mechanisms, folded) {
    const before = this.sections;
    this.sections = new Map(mechanisms.map(one => {
      const built = JSON.stringify([folded, one.title, one.curves, Object.keys(one.inputs), [...one.settings.values()].map(({ value, ...rest }) => rest)]);
      const old = before.get(one.key);
      return [one.key, old?.built === built ? old : new Section(one, this, folded).after(old, built)];
    }));
    for (const [key, section] of before) if (this.sections.get(key) !== section) section.plot.end();
    const parts = [...this.sections.values()].map(section => section.element);
    if (parts.length !== this.place.children.length || parts.some((one, i) => one !== this.place.children[i])) {
      this.place.replaceChildren(...parts);
    }
    for (const { key, settings } of mechanisms) {
      for (const { name, value } of settings.values()) this.sections.get(key).update(name, value);
    }
  }

  update(key, name, value) {
    this.sections.get(key)?.update(name, value);
  }

  look() {
    for (const { motion, mechanism, inSight } of this.sections.values()) {
      if (inSight || mechanism.arrows.kind || !motion.inputs.size) motion.look();
    }
  }

  /** Keep arrows in step with the picture; those of many mechanisms come as often as all else. */
  follow() {
    if (this.sections.size > 1) return;
    for (const { motion, mechanism } of this.sections.values()) if (mechanism.arrows.kind) motion.look();
  }

  /** Undo by Ctrl-Z, except in a text field. */
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

  /** Show which mechanisms send no markers. */
  check(now) {
    for (const { mechanism, still } of this.sections.values()) {
      const silent = now - mechanism.lastMarkers;
      still.hidden = silent < STILL;
      still.textContent = `No markers for ${Math.round(silent / 1000)} s`;
    }
  }
}
