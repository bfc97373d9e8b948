// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Units: values are in radians and metres; they are displayed so, or in degrees and millimetres.

const WORKSHOP = { rad: ['°', 180 / Math.PI], m: ['mm', 1000] };
const listeners = [];

export const units = {
  workshop: false,

  /** The displayed unit for one such as 'rad', 'm/s', 'rad/m', and its factor. */
  of(unit) {
    if (!this.workshop || !unit) return { name: unit, factor: 1 };
    const parts = unit.split('/').map(part => WORKSHOP[part] ?? [part, 1]);
    const [[, over], [, under] = ['', 1]] = parts;
    return { name: parts.map(([name]) => name).join('/'), factor: over / under };
  },

  choose(workshop) {
    this.workshop = workshop;
    for (const listener of listeners) listener();
  },

  onchange(listener) {
    listeners.push(listener);
  },
};
