// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A mechanism on the page: its description, its markers by topic, and its changes.

import { ask } from './connection.js';

/** Whether a setting is tuned, and not a motion. */
export const isTuned = ({ group }) => group && group !== 'speeds' && group !== 'starts';

export class Mechanism {
  constructor() {
    this.markers = new Map();
    this.lastMarkers = performance.now();
    /** Ranges and bars of dimensions, and fixed joints; empty until the viewer has answered. */
    this.tunable = { travel: {}, bars: {}, fixed: [] };
    /** The received arrows by joint. */
    this.arrows = { at: {} };
    /** Values to set for undo, one step a gesture, and the first value of each tuned parameter. */
    this.steps = [];
    this.first = new Map();
    this.settings = new Map();
  }

  /** Adopt a description; return the settings that it changes. */
  describe({ settings, ...description }) {
    Object.assign(this, description);
    const changed = settings.filter(({ name, value }) => String(value) !== String(this.value(name)));
    // Nothing is undone of another linkage that had the same name.
    if (changed.some(({ name }) => name === 'type' || name === 'joints')) Object.assign(this, { steps: [], first: new Map() });
    this.settings = new Map(settings.map(setting => [setting.name, setting]));
    for (const { name, value } of settings.filter(isTuned)) {
      if (!this.first.has(name)) this.first.set(name, value);
    }
    return changed;
  }

  /** Request something of the mechanism; return the answer. */
  ask(op, fields) {
    return ask({ op, key: this.key, ...fields });
  }

  value(name) {
    return this.settings.get(name)?.value;
  }

  /** The settings of a group: dimensions, branches, speeds, starts or more. */
  group(name) {
    return [...this.settings.values()].filter(({ group }) => group === name);
  }

  /** The names of the parameters that are not as they were at first. */
  get changed() {
    return [...this.first.keys()].filter(name => this.value(name) !== this.first.get(name));
  }

  /** The marker of its joints; a bar is half as wide. */
  get joints() {
    return [...this.markers.values()].flat().find(({ kind }) => kind === 'joints');
  }
}
