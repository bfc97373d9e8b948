// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The panel: motion, plot and parameters of each displayed mechanism.

import { isOpen } from './connection.js';
import { element, put } from './control.js';
import { Motion } from './motion.js';
import { Plot } from './plot.js';
import { Tuning } from './tuning.js';

const STILL = 2000;
const POLL = 120;

/** What a section is built from: with other values of the settings it stays the same. */
const formOf = ({ title, curves, inputs, settings }, folded) => JSON.stringify(
  [folded, title, curves, Object.keys(inputs), [...settings.values()].map(({ value, ...rest }) => rest)]);

/** The section of one mechanism. Its `parts` have a method render(). */
class Section {
  constructor(mechanism, { light, refuse }, folded, old) {
    const { key, name, title } = mechanism;
    const type = mechanism.value('type');
    this.mechanism = mechanism;
    this.form = formOf(mechanism, folded);
    this.motion = new Motion(mechanism, !folded, refuse);
    this.plot = new Plot(mechanism, this.motion);
    this.motion.place.after(this.plot.element);
    this.motion.onshow = () => this.plot.follow();
    this.tuning = new Tuning(mechanism, !folded, dimension => light(mechanism, dimension));
    this.parts = [this.motion, this.plot, this.tuning];
    this.still = element('p', { className: 'still', hidden: true });
    const about = element('p', { className: 'about', hidden: !mechanism.space, textContent: `${title} is a linkage in space: here it is drawn, played, tuned and saved. Dragging, outputs and plots are for linkages in a plane.` });
    this.element = element('section', { ariaLabel: title },
      element('header', {}, element('h2', { textContent: title }),
        element('span', { className: 'about', textContent: type === name ? '' : type }), this.motion.play),
      about, this.still, this.motion.element, ...this.tuning.speeds, this.tuning.element, this.tuning.files());
    this.element.dataset.key = key;
    // Foldings that are open in the section that this one replaces are open here.
    const openTitles = [...old?.element.querySelectorAll('details[open] > summary') ?? []].map(summary => summary.textContent);
    for (const summary of this.element.querySelectorAll('summary')) summary.parentElement.open ||= openTitles.includes(summary.textContent);
  }

  get inSight() {
    const { top, bottom } = this.element.getBoundingClientRect();
    return bottom > 0 && top < window.innerHeight;
  }

  update(setting) {
    this.tuning.update(setting);
    this.motion.renderPlay();
    this.plot.update(setting);
  }
}

/** All displayed sections, by their mechanisms' keys. */
export class Panel {
  /** Calls `light`, and `refuse` with the reason why a joint is not dragged. */
  constructor(place, light, refuse) {
    Object.assign(this, { place, light, refuse, arrows: '', sections: new Map() });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.render());
    setInterval(() => this.poll(), POLL);
    document.addEventListener('keydown', event => this.key(event));
  }

  /** Show mechanisms; a section that would be built alike is reused. */
  show(mechanisms, folded) {
    const before = this.sections;
    this.sections = new Map(mechanisms.map(mechanism => {
      const old = before.get(mechanism.key);
      return [mechanism.key, old?.form === formOf(mechanism, folded) ? old : new Section(mechanism, this, folded, old)];
    }));
    const sections = [...this.sections.values()];
    for (const section of before.values()) if (!sections.includes(section)) section.plot.end();
    // What is moved in the document loses its focus.
    if (sections.length !== before.size || sections.some(({ element: part }, i) => part !== this.place.children[i])) {
      this.place.replaceChildren(...sections.map(section => section.element));
    }
    for (const section of sections) {
      for (const setting of section.mechanism.settings.values()) section.update(setting);
    }
  }

  poll() {
    for (const { mechanism, motion, inSight, still } of this.sections.values()) {
      const silent = performance.now() - mechanism.lastMarkers;
      put(still, { hidden: !isOpen() || silent < STILL, textContent: `No markers for ${Math.round(silent / 1000)} s` });
      if (!mechanism.space && (inSight || this.arrows || !motion.inputs.size)) motion.poll(this.arrows);
    }
  }

  /** Keep arrows in step with the picture; those of many mechanisms come as often as all else. */
  follow() {
    if (this.sections.size === 1 && this.arrows) this.poll();
  }

  /** Undo by Ctrl-Z, except in a text field. */
  key(event) {
    const section = event.target.closest?.('section') ?? this.place.querySelector('section');
    if (event.key !== 'z' || !(event.ctrlKey || event.metaKey) || event.target.type === 'text' || !section) return;
    event.preventDefault();
    this.sections.get(section.dataset.key).tuning.undoing.click();
  }

  lit(key, name) {
    for (const [sectionKey, { tuning }] of this.sections) tuning.lit(sectionKey === key ? name : '');
  }

  render() {
    for (const { parts } of this.sections.values()) for (const part of parts) part.render();
  }
}
